"""Reduced bases: frequencies, statics and motion of the finite elements that they come from."""

from __future__ import annotations

import gc
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI
from numpy.polynomial import polynomial
from scipy.linalg import eigh
from scipy.sparse import csr_matrix

from gapbeam.solver.linear_algebra.petsc_operators import PetscOperators
from gapbeam.solver.march.simulation import march_of_model
from gapbeam.solver.march.stepwise_march import march
from gapbeam.solver.messages.errors import NotConverged
from gapbeam.solver.models.body import body_key
from gapbeam.solver.models.model import Model, build_body, build_model, model_of
from gapbeam.solver.models.reduction.contact_lines import across_lines
from gapbeam.solver.models.reduction.reduced_body import reduced_body
from gapbeam.solver.models.reduction.vibration_modes import Modes, lowest_modes, with_rigid_motions
from gapbeam.solver.models.solid_body import finite_elements
from gapbeam.solver.run.verdict import remarks_on_model
from gapbeam.solver.system.semi_discrete import VALUE
from tests.shared.models import BEAM, COARSE, GRAVITY, SOLID, beam_case, beam_model, bending_frequencies, seat_of

PUSH = {"type": "harmonic_force", "name": "push", "point": 0.15, "amplitude": 400.0, "frequency": 100.0}
LOADS = (GRAVITY, PUSH)
PROBES = {"tip": 0.51, "middle": 0.25}


def tip_motion(model: Model, steps: int = 60) -> np.ndarray:
    """Return the displacement of the probes over some steps from the seat, (steps, probes, components)."""
    plan = replace(march_of_model(model, model.case.time.scheme), steps=steps)
    operators = model.system.operators
    return np.array(
        [
            [probe.evaluate(step.new.u[VALUE], operators) for probe in model.probes.values()]
            for step in march(plan, seat_of(model).state)
        ]
    )


def apart(one: np.ndarray, other: np.ndarray) -> float:
    """Return the rms difference of two motions relative to the rms of the first."""
    return float(np.sqrt(np.mean((one - other) ** 2) / np.mean(one**2)))


def pair(mesh: dict[str, object], **model: object) -> tuple[Model, Model]:
    """Return the full model of a rattling beam and a reduced one, with a contact soft enough for 1e-4 s."""
    changes = {"mesh": {**BEAM["mesh"], **mesh}, "contact": {"stiffness": 1e12}}
    full = beam_model(changes, LOADS, PROBES)
    reduced = beam_model({**changes, "model": {"type": "reduced", **model}}, LOADS, PROBES)
    return full, reduced


def test_modes_are_those_of_scipy() -> None:
    """Within round-off of the stiffness: 1e-8 of the first elastic mode, up to 2e-7 from 25 random starts of SciPy."""
    model = beam_model()
    mass, stiffness = model.system.operators.matrices()
    factor = model.system.operators.shifted_solver(mass, stiffness.copy(), 1e5, 1e-9)
    modes = lowest_modes(mass, stiffness, factor, 1e5, 12)
    assert modes.shapes.T @ np.stack(
        [model.system.operators.apply_mass(shape) for shape in modes.shapes.T], axis=1
    ) == pytest.approx(np.eye(len(modes.squares)), abs=1e-9)
    for frequency in bending_frequencies(model, 3):
        assert np.min(np.abs(modes.frequencies / frequency - 1.0)) < 1e-6


@pytest.mark.parametrize("shift", [1e5, 1e11, 1e14, 1e16])
@pytest.mark.parametrize("count", [4, 12, 30])
def test_modes_do_not_depend_on_the_shift(shift: float, count: int) -> None:
    """Far above the squares wanted, the shift leaves them close together: the Krylov space has to grow."""
    operators = beam_model().system.operators
    assert isinstance(operators, PetscOperators)
    mass, stiffness = operators.matrices()
    factor = operators.shifted_solver(mass, stiffness.copy(), shift, 1e-9)
    modes = with_rigid_motions(lowest_modes(mass, stiffness, factor, shift, count), operators)
    dense = [csr_matrix(matrix.getValuesCSR()[::-1]).toarray() for matrix in (stiffness, mass)]
    squares = eigh(*dense, eigvals_only=True)[:count]
    assert modes.squares[:count] == pytest.approx(squares, rel=1e-6, abs=1e-12 * shift + 1.0)


