"""Round beams in holes with rigid sections: against surfaces that deform, beam elements, and statics."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI
from scipy.sparse import csr_matrix

import gapbeam
from gapbeam.solver.case.analysis_table import unit_motions
from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.linear_algebra.petsc_operators import PetscOperators
from gapbeam.solver.march.compiled.compiled_march import CompiledLoop
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.march.stepwise_march import begun, march
from gapbeam.solver.models.model import Model, build_model
from gapbeam.solver.models.reduction.reduced_body import RigidSections
from gapbeam.solver.models.reduction.span_basis import basis_remarks
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import VALUE
from tests.shared.passages import followed

LENGTH, DIAMETER, CLEARANCE = 0.8, 0.02, 1.0e-4  # m
HOLES = ({"name": "a", "from": 0.1, "to": 0.12}, {"name": "b", "from": 0.6, "to": 0.63})
RIGID = {"type": "reduced", "sections": "rigid", "modes": 16}
SURFACE = {"type": "reduced", "modes": 16, "shapes": 7}
BEAM = {"type": "beam", "elements": 80}
COARSE = {"size": 0.15, "support_size": 0.012, "edge_size": 0.012}
WEIGHT = {"type": "gravity"}
SHAKER = {
    "type": "harmonic_force",
    "name": "shaker",
    "point": 0.35,
    "amplitude": 12.0,
    "frequency": 30.0,
    "direction": [0.0, 1.0, 0.3],
}


def tables_of(kind: dict[str, Any], **more: Any) -> dict[str, Any]:
    """Return a round bar in two holes."""
    holes = [{"clearance": CLEARANCE, "region": "hole"} | one for one in HOLES]
    return {
        "beam": {"length": LENGTH, "thickness": DIAMETER, "width": DIAMETER, "section": "round"},
        "material": {"young_modulus": 2.0e11, "poisson_ratio": 0.3, "density": 7850.0},
        "support": holes,
        "mesh": {"dimension": 3, "cells_through_thickness": 2, "cells_across_width": 2} | COARSE,
        "model": kind,
        "contact": {"stiffness": 5.0e9},
        "damping": {"frequencies": [40.0, 400.0], "ratios": [0.01, 0.01]},
        "load": [WEIGHT],
        "probe": [{"name": "mid", "point": 0.35}, {"name": "tip", "point": LENGTH}],
        "time": {"end": 0.04, "step": 2.0e-5},
    } | more


def model_of(kind: dict[str, Any], **more: Any) -> Model:
    """Return the model of such a bar."""
    return build_model(gapbeam.read_case(tables_of(kind, **more)), MPI.COMM_SELF)


def seated(model: Model) -> tuple[Array, Array]:
    """Return the force vector of each support, (faces, 2), N, and the places of the probes, (probes, 2), m."""
    seat, contact = Simulation(model).seat().state, model.system.contact
    forces = -(contact.weights * seat.pressure)[:, None] * -contact.across
    found = np.zeros((len(contact.face_names), 2))
    np.add.at(found, contact.faces, forces)
    places = [probe.evaluate(seat.u[VALUE], model.system.operators)[1:] for probe in model.probes.values()]
    return found, np.array(places)


def test_stations_move_as_the_section_does() -> None:
    """A rigid motion of the bar moves the stations exactly; forces on them have its resultant and its moment."""
    body = model_of({"type": "full"}).body
    rings = RigidSections.of_body(body, 4).rings
    assert len(rings.places) == 8
    places = body.meshed.space.tabulate_dof_coordinates()
    for axis in (1, 2):
        moved = np.zeros_like(places)
        moved[:, axis], moved[:, 0] = 1e-3 + 2e-3 * places[:, 0], -2e-3 * places[:, axis]
        traced = rings.interface.trace(moved.reshape(-1), body.operators)
        wanted = np.zeros((len(rings.places), 2))
        wanted[:, axis - 1] = 1e-3 + 2e-3 * rings.places
        assert (rings.motions @ traced).reshape(-1, 2) == pytest.approx(wanted, abs=1e-15)
    turned = np.stack([0.0 * places[:, 0], -places[:, 2], places[:, 1]], axis=1).reshape(-1)
    traced = rings.interface.trace(turned, body.operators)
    assert np.abs(rings.motions @ traced).max() < 1e-9 * DIAMETER
    nodes, weights = np.array([-1.0, -(0.2**0.5), 0.2**0.5, 1.0]), np.array([1.0, 5.0, 5.0, 1.0])  # of Lobatto
    assert rings.places[:4] == pytest.approx(0.11 + 0.01 * nodes, abs=1e-9)  # between 0.1 and 0.12 m
    assert rings.areas[:4] == pytest.approx(weights / 12.0 * rings.areas[:4].sum(), rel=1e-6)
    points = RigidSections(body, rings).points
    assert points.area == pytest.approx(points.weights.sum())
    forces = np.arange(points.size) + 1.0
    assert points.spread(forces).sum() == pytest.approx(forces.sum())
    assert points.spread(forces).min() > 0.0


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("region", ["hole", {"type": "polygon", "walls": [-60.0, 60.0]}], ids=["hole", "V-block"])
def test_a_bar_hangs_on_an_elastic_joint_that_leaves_it_free_sideways(region: Any) -> None:
    """Round-off moves it aside by less than 1e-6 of the clearance; q L^4 / 8 E I + q L / k + q L^3 / 2 c within 1 %."""
    vertical, rotation = 2.0e5, 4.0e4
    stiffness = {"axial": vertical, "vertical": vertical, "rotation": rotation}
    joint = [{"type": "elastic", "name": "root", "point": 0.0, "stiffness": stiffness}]
    supports = [{"clearance": 3.0e-3, "region": region} | one for one in HOLES]
    forces, (_, (aside, tip)) = seated(model_of(RIGID, joint=joint, support=supports))
    line_load = 7850.0 * 0.25 * np.pi * DIAMETER**2 * 9.81
    bending = 2.0e11 * np.pi * DIAMETER**4 / 64.0
    springs = line_load * LENGTH * (1.0 / vertical + 0.5 * LENGTH**2 / rotation)
    assert not forces.any()
    assert tip == pytest.approx(-line_load * LENGTH**4 / (8.0 * bending) - springs, rel=0.01)
    assert abs(aside) < 3.0e-9


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("section", ["round", {"type": "tube", "wall": 0.002}])
def test_seats_are_those_of_the_surface(section: Any) -> None:
    """Reactions within 1 % (0.2 %, in fact) of those of the surface that deforms and of a statically determinate bar.

    The tip agrees within 1 % of the clearance.
    """
    beam = {"length": LENGTH, "thickness": DIAMETER, "width": DIAMETER, "section": section}
    load = [WEIGHT | {"acceleration": 18.0, "direction": [0.0, 1.5, -1.0]}]
    kinds = {"rigid": RIGID, "surface": SURFACE, "beam": BEAM}
    found = {name: seated(model_of(kind, beam=beam, load=load)) for name, kind in kinds.items()}
    for other in ("surface", "beam"):
        assert found["rigid"][0] == pytest.approx(found[other][0], rel=0.01)
        assert found["rigid"][1] == pytest.approx(found[other][1], abs=0.01 * CLEARANCE)
    whole = found["rigid"][0].sum(axis=0)
    assert whole[0] / whole[1] == pytest.approx(-1.5, rel=1e-3)


@pytest.mark.slow
def test_supports_of_all_kinds_hold_a_stepped_bar() -> None:
    """A V-block, a worn hole out of line and an inclined hexagon: seats as those of beam elements in them."""
    support = [
        {"name": "v", "from": 0.1, "to": 0.12, "clearance": 0.0, "region": {"type": "polygon", "walls": [-45.0, 45.0]}},
        {
            "name": "worn", "from": 0.4, "to": 0.42, "clearance": CLEARANCE, "offset": 3e-5, "lateral": -4e-5,
            "region": {"type": "profile", "angles": [-90.0, 0.0, 90.0, 180.0], "recesses": [0.0, 5e-5, 0.0, 2e-5]},
        },
        {
            "name": "six", "from": 0.7, "to": 0.72, "clearance": CLEARANCE, "tilt": 4e-4,
            "region": {"type": "polygon", "walls": [-150.0, -90.0, -30.0, 30.0, 90.0, 150.0]},
        },
    ]  # fmt: skip
    segment = [{"name": "thick", "from": 0.2, "to": 0.35, "thickness": 0.026, "width": 0.026}]
    load = [WEIGHT | {"direction": [0.0, 0.6, -1.0]}]
    mesh = {"dimension": 3, "cells_through_thickness": 3, "cells_across_width": 3} | COARSE
    found = [seated(model_of(kind, support=support, segment=segment, load=load, mesh=mesh)) for kind in (RIGID, BEAM)]
    assert np.linalg.norm(found[1][0], axis=1).min() > 0.5  # every support is touched
    assert found[0][0] == pytest.approx(found[1][0], abs=0.03 * np.abs(found[1][0]).max())
    assert found[0][1] == pytest.approx(found[1][1], abs=0.02 * CLEARANCE)


def marched(kind: dict[str, Any], end: float) -> tuple[Array, Array, Simulation]:
    """March under the shaker; return forces, N, places of the probes, m, and the simulation."""
    time = {"end": end, "step": 1.0e-5}
    simulation = Simulation(model_of(kind, load=[WEIGHT, SHAKER], time=time))
    rows = np.concatenate([row.matrix[1:] for row in simulation.model.probes.values()])  # type: ignore[attr-defined]
    passage = followed(CompiledLoop(simulation.plan), simulation.seat().state, simulation.plan.steps, rows)
    return passage.forces, passage.probes, simulation


@pytest.mark.slow(minutes=0.1)
def test_orbits_are_those_of_beam_elements() -> None:
    """Before chaos sets in: orbits within 1 % of their size, mean forces within 1 %, and their peaks within 10 %."""
    found, expected = marched(RIGID, 0.03), marched(BEAM, 0.03)
    size = np.ptp(expected[1], axis=0)
    assert size.max() > CLEARANCE
    assert np.sqrt(np.mean((found[1] - expected[1]) ** 2, axis=0)) == pytest.approx(0.0 * size, abs=0.01 * size.max())
    assert found[0].mean(axis=0) == pytest.approx(expected[0].mean(axis=0), rel=0.01)
    means = [forces.reshape(10, -1, 2).max(axis=1).mean(axis=0) for forces in (found[0], expected[0])]
    assert means[0] == pytest.approx(means[1], rel=0.1)


@pytest.mark.slow(minutes=0.1)
def test_the_surface_slides_as_the_section_does() -> None:
    """Rigid motions move the surface along the holes and around them; the work of sliding is that of beam elements."""
    model = model_of(RIGID, wear={})
    contact, body = model.system.contact, model.body
    places, around = contact.positions, np.stack([-contact.across[:, 1], contact.across[:, 0]], axis=1)
    for number, motion in enumerate(unit_motions()):
        q = body.rigid[number]  # V^T M u of a rigid motion u is its q
        moved = motion.at(places)
        wanted = np.stack([moved[:, 0], np.sum(moved[:, 1:] * around, axis=1)], axis=1)
        assert contact.slip(q) == pytest.approx(wanted, abs=1e-6 * np.abs(moved).max())
    shaken = {"load": [WEIGHT, SHAKER], "time": {"end": 0.03, "step": 1.0e-5}, "wear": {}}
    works = []
    for kind in (RIGID, BEAM):
        simulation = Simulation(model_of(kind, **shaken))
        start = begun(simulation.plan, simulation.seat().state)
        accounts = Accounts.opened(simulation.plan.system, simulation.plan.law, start, simulation.plan.dt)
        *_, _last = CompiledLoop(simulation.plan).blocks(start, simulation.plan.steps, accounts)
        works.append(accounts.sliding.by_face)
    assert works[0].min() > 0.0
    assert works[0] == pytest.approx(works[1], rel=0.02)


@pytest.mark.slow(minutes=0.1)
def test_the_compiled_march_takes_the_sections() -> None:
    """Two rows for each station instead of one for each point; the same numbers as step by step, to 1e-9."""
    simulation = Simulation(model_of(RIGID, load=[WEIGHT, SHAKER]))
    plan, seat, contact = simulation.plan, simulation.seat().state, simulation.model.system.contact
    loop = CompiledLoop(plan)
    assert loop._table.around is not None
    assert loop._table.gaps.shape[0] == 2 * 2 * 8 < contact.size / 8
    steps = 150
    expected = [step.new for step, _ in zip(march(plan, seat), range(steps), strict=False)]
    assert any(np.count_nonzero(state.pressure) for state in expected)
    end = followed(loop, seat, steps).end
    assert end.u[VALUE] == pytest.approx(expected[-1].u[VALUE], abs=1e-9 * np.abs(expected[-1].u[VALUE]).max())
    assert end.v[VALUE] == pytest.approx(expected[-1].v[VALUE], abs=1e-9 * np.abs(expected[-1].v[VALUE]).max())
    assert end.pressure == pytest.approx(expected[-1].pressure, abs=1e-8 * max(expected[-1].pressure.max(), 1.0))


@pytest.mark.slow(minutes=0.1)
def test_bounces_keep_their_energy() -> None:
    """A bar that is thrown about in its holes without damping: the balance closes to 1e-9 of the energy exchanged."""
    simulation = Simulation(model_of(RIGID, damping={}, load=[WEIGHT, SHAKER | {"amplitude": 60.0}]))
    plan, seat = simulation.plan, simulation.seat().state
    accounts = Accounts.opened(plan.system, plan.law, seat, plan.dt)
    followed(CompiledLoop(plan), seat, plan.steps, accounts=accounts)
    assert accounts.ledger.exchanged > 0.01
    assert abs(accounts.ledger.residual) < 1e-9 * accounts.ledger.exchanged


@pytest.mark.slow(minutes=0.2)
def test_what_sections_leave_out_is_measured() -> None:
    """The deformation under a pressure on half of a section, against solves on the mesh; large ones are warned of.

    Of a force z on the surface and the same force r spread around, (z - r)^T D (z - r) bounds what a basis with the
    response to r misses of z, and is hardly more.
    """
    thin = {"length": LENGTH, "thickness": DIAMETER, "width": DIAMETER, "section": {"type": "tube", "wall": 0.0008}}
    bar, tube = model_of(RIGID), model_of(RIGID, beam=thin)
    assert bar.body.basis is not None
    assert tube.body.basis is not None
    assert bar.body.basis.section_flexibility < 0.1 * tube.body.basis.section_flexibility  # type: ignore[operator]
    assert not [remark for remark in basis_remarks(bar.body.basis, 1.0) if "rigid sections" in remark]
    notable = replace(tube.body.basis, neglected_smooth=0.03)
    assert [remark for remark in basis_remarks(notable, 1.0) if "rigid sections leave out 3 %" in remark]
    body = model_of({"type": "full"}, beam=thin).body
    operators, contact = body.operators, body.contact
    assert isinstance(operators, PetscOperators)
    rings = RigidSections.of_body(body, 8).rings
    factor = operators.factor(2.0e4, 1.0)  # K + sigma M: the body floats
    here = contact.faces == 0
    lobe = np.where(here, np.maximum(contact.across[:, 1], 0.0), 0.0) * contact.weights
    lobe /= float(lobe @ contact.across[:, 1])
    local = np.zeros(operators.size)
    contact.interface.add(local, contact.resultant(lobe))
    stations = np.where(rings.faces == 0, rings.areas, 0.0) / rings.areas[rings.faces == 0].sum()
    spread = np.zeros(operators.size)
    rings.interface.add(spread, csr_matrix(rings.motions).T @ np.stack([0.0 * stations, stations], axis=1).reshape(-1))
    difference = local - spread
    bound = float(difference @ factor.solve(difference))
    assert 0.6 * bound < tube.body.basis.section_flexibility <= 1.05 * bound  # type: ignore[operator]


@pytest.mark.slow(minutes=0.1)
def test_moving_holes_carry_the_bar_along() -> None:
    """A hole that rises lifts the bar: as beam elements do, step by step the same."""
    motion = {
        "type": "support_motion", "name": "lift", "support": "b",
        "amplitude": 2e-4, "frequency": 20.0,
    }  # fmt: skip
    found = []
    for kind in (RIGID, BEAM):
        simulation = Simulation(model_of(kind, load=[WEIGHT, motion]))
        rows = np.concatenate([row.matrix[2:] for row in simulation.model.probes.values()])  # type: ignore[attr-defined]
        passage = followed(CompiledLoop(simulation.plan), simulation.seat().state, simulation.plan.steps, rows)
        found.append(passage.probes)
    assert np.ptp(found[1]) > 3e-4
    assert np.sqrt(np.mean((found[0] - found[1]) ** 2)) < 0.02 * np.ptp(found[1])
