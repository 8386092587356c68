"""Graded beam elements and the basis of many: against theory, against equal elements and against the whole system."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpi4py import MPI
from scipy.linalg import eigh

import gapbeam
from gapbeam.meshes.mesh_size import CellLength
from gapbeam.solver.case import solution_tables
from gapbeam.solver.case.beam_motions import beam_motions
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.model_choice import graded_count, graded_places, longest_element
from gapbeam.solver.case.solution_tables import SPACING_OF_WAVE, BeamModel
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.memory.memory_check import memory_of
from gapbeam.solver.messages.errors import CaseError
from gapbeam.solver.models.body import body_key
from gapbeam.solver.models.model import Model, build_model
from gapbeam.solver.models.reduction.span_basis import wave_count
from gapbeam.solver.models.timoshenko_beam import SteppedBeam
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Array
from tests.shared.command import alone

CANTILEVER = np.array([1.8751040687, 4.6940911330, 7.8547574382])
Tables = dict[str, Any]


def tube(length: float, supports: list[tuple[float, float]], model: object, **more: object) -> Case:
    """Return a tube between a clamp and a pin, in plates with four walls each, from one place to another."""
    joints = [{"name": "foot", "type": "clamped", "point": 0.0}, {"name": "top", "type": "pinned", "point": length}]
    plates = [
        {
            "name": f"plate{number}", "from": start, "to": end, "clearance": 1.0e-4,
            "region": {"type": "polygon", "walls": [-135.0, -45.0, 45.0, 135.0]},
        }
        for number, (start, end) in enumerate(supports)
    ]  # fmt: skip
    tables: Tables = {
        "beam": {"length": length, "thickness": 0.02, "width": 0.02, "section": {"type": "tube", "wall": 0.0015}},
        "material": {"young_modulus": 2.0e11, "poisson_ratio": 0.3, "density": 8000.0},
        "joint": joints,
        "support": plates,
        "model": model,
        "mesh": {"dimension": 3},
        "contact": {"stiffness": 2.0e11},
        "load": [{"type": "gravity", "direction": [0.0, 0.0, -1.0]}],
        "probe": [{"name": "middle", "point": 0.45 * length}],
        "time": {"end": 0.01, "step": 2.0e-5},
    }
    return gapbeam.read_case({**tables, **more})


@st.composite
def supported(draw: st.DrawFn) -> tuple[float, list[tuple[float, float]]]:
    """Return a length, m, and supports that do not touch each other."""
    length, count = draw(st.floats(1.0, 12.0)), draw(st.integers(1, 8))
    pitch = length / (count + 1)
    ends = list[tuple[float, float]]()
    for number in range(count):
        width = draw(st.floats(0.01, 0.05))
        middle = pitch * (number + 1) + draw(st.floats(-0.2, 0.2)) * pitch
        ends.append((middle - 0.5 * width, middle + 0.5 * width))
    return length, ends


@settings(max_examples=20, deadline=None)
@given(supported(), st.integers(2, 600))
def test_nodes_are_as_many_as_asked_for_and_lie_at_the_ends_of_supports(
    scene: tuple[float, list[tuple[float, float]]], elements: int
) -> None:
    """The number is the user's; neighbors are alike where there are enough; what supports and waves ask for is met."""
    length, supports = scene
    case = tube(length, supports, {"type": "beam"})
    places = graded_places(case, elements)
    assert len(places) == elements + 1
    assert places[0] == 0.0
    assert places[-1] == length
    assert np.all(np.diff(places) > 0.0)
    count = graded_count(case)
    places = graded_places(case, count)
    assert {end for support in supports for end in support} <= set(places.tolist())
    for start, end in supports:
        assert np.sum((places >= start) & (places <= end)) >= 6
    sizes = np.diff(places)
    assert np.max(np.maximum(sizes[1:] / sizes[:-1], sizes[:-1] / sizes[1:])) < 2.5
    model = BeamModel(type="beam", elements=count, spacing="graded")
    assert sizes.max() == pytest.approx(longest_element(case, model))
    # fewer by far than equal elements that are as short in the shortest support
    assert count < 0.6 * length / sizes.min()


@st.composite
def loaded(draw: st.DrawFn) -> Tables:
    """Return a load whose highest frequency lies far above or below the frequencies of the beam."""
    highest, kind = draw(st.floats(0.2, 2.0e3)), draw(st.sampled_from(["harmonic", "noise", "sweep", "record"]))
    match kind:
        case "harmonic":
            return {"type": "harmonic_force", "point": 0.3, "amplitude": 1.0, "frequency": highest}
        case "noise":
            spectrum = {"type": "white", "density": 1.0, "high": highest}
            return {"type": "random", "quantity": "acceleration", "spectrum": spectrum}
        case "sweep":
            ends = {"start_frequency": 0.1, "end_frequency": highest, "duration": 0.01}
            return {"type": "swept-sine", "quantity": "acceleration", "amplitude": 1.0, **ends}
    times = np.linspace(0.0, 8.0 / highest, 400)
    with NamedTemporaryFile("w", suffix=".csv", delete=False) as file:
        np.savetxt(file, np.column_stack([times, np.sin(2.0 * np.pi * highest * times)]))
    return {"type": "recorded_motion", "file": file.name, "beyond": "zero"}