@pytest.mark.parametrize("stop", [KeyboardInterrupt(), NotConverged("no digits")], ids=["signal", "error"])
def test_what_stops_a_solve_of_the_eigensolver_is_what_ends_it(
    stop: BaseException, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """A signal, or an error of the factor, in any solve: no error of PETSc in its place, and no trace."""
    operators = beam_model().system.operators
    mass, stiffness = operators.matrices()
    factor = operators.shifted_solver(mass, stiffness.copy(), 1e5, 1e-9)
    whole, calls = type(factor).solve, iter(range(100))

    def solve(self: object, right_side: np.ndarray) -> np.ndarray:
        if next(calls) == 7:
            raise stop
        return np.asarray(whole(self, right_side))

    monkeypatch.setattr(type(factor), "solve", solve)
    with pytest.raises(type(stop)):
        lowest_modes(mass, stiffness, factor, 1e5, 12)
    gc.collect()
    assert "ignored" not in capfd.readouterr().err


@pytest.mark.parametrize("mesh", [{}, SOLID], ids=["2D", "3D"])
def test_a_rigid_motion_that_the_eigensolver_misses_is_put_back(mesh: dict[str, Any]) -> None:
    """One direction among the rigid motions is taken out of the modes; nothing is added where nothing is missed."""
    operators = beam_model({"mesh": mesh}).system.operators
    assert isinstance(operators, PetscOperators)
    mass, stiffness = operators.matrices()
    factor = operators.shifted_solver(mass, stiffness.copy(), 1e5, 1e-9)
    whole = lowest_modes(mass, stiffness, factor, 1e5, 14)
    assert with_rigid_motions(whole, operators) is whole
    rigid = operators.rigid_motions.shape[1]
    mixed = np.linalg.qr(np.random.default_rng(3).normal(size=(rigid, rigid)))[0][:, 1:]
    shapes = np.column_stack([whole.shapes[:, :rigid] @ mixed, whole.shapes[:, rigid:]])
    fewer = Modes(whole.squares[1:], shapes, factor)
    found = with_rigid_motions(fewer, operators)
    assert found.shapes.shape == whole.shapes.shape
    assert np.all(np.diff(found.squares) >= 0.0)
    for motion in operators.rigid_motions.T:
        carried = operators.apply_mass(motion)
        assert np.sum((found.shapes.T @ carried) ** 2) == pytest.approx(motion @ carried, rel=1e-9)


def test_all_modes_below_a_frequency_are_found() -> None:
    model = beam_model()
    mass, stiffness = model.system.operators.matrices()
    factor = model.system.operators.shifted_solver(mass, stiffness.copy(), 1e5, 1e-9)
    many = lowest_modes(mass, stiffness, factor, 1e5, 25)
    below = lowest_modes(mass, stiffness, factor, 1e5, 1, below=3000.0)
    assert len(below.squares) == np.sum(many.frequencies <= 3000.0)
    assert below.frequencies == pytest.approx(many.frequencies[: len(below.squares)], abs=1e-3)


@pytest.mark.parametrize("thickness", [0.02, 0.1, 0.4, 2.0])
@pytest.mark.parametrize("interface", ["free", "fixed"])
def test_the_seat_of_a_thick_body_is_that_of_its_mesh(thickness: float, interface: str) -> None:
    """Static shapes hold where the body is as thick as long, or a column; under a force it sags as its mesh does."""
    changes: dict[str, dict[str, Any]] = {
        "beam": {"length": 0.2, "thickness": thickness},
        "support": {"length": 0.05},
        "contact": {"stiffness": 1e12},
        "mesh": {"size": 0.05, "support_size": 0.025, "cells_through_thickness": 4},
    }
    push = {"type": "constant_force", "name": "push", "point": 0.15, "amplitude": -1e5}
    basis = {"type": "reduced", "contact": "all", "modes": 10, "interface": interface}
    full, reduced = (
        beam_model({**changes, "model": model}, (GRAVITY, push), {"tip": 0.2}) for model in ({"type": "full"}, basis)
    )
    moved = [
        model.probes["tip"].evaluate(seat_of(model).state.u[VALUE], model.system.operators) for model in (full, reduced)
    ]
    assert moved[1] == pytest.approx(moved[0], rel=0.01)


def test_a_basis_of_all_contact_dofs_moves_like_the_mesh() -> None:
    full, reduced = pair({}, contact="all", modes=60)
    assert reduced.dofs < 0.2 * full.dofs
    assert apart(tip_motion(full), tip_motion(reduced)) < 1e-5


@pytest.mark.parametrize("interface", ["free", "fixed"])
def test_a_compact_basis_moves_nearly_like_the_mesh(interface: str) -> None:
    full, reduced = pair({}, interface=interface)
    error = apart(tip_motion(full), tip_motion(reduced))
    _, fewer = pair({}, interface=interface, modes=4, shapes=3)
    assert error < 2e-3
    assert error < 0.5 * apart(tip_motion(full), tip_motion(fewer))


def test_the_seat_is_that_of_the_mesh() -> None:
    full, reduced = pair({})
    one, other = seat_of(full).state, seat_of(reduced).state
    area = full.system.contact.weights
    assert reduced.system.contact.weights == pytest.approx(area)
    forces = [
        [(area * seat.pressure)[full.system.contact.faces == face].sum() for face in (0, 1)] for seat in (one, other)
    ]
    assert forces[1] == pytest.approx(forces[0], rel=1e-4)
    assert apart(full.expand(one.u[VALUE]), reduced.expand(other.u[VALUE])) < 1e-4


def test_what_nothing_symmetric_moves_is_left_out() -> None:
    full, reduced = pair(SOLID)
    basis = reduced.body.basis
    assert basis is not None
    assert basis.left_out > 5
    body = finite_elements(full.case, full.body.meshed)
    settings = reduced.case.model.model_copy(update={"points_across": "all"})
    exact = model_of(full.case, reduced_body(body, settings))
    assert reduced.system.contact.size < 0.3 * full.system.contact.size
    assert exact.system.contact.size == full.system.contact.size
    motion = tip_motion(full)
    assert apart(motion, tip_motion(exact)) < 2e-3
    assert apart(motion, tip_motion(reduced)) < 4e-3


THIN = {
    "box": {"type": "box", "wall": 0.0006},
    "i": {"type": "i", "web": 0.0008, "flange": 0.0006},
}


@pytest.mark.slow(minutes=0.2)
@pytest.mark.parametrize("kind", THIN)
def test_thin_walls_rest_on_their_webs(kind: str) -> None:
    """Under a load at its tip a beam of thin walls tilts in its support as that of all points of its mesh does."""
    mesh = {**BEAM["mesh"], **SOLID}
    changes = {"beam": {"section": THIN[kind]}, "mesh": mesh, "contact": {"stiffness": 1e13}}
    loads = (GRAVITY, {"type": "constant_force", "point": 0.51, "amplitude": -60.0})
    tips = []
    for model in ({"type": "full"}, {"type": "reduced"}, {"type": "reduced", "points_across": 1}):
        made = beam_model({**changes, "model": model}, loads, {"tip": 0.51})
        u = seat_of(made).state.u[VALUE]
        tips.append(float(made.probes["tip"].evaluate(u, made.system.operators)[2]))
    assert tips[1] == pytest.approx(tips[0], rel=0.01)
    assert abs(tips[2] / tips[0] - 1.0) > 0.02, "the case would pass with pressures that are even across the width"


@pytest.mark.slow(minutes=0.3)
def test_a_load_beside_the_axis_keeps_all_motions() -> None:
    loads = (GRAVITY, {**PUSH, "point": [0.15, 0.005, 0.0]})
    changes = {"mesh": {**BEAM["mesh"], **SOLID}, "contact": {"stiffness": 1e12}}
    probes = {"axis": 0.51, "side": (0.51, 0.009, 0.0)}
    full = beam_model(changes, loads, probes)
    reduced = beam_model({**changes, "model": {"type": "reduced"}}, loads, probes)
    basis = reduced.body.basis
    assert basis is not None
    assert basis.left_out == 0
    every = beam_model({**changes, "model": {"type": "reduced", "points_across": "all"}}, loads, probes)
    motion, other = tip_motion(full, 20), tip_motion(every, 20)
    twist = motion[:, 1, 2] - motion[:, 0, 2]
    assert np.abs(twist).max() > 1e-2 * np.abs(motion).max()
    assert apart(twist, other[:, 1, 2] - other[:, 0, 2]) < 1e-3
    assert apart(motion, tip_motion(reduced, 20)) < 2e-3


def test_the_neglected_flexibility_shrinks_with_the_basis() -> None:
    def neglected(**model: object) -> tuple[float, float]:
        basis = beam_model({"model": {"type": "reduced", **model}}).body.basis
        assert basis is not None
        return basis.neglected, basis.neglected_smooth

    few, some, every = (neglected(modes=4, shapes=2), neglected(modes=4, shapes=9), neglected(modes=4, contact="all"))
    assert few[0] > 1.5 * some[0] > 1.5 * every[0]
    assert few[1] > 1.5 * some[1] > 1.5 * every[1]
    assert max(every) < 1e-6


def test_lines_integrate_like_the_points_they_replace() -> None:
    contact = beam_model({"mesh": {**BEAM["mesh"], **SOLID, "cells_across_width": 3}}).system.contact
    fewer = across_lines(contact, 3, False, 1e-3)
    assert fewer.size == contact.size * 3 // 12
    x, y = contact.positions[:, 0], contact.positions[:, 1]
    for coefficients in np.eye(6):  # degree 5: the square of a gap of degree 2 is integrated like a pressure
        wanted = float(contact.weights @ (x * polynomial.polyval(y / 0.01, coefficients)))
        got = float(
            fewer.weights @ (fewer.positions[:, 0] * polynomial.polyval(fewer.positions[:, 1] / 0.01, coefficients))
        )
        assert got == pytest.approx(wanted, rel=1e-9, abs=1e-12)
    # the polynomial through the gaps of the line gives the gap at a node
    assert fewer.shares @ y**2 == pytest.approx(fewer.positions[:, 1] ** 2, abs=1e-12)
    mirrored = across_lines(contact, 1, True, 1e-3)
    assert mirrored.size == contact.size // 12
    assert mirrored.weights.sum() == pytest.approx(contact.area)


def test_a_body_serves_variants_of_its_case() -> None:
    case = beam_case({"model": {"type": "reduced"}}, LOADS, PROBES)
    other = case.model_copy(
        update={
            "support": case.support.model_copy(update={"clearance": 0.2e-3}),
            "contact": case.contact.model_copy(update={"stiffness": 1e12, "damping": 1e3}),
            "load": tuple(
                load.model_copy(update={"amplitude": 9.0}) if load.name == "push" else load for load in case.load
            ),
        }
    )
    assert body_key(case) == body_key(other)
    assert body_key(case) != body_key(beam_case({"model": {"type": "reduced"}, "mesh": {"size": 0.03}}, LOADS, PROBES))
    assert body_key(case) != body_key(beam_case({}, LOADS, PROBES))
    shared = model_of(other, build_body(case, MPI.COMM_SELF))
    assert tip_motion(shared, 20) == pytest.approx(
        tip_motion(build_model(other, MPI.COMM_SELF), 20), rel=1e-9, abs=1e-15
    )


def test_coarse_meshes_have_smaller_bases_than_asked_for() -> None:
    model = beam_model({"mesh": {**BEAM["mesh"], **COARSE}, "model": {"type": "reduced", "modes": 1000, "shapes": 50}})
    assert model.dofs <= model.mesh_dofs


def test_a_basis_that_is_too_small_is_reported() -> None:
    def remarks(**model: object) -> str:
        made = beam_model({"model": {"type": "reduced", **model}})
        return " ".join(remarks_on_model(made.case, made))

    assert remarks() == ""
    assert "the modes of the basis reach to" in remarks(modes=1)
    assert "the contact faces' static flexibility" in remarks(interface="fixed", modes=3, shapes=3)


def test_round_off_decides_on_no_part_of_a_basis() -> None:
    """A steel 10 % stiffer and heavier vibrates alike: as many vectors, the same highest frequency in other round-off.

    Responses to contact forces at neighboring nodes are nearly the same; their differences are where the highest
    frequencies are. They differed by 9 %, and one vector was lost.
    """
    mesh = {"size": 0.02, "support_size": 2.5e-3, "cells_through_thickness": 2}
    bases = []
    for share in (1.0, 1.1):
        steel = {"young_modulus": share * 2.1e11, "density": share * 7919.0}
        tables = {"mesh": mesh, "model": {"type": "reduced", "contact": "all"}, "material": steel}
        bases.append(beam_model({**tables, "restraint": {"axial": share * 1.0e3}}).body.basis)
    one, other = bases
    assert one is not None
    assert other is not None
    assert other.size == one.size
    assert other.highest == pytest.approx(one.highest, rel=1e-6)
