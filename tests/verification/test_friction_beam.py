"""Friction on base and gland of a beam: operators, momentum, energy, every scheme and formulation, extremes."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gapbeam
from gapbeam.solver.contact.solve import friction_solve
from gapbeam.solver.contact.solve.condensation import CondensedOperator
from gapbeam.solver.contact.solve.friction_solve import solve_laws
from gapbeam.solver.diagnostics.energy_ledger import Ledger, enter_step, open_ledger, restate
from gapbeam.solver.diagnostics.march_diagnostics import image_drift
from gapbeam.solver.integrators.scheme_choice import scheme_of
from gapbeam.solver.march.stepwise_march import EffectiveOperators, March, march
from gapbeam.solver.models.model import Model
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import MASS, State, Step, imaged
from tests.shared.command import DEMO
from tests.shared.models import COARSE, GRAVITY, SOLID, beam_model, face_forces, seat_of

MU = 0.3
FLAT = {"mesh": COARSE, "contact": {"friction": {"coefficient": MU, "slip_velocity": 1.0e-4}}}
BLOCK = {"mesh": SOLID, "contact": {"friction": {"coefficient": MU, "slip_velocity": 1.0e-4}}}
AXIAL = {"type": "base_motion", "name": "along", "amplitude": 300.0, "frequency": 100.0, "direction": [1.0, 0.0]}
UP = {"type": "base_motion", "name": "up", "amplitude": 400.0, "frequency": 200.0}


def changed(base: dict[str, Any], **contact: Any) -> dict[str, Any]:
    """The changes of a case with other keys of [contact]."""
    return {**base, "contact": {**base["contact"], **contact}}


def shaken(model: Model, dt: float = 5.0e-5, count: int = 100, start: State | None = None) -> tuple[Ledger, list[Step]]:
    """March from the seat, and the ledger at the end."""
    scheme = model.case.time.scheme
    state = start or seat_of(model, scheme.carries_acceleration).state
    plan = March(model.system, model.law, scheme, EffectiveOperators(model.system, scheme), dt, count)
    ledger, steps = open_ledger(model.system, model.law, state), []
    for step in march(plan, state):
        ledger = enter_step(model.system, model.law, ledger, step)
        if step.refreshed is not None:
            ledger = restate(model.system, model.law, ledger, step.refreshed)
        steps.append(step)
    return ledger, steps


def friction_by_face(model: Model, step: Step) -> Array:
    """Friction force on each face, (faces, k), N."""
    contact, traction = model.system.contact, step.stage.traction
    assert traction is not None
    forces = contact.weights[:, None] * traction
    return np.array([forces[contact.faces == face].sum(axis=0) for face in range(len(contact.face_names))])


@pytest.mark.parametrize("changes", [FLAT, BLOCK], ids=["2D", "3D"])
def test_slip_of_rigid_motions(changes: dict[str, Any]) -> None:
    """T takes a translation to itself along the faces, and a turn to minus its angle times the height."""
    model = beam_model(changes)
    contact, operators, dimension = model.system.contact, model.system.operators, model.case.mesh.dimension
    x = model.space.tabulate_dof_coordinates()
    for axis in range(dimension):
        moved = np.zeros((len(x), dimension))
        moved[:, axis] = 1.0
        slip = contact.slip(contact.interface.trace(moved.reshape(-1), operators))
        assert slip == pytest.approx(np.tile(np.eye(dimension)[axis, : dimension - 1], (contact.size, 1)), abs=1e-13)
    turned = np.zeros((len(x), dimension))
    turned[:, 0], turned[:, -1] = -x[:, dimension - 1], x[:, 0]
    slip = contact.slip(contact.interface.trace(turned.reshape(-1), operators))
    assert slip[:, 0] == pytest.approx(-contact.positions[:, dimension - 1], abs=1e-15)


@pytest.mark.parametrize("degree", [2, 12], ids=["by point", "by interface DOF"])
@pytest.mark.parametrize("changes", [FLAT, BLOCK], ids=["2D", "3D"])
def test_condensed_response_is_that_of_the_whole_system(changes: dict[str, Any], degree: int) -> None:
    """A^-1 (H^T f + T^T h) from the kept columns, against a solution of all DOFs, to 1e-10."""
    model = beam_model(changed(changes, quadrature_degree=degree))
    system, contact = model.system, model.system.contact
    condensed = CondensedOperator(system, *scheme_of("discrete-gradient").coefficients(system, 1.0e-4))
    random, directions = np.random.default_rng(1), model.case.mesh.dimension - 1
    assert (contact.size * (1 + directions) < contact.interface.size) == (degree == 2)
    forces, friction = random.random(contact.size), random.standard_normal((contact.size, directions))
    right_side = np.zeros(system.operators.size)
    contact.interface.add(right_side, contact.resultant(forces, friction))
    exact = condensed.solve_free(right_side)
    found = condensed.correct(np.zeros_like(exact), forces, friction)
    assert np.abs(found - exact).max() < 1e-10 * np.abs(exact).max()
    trace = contact.interface.trace(exact, system.operators)
    gaps, slips = contact.gap_matrix @ trace, contact.slip(trace)
    opened, moved = condensed.respond_all(forces, friction)
    assert np.abs(opened - gaps).max() < 1e-10 * np.abs(gaps).max()
    assert np.abs(moved - slips).max() < 1e-10 * np.abs(slips).max()
    dense = condensed.compliance @ np.concatenate([forces, friction.reshape(-1)])
    assert np.abs(dense - np.concatenate([gaps, slips.reshape(-1)])).max() < 1e-10 * np.abs(slips).max()


@pytest.mark.parametrize("share", [0.02, 0.3, 1.0])
@pytest.mark.parametrize("degree", [2, 12], ids=["by point", "by interface DOF"])
@pytest.mark.parametrize("changes", [FLAT, BLOCK], ids=["2D", "3D"])
def test_linear_laws_hold_at_all_points(changes: dict[str, Any], degree: int, share: float) -> None:
    """Drawn laws L x = x0 - E z on a share of the points, the response z = s D x to what was found: to 1e-8.

    Of many points in contact no compliance of all motions is formed, which took 16 GB where 4000 points touch.
    """
    model = beam_model(changed(changes, quadrature_degree=degree))
    system, contact = model.system, model.system.contact
    condensed = CondensedOperator(system, *scheme_of("discrete-gradient").coefficients(system, 1.0e-4))
    random, each = np.random.default_rng(2), model.case.mesh.dimension
    known = random.standard_normal((contact.size, each))
    touched, scale = random.random(contact.size) < share, 0.7
    root = random.standard_normal((contact.size, each, each)) * 10.0 ** random.uniform(-1.0, 1.0, (contact.size, 1, 1))
    stiffness = np.where(touched[:, None, None], root @ root.swapaxes(1, 2), 0.0)
    stiffness[:, 0, 1:] = stiffness[:, 1:, 0] = 0.0
    stiffness /= scale * condensed.largest_compliance
    pull = np.where(touched[:, None], random.uniform(-0.5, 0.5, (contact.size, each - 1)), 0.0)
    found = solve_laws(condensed, scale, known, stiffness, pull)
    opened, moved = condensed.respond_all(found[:, 0], found[:, 1:])
    wanted = known - np.einsum("pab,pb->pa", stiffness, scale * np.column_stack([opened, moved]))
    wanted[:, 1:] -= pull * found[:, :1]
    assert np.abs(found - wanted).max() < 1e-8 * np.abs(found).max()
    assert "compliance" not in vars(condensed) or degree == 2


@pytest.mark.parametrize(("changes", "velocity"), [(FLAT, [0.5]), (BLOCK, [0.3, 0.4])], ids=["2D", "3D"])
def test_sliding_beam_loses_momentum_to_friction(changes: dict[str, Any], velocity: list[float]) -> None:
    """A beam that slides as a whole: the friction forces of both faces are what its momentum loses (Newton), to 1e-7.

    All slip is fast, so they have the size mu (N_base + N_gland) and the direction of the velocity, but for the turn
    of 2 degrees that friction at one end gives the solid beam.
    """
    weak = {"restraint": {"axial": 1.0e-3, **({"lateral": 1.0e-3} if len(velocity) == 2 else {})}}
    model = beam_model({**changes, **weak, "time": {"scheme": "implicit-midpoint"}})
    dimension, operators = model.case.mesh.dimension, model.system.operators
    seat = seat_of(model).state
    speed = np.zeros((operators.size // dimension, dimension))
    speed[:, : dimension - 1] = velocity
    start = State(0.0, seat.u, imaged(operators, speed.reshape(-1)), seat.depth, seat.pressure)
    dt, count = 1.0e-5, 40
    _, steps = shaken(model, dt, count, start)
    beam = model.case.beam
    mass = model.case.material.density * beam.length * beam.thickness * beam.width
    momentum = [state.v[MASS].reshape(-1, dimension).sum(axis=0)[:-1] for state in (start, steps[-1].new)]
    assert momentum[0] == pytest.approx(mass * np.array(velocity), rel=1e-10)
    normal = sum(sum(face_forces(model.system.contact, step.stage.pressure).values()) for step in steps) * dt
    along = np.array(velocity) / np.linalg.norm(velocity)
    lost = momentum[0] - momentum[1]
    assert lost == pytest.approx(-dt * sum(friction_by_face(model, step).sum(axis=0) for step in steps), rel=1e-7)
    assert np.linalg.norm(lost) == pytest.approx(MU * normal, rel=2e-3)
    assert lost @ along == pytest.approx(np.linalg.norm(lost), rel=1e-3)
    assert normal == pytest.approx(87.5 * dt * count, rel=0.1)  # 48.5 N and 39.0 N by statics


CONSERVING = ["discrete-gradient", "implicit-midpoint"]
COMBINATIONS = [
    *(("penalty", scheme) for scheme in (*CONSERVING, "newmark", "hht-alpha", "generalized-alpha")),
    ("unilateral", "discrete-gradient"),
    ("unilateral", "generalized-alpha"),
    ("unilateral", "moreau-jean"),
    ("augmented-lagrangian", "implicit-midpoint"),
]


@pytest.mark.parametrize(("formulation", "scheme"), COMBINATIONS)
def test_axial_shaking_with_every_scheme_and_formulation(formulation: str, scheme: str) -> None:
    """Shaken along and up: no step halved, balance to 1e-6 of the energy exchanged, friction within mu N, and a loss.

    The images K u that a step carries along stay those of products with K.
    """
    damped = {"damping": {"mass": 5.0, "stiffness": 1.0e-5}, "time": {"scheme": scheme}}
    model = beam_model({**changed(FLAT, formulation=formulation), **damped}, (GRAVITY, AXIAL, UP))
    ledger, steps = shaken(model)
    assert len(steps) == 100
    assert abs(ledger.residual) < 1e-6 * ledger.exchanged
    assert ledger.friction_loss > 1e-3 * ledger.exchanged
    for step in steps:
        normal = np.array(list(face_forces(model.system.contact, step.stage.pressure).values()))
        sliding = np.abs(friction_by_face(model, step)[:, 0])
        assert np.all(sliding <= MU * normal * (1.0 + 1e-9) + 1e-9)
    drift, force = image_drift(steps[-1])
    assert drift < 1e-6 * force


@pytest.mark.parametrize("scheme", CONSERVING)
def test_friction_takes_energy_in_every_step(scheme: str) -> None:
    """Midpoint schemes: the work of friction is never positive beyond round-off of the slip solve."""
    model = beam_model({**FLAT, "time": {"scheme": scheme}}, (GRAVITY, AXIAL, UP))
    seat = seat_of(model).state
    ledger, losses = open_ledger(model.system, model.law, seat), []
    for step in shaken(model)[1]:
        before, ledger = ledger.friction_loss, enter_step(model.system, model.law, ledger, step)
        losses.append(ledger.friction_loss - before)
    assert min(losses) > -1e-12 * max(losses)
    assert max(losses) > 0.0


def test_no_coefficient_is_no_friction_bit_for_bit() -> None:
    """A coefficient of 0 leaves the same operators and the same bits of every state as no table at all."""
    marches = []
    for friction in (None, {"coefficient": 0.0}):
        model = beam_model(changed(FLAT, friction=friction), (GRAVITY, AXIAL, UP))
        assert model.system.contact.tangents is None
        assert len(model.defaults) == 1
        ledger, steps = shaken(model)
        assert ledger.friction_loss == 0.0
        marches.append(steps)
    for plain, zero in zip(*marches, strict=True):
        assert np.array_equal(plain.new.u, zero.new.u)
        assert np.array_equal(plain.new.v, zero.new.v)
        assert np.array_equal(plain.new.pressure, zero.new.pressure)
        assert zero.new.traction is None
    assert max(step.new.pressure.max() for step in marches[0]) > 0.0


def test_little_friction_changes_little() -> None:
    """The motion with mu = 1e-6 is that without friction but for a share of mu: the extended operators are the same."""
    ends = []
    for mu in (0.0, 1.0e-6):
        model = beam_model(changed(FLAT, friction={"coefficient": mu, "slip_velocity": 1.0e-4}), (GRAVITY, AXIAL))
        ends.append(shaken(model, count=40)[1][-1].new.u[0])
    apart = np.abs(ends[1] - ends[0]).max()
    assert 0.0 < apart < 1e-5 * np.abs(ends[0]).max()


@pytest.mark.parametrize("mu", [1.0e-6, 1.0, 10.0])
@pytest.mark.parametrize("slip_velocity", [1.0e-9, 10.0])
def test_extremes(mu: float, slip_velocity: float) -> None:
    """Hardly any and very much friction, hardly any and very much regularization: the balance still closes."""
    friction = {"coefficient": mu, "slip_velocity": slip_velocity}
    model = beam_model(changed(FLAT, friction=friction), (GRAVITY, AXIAL, UP))
    ledger, steps = shaken(model)
    assert steps[-1].new.time == pytest.approx(100 * 5.0e-5)
    assert len(steps) == 100 or mu > 1.0  # only much friction needs halved steps
    assert abs(ledger.residual) < 1e-6 * ledger.exchanged
    assert ledger.friction_loss > 0.0
    assert ledger.contact_gain < 1e-9 * ledger.exchanged


@pytest.mark.parametrize("changes", [FLAT, BLOCK], ids=["2D", "3D"])
def test_a_start_with_much_creep_reaches_the_same(changes: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    """Solved from the contact without friction by a slip velocity that falls, the motion is the same, to 1e-8."""
    along = {**AXIAL, "direction": [1.0, 0.5, 0.0][: 3 if changes is BLOCK else 2]}
    loads = (GRAVITY, along, UP) if changes is FLAT else (GRAVITY, along)
    model = beam_model(changed(changes, friction={"coefficient": 1.0, "slip_velocity": 1.0e-4}), loads)
    _, straight = shaken(model, count=40)
    monkeypatch.setattr(friction_solve, "MOST_UPDATES", 0)
    _, eased = shaken(model, count=40)
    size = np.abs(straight[-1].new.u[0]).max()
    assert np.abs(eased[-1].new.u[0] - straight[-1].new.u[0]).max() < 1e-8 * size
    assert sum(step.iterations for step in straight) < sum(step.iterations for step in eased)


def test_stuck_beam_follows_its_support() -> None:
    """Shaken along with less than mu times the normal forces, the beam creeps by no more than v0 q / sqrt(1 - q^2).

    Mass times acceleration is what friction has to bear; q is its share of mu (N_base + N_gland) = 26 N.
    """
    gentle = {**AXIAL, "amplitude": 10.0, "frequency": 50.0}
    model = beam_model({**FLAT, "time": {"scheme": "generalized-alpha"}}, (GRAVITY, gentle))
    _, steps = shaken(model, 1.0e-4, 200)
    share = 0.51 * 0.012 * 0.02 * 7919.0 * 10.0 / (MU * 87.5)
    bound = 1.0e-4 * share / np.sqrt(1.0 - share**2)
    contact, operators = model.system.contact, model.system.operators
    fastest = max(
        float(np.abs(contact.slip(contact.interface.trace(step.new.v[0], operators))[step.new.pressure > 0.0]).max())
        for step in steps[50:]
    )
    # the edges that carry most creep with the body behind them, which gives way by micrometers
    assert fastest < 20.0 * bound
    free = beam_model({**changed(FLAT, friction=None), "time": {"scheme": "generalized-alpha"}}, (GRAVITY, gentle))
    sliding = shaken(free, 1.0e-4, 200)[1][-1].new.u[0].reshape(-1, 2)[:, 0]
    assert np.abs(steps[-1].new.u[0].reshape(-1, 2)[:, 0]).max() < 0.05 * np.abs(sliding).max()


@pytest.mark.parametrize("scheme", ["discrete-gradient", "generalized-alpha"])
def test_a_run_records_friction(tmp_path: Path, caplog: pytest.LogCaptureFixture, scheme: str) -> None:
    """History, summary and log report the friction forces, within mu times the normal force, and the loss."""
    settings: dict[str, object] = {
        "contact.friction.coefficient": MU,
        "time.scheme": scheme,
        "time.end": 0.01,
        "load.shaker.amplitude": 500.0,
        "load.shaker.frequency": 100.0,
        "load.shaker.ramp": 0.0,
    }
    with caplog.at_level(logging.INFO, "gapbeam"):
        outcome = gapbeam.run(DEMO, settings, tmp_path / "run")
    assert outcome.exit_status == 0, outcome.message
    results = gapbeam.open_results(tmp_path / "run")
    history, summary = results.history, results.summary
    force, normal = history["friction_force"], history["contact_force"]
    assert force.dims == ("time", "face", "tangent")
    assert force["tangent"].values.tolist() == ["x"]
    assert force.attrs["units"] == "N"
    assert np.abs(force.values).max() > 1.0
    assert np.all(np.abs(force.values[..., 0]) <= MU * normal.values * (1.0 + 1e-9) + 1e-9)
    loss = history["friction_dissipation"].values
    assert loss[0] == 0.0
    assert loss[-1] == summary["energy"]["friction_dissipation"] > 0.0
    assert summary["friction"]["coefficient"] == MU
    # 1 % of 2 pi 100 Hz times half the thickness times clearance over support length
    assert summary["friction"]["slip_velocity"] == pytest.approx(0.01 * 628.3185 * 0.006 * 0.107e-3 / 0.05, rel=1e-6)
    assert 1.0 < max(summary["friction"]["peak_force"].values()) <= MU * max(summary["peak_contact_force"].values())
    assert [default["key"] for default in summary["defaults"]] == [
        "contact.stiffness",
        "contact.friction.slip_velocity",
    ]
    assert "friction took" in caplog.text