@settings(max_examples=40, deadline=None)
@given(supported(), loaded(), st.integers(2, 600), st.sampled_from(["equal", "graded"]))
def test_a_body_that_studies_share_has_the_elements_of_its_case(
    scene: tuple[float, list[tuple[float, float]]], load: Tables, elements: int, spacing: str
) -> None:
    """What is left of a case in the key of its body gives the same elements and spans, without the file of a record."""
    case = tube(*scene, {"type": "beam", "elements": elements, "spacing": spacing}, load=[load])
    assert isinstance(case.model, BeamModel)
    key, places, waves = body_key(case), graded_places(case, elements), wave_count(case)
    if "file" in load:
        Path(load["file"]).unlink()
    if case.model.graded:
        assert graded_places(key, elements).tolist() == places.tolist()
    if not case.model.is_whole(len(beam_motions(case))):
        assert wave_count(key) == waves


@settings(max_examples=10, deadline=None)
@given(supported(), st.sampled_from([1, 2]))
def test_graded_elements_have_the_frequencies_and_the_deflection_of_theory(
    scene: tuple[float, list[tuple[float, float]]], more: int
) -> None:
    """A cantilever: roots of Euler and Bernoulli, and P L^3 / (3 E I) + P L / (kappa G A) at its tip."""
    case = tube(*scene, {"type": "beam"})
    beam = SteppedBeam.of_case(case, more * graded_count(case), graded=True)
    operators, part = beam.operators().dense, beam.parts[0]
    free = slice(2, None)
    squares = eigh(operators.stiffness[free, free], operators.mass[free, free], eigvals_only=True)[:3]
    length = case.beam.length
    wanted = (CANTILEVER / length) ** 4 * part.bending / part.mass
    slenderness = 0.02 / length  # shear and rotatory inertia lower the third frequency by about 60 times its square
    assert squares == pytest.approx(wanted, rel=1.0e-3 + 150.0 * slenderness**2)
    tip = np.zeros(beam.size - 2)
    tip[-2] = 1.0
    deflection = np.linalg.solve(operators.stiffness[free, free], tip)[-2]
    conditioning = (length / np.diff(beam.places).min()) ** 4  # of K, which bounds what round-off leaves from above
    allowed = 1.0e-6 + 1.0e-3 * np.finfo(float).eps * conditioning
    assert deflection == pytest.approx(length**3 / (3.0 * part.bending) + length / part.shear, rel=allowed)


def flexibility(model: Model) -> tuple[Array, Array]:
    """Return the lowest frequencies, Hz, and the flexibility of some contact points, m/N."""
    operators, contact = model.system.operators, model.system.contact
    assert isinstance(operators, DenseOperators)
    some = contact.gap_matrix[:: max(1, contact.size // 50)].toarray()
    squares, _ = operators.modes
    return np.sqrt(squares[:12]) / (2.0 * np.pi), some @ np.linalg.solve(operators.stiffness, some.T)


PLATES = [(0.49, 0.51), (0.98, 1.01), (1.4, 1.45)]


@alone
@pytest.mark.parametrize(
    "model",
    [
        {"type": "beam", "elements": 60},
        {"type": "beam", "elements": 60, "spacing": "graded", "stations": 1},
        {"type": "beam", "elements": 60, "spacing": "graded", "stations": 3},
    ],
    ids=["stations by default", "one station", "three stations"],
)
@pytest.mark.parametrize("rubs", [False, True], ids=["smooth", "rubs"])
def test_a_basis_of_many_elements_is_the_whole_system(
    model: Tables, rubs: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same body as it is marched whole and by its basis: frequencies, flexibility of the faces, DOFs marched."""
    more = {"contact": {"stiffness": 2.0e11, "friction": {"coefficient": 0.3}}} if rubs else {}
    case = tube(2.0, PLATES, model, **more)
    monkeypatch.setattr(solution_tables, "FEW", 1000)
    whole = build_model(case, MPI.COMM_SELF)
    monkeypatch.setattr(solution_tables, "DENSE", 10)
    monkeypatch.setattr(solution_tables, "FEW", 10)
    small = build_model(case, MPI.COMM_SELF)
    assert whole.body.basis is None
    assert small.body.basis is not None
    assert small.dofs < whole.dofs
    (wanted, moved), (found, given_way) = flexibility(whole), flexibility(small)
    assert found == pytest.approx(wanted, rel=1.0e-4)
    assert given_way == pytest.approx(moved, abs=1.0e-5 * np.abs(moved).max())
    assert small.body.basis.neglected < 1.0e-4


@alone
@pytest.mark.slow(minutes=0.2)
def test_the_seat_on_stations_is_that_on_the_points_of_the_mesh() -> None:
    """A heavy tube on its plates: what each plate carries, with 1 to 8 stations and with all points of the mesh."""
    carried = []
    for stations in (None, 1, 3, 8):
        model = BeamModel(type="beam", elements=80, spacing="graded", stations=stations)
        case = tube(6.0, [(1.99, 2.01), (3.98, 4.02)], "beam").model_copy(update={"model": model})
        simulation = Simulation.of_case(case, MPI.COMM_SELF)
        state, contact = simulation.seat().state, simulation.model.system.contact
        up = contact.across[:, 1] * contact.weights * state.pressure
        carried.append([up[contact.faces == face].sum() for face in (0, 1)])
    mesh, *others = np.array(carried)
    assert np.all(mesh > 1.0)
    assert np.array(others) == pytest.approx(np.tile(mesh, (3, 1)), rel=0.02)


@alone
@pytest.mark.parametrize("elements", [700, 3000])
def test_thousands_of_elements_are_marched_in_few_dofs(elements: int) -> None:
    """The elements are as many as asked for, and what is marched and kept does not grow with them."""
    case = tube(3.0, PLATES, {"type": "beam", "elements": elements, "stations": 2})
    model = build_model(case, MPI.COMM_SELF)
    assert model.body.expansion is not None
    assert model.body.expansion.nodes.shape[1] == 2 * 2 * (elements + 1)
    assert model.dofs < 250
    assert model.system.contact.gap_matrix.shape[1] == model.dofs
    # theory: the clamped and pinned tube without its plates, whose first root is 3.9266
    part = SteppedBeam.of_case(case, 2).parts[0]
    first = (3.9266023 / 3.0) ** 2 * np.sqrt(part.bending / part.mass) / (2.0 * np.pi)
    assert flexibility(model)[0][0] == pytest.approx(first, rel=2.0e-3)


@pytest.mark.parametrize(("length", "count"), [(3.0, 4), (8.0, 8), (12.0, 12)])
def test_auto_takes_few_elements_for_tubes_in_many_plates(length: float, count: int) -> None:
    """Five elements in each plate would be thousands of equal ones; memory that is predicted follows the elements."""
    pitch = length / (count + 1)
    plates = [(pitch * (number + 1) - 0.005, pitch * (number + 1) + 0.005) for number in range(count)]
    case = tube(length, plates, "auto")
    assert isinstance(case.model, BeamModel)
    assert case.model.graded
    assert case.model.elements < 40 * (count + 1)
    assert longest_element(case, case.model) <= SPACING_OF_WAVE * length
    needs = memory_of(case, 1.0e5)["beam"]
    assert needs < 1.0e8
    equal = case.model_copy(update={"model": BeamModel(type="beam", elements=100_000)})
    assert memory_of(equal, 1.0e5)["beam"] > 1.0e9


@pytest.mark.parametrize("model", ["beam", "rigid"])
def test_stations_ask_for_supports_around_the_beam_or_round_sections(model: str) -> None:
    gap = {"name": "gap", "from": 0.5, "to": 0.6, "clearance": 1.0e-4, "region": {"type": "slot"}}
    given, slab = {"type": model, "stations": 2}, {"length": 2.0, "thickness": 0.02, "width": 0.02}
    with pytest.raises(CaseError, match="stations") as error:
        tube(2.0, PLATES, given, support=[gap], beam=slab, joint=[])
    assert "leave stations out" in str(error.value)
    assert tube(2.0, PLATES, given, support=[gap], joint=[]).model.rings == 2


@settings(max_examples=50, deadline=None)
@given(
    st.lists(st.tuples(st.floats(0.1, 10.0), st.floats(0.001, 1.0)), min_size=1, max_size=6),
    st.lists(st.tuples(st.floats(0.0, 10.0), st.floats(0.001, 1.0)), max_size=8),
    st.tuples(st.floats(0.0, 10.0), st.floats(0.0, 10.0)),
)
def test_a_part_of_a_cell_length_is_the_whole_one_there(
    regions: list[tuple[float, float]], sources: list[tuple[float, float]], ends: tuple[float, float]
) -> None:
    """To the last bit, at places one by one and together."""
    whole = CellLength(tuple(sorted(regions)), tuple(sources))
    low, high = sorted(ends)
    part, places = whole.between(low, high), np.linspace(low, high, 50)
    assert np.array_equal(part(places), whole(places))
    assert [float(part(x)) for x in places] == whole(places).tolist()
    assert all(first <= second for first, second in pairwise(sorted(part.regions)))
