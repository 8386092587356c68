"""Round holes that are met as circles: orbits, rubs, bounces and poses against closed forms.

The force of a station is central, F(r) = K A (r - c) with A = diameter times length, so that energy and angular
momentum stay constant for ever, and every answer is that of one particle in a potential well.
"""

from __future__ import annotations

from dataclasses import replace
from math import cos, pi, sin, sqrt
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.sparse import csr_matrix

from gapbeam.solver.case.analysis_table import NAMES
from gapbeam.solver.contact.formulations.circle_contact import circle_contact
from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.contact.laws.damper import CoulombFriction
from gapbeam.solver.contact.laws.springs import Spring
from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.integrators.scheme_choice import scheme_of
from gapbeam.solver.march.compiled.compiled_march import CompiledLoop
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.march.stepwise_march import EffectiveOperators, March, begun, march
from gapbeam.solver.models.model import Model
from gapbeam.solver.periodic.period_map import ModalMap
from gapbeam.solver.supports.regions.around_face import BoreFace
from gapbeam.solver.supports.support import Support
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.modal_coordinates import modal_system
from gapbeam.solver.system.operators import Array, Interface, Load, RankOnes
from gapbeam.solver.system.semi_discrete import VALUE, ContactOperator, SemiDiscreteSystem, State, imaged
from gapbeam.studies.trials.response import TrialResponse, respond
from gapbeam.studies.trials.starts import seated
from tests.verification.test_orbits_in_a_ring import (
    ALPHA,
    CLEARANCE,
    DIAMETER,
    LENGTH,
    MASS,
    SOFT,
    SPEED,
    energies,
    momenta,
    ring,
)

HOLE = {
    "name": "ring", "from": 0.0, "to": LENGTH, "clearance": CLEARANCE, "region": {"type": "hole", "contact": "circle"},
}  # fmt: skip
FREE = {"axial": 1.0e-3, "lateral": 1.0e-9}  # N/m: a restraint that is stiffer aside than up turns an orbit
AREA = DIAMETER * LENGTH


def thrown(step: float, stiffness: float = SOFT, **more: Any) -> Model:
    """Return a tube thrown down in a hole whose middle is c sin alpha beside it."""
    analysis = {"type": "transient", "start": "undeformed", "motion": {"velocity": -SPEED}}
    hole = HOLE | {"lateral": CLEARANCE * sin(ALPHA)} | more.pop("hole", {})
    return ring(2, stiffness, step, support=[hole], analysis=analysis, restraint=FREE, **more)


def flown(model: Model, steps: int, every: int = 1) -> TrialResponse:
    """Return the motion of a tube from its start."""
    return respond(model, seated(model).state, steps, every * model.step)


def whole_momenta(model: Model, response: TrialResponse) -> Array:
    """Return the angular momentum about the middle of the hole, tilt included, over the mass, m^2/s."""
    solve = model.body.operators.factor(1.0, 0.0).solve
    motions = dict(zip(NAMES, model.body.rigid, strict=True))
    up, turn = motions["vertical"], motions["rotation"]
    mass, mixed, inertia = (float(solve(one) @ other) for one, other in ((up, up), (up, turn), (turn, turn)))
    tilt, rate = (
        (records[:, 2, 1:] - records[:, 1, 1:]) / LENGTH
        for records in (response.history["displacement"], response.history["velocity"])
    )
    turning = (inertia - mixed**2 / mass) / mass * (tilt[:, 0] * rate[:, 1] - tilt[:, 1] * rate[:, 0])
    return np.asarray(momenta(response, CLEARANCE * sin(ALPHA)) + turning)


@pytest.mark.parametrize("steps", [40_000, pytest.param(1_000_000, marks=pytest.mark.slow(minutes=0.5))])
@pytest.mark.parametrize("step", [4.0e-6, 1.0e-5])
def test_orbits_keep_energy_and_angular_momentum(step: float, steps: int) -> None:
    """Both to 1e-9, over 1e6 steps too, whether a bounce takes 40 steps or 15; the tube comes to tilt by itself."""
    model = thrown(step)
    response = flown(model, steps, 100)
    assert response.verdict == "passed"
    total, momentum = energies(response), whole_momenta(model, response)
    assert momentum[0] == pytest.approx(SPEED * CLEARANCE * sin(ALPHA), rel=1e-9)
    assert total == pytest.approx(np.full_like(total, total[0]), rel=1e-9)
    assert momentum == pytest.approx(np.full_like(momentum, momentum[0]), rel=1e-9)


@pytest.mark.parametrize("mu", [0.0, 0.3])
def test_both_marches_take_the_same_steps(mu: float) -> None:
    """Compiled and step by step, in a hole that is tilted, so that all stations differ; work of sliding, and friction.

    Friction takes the same energy to 1e-9, and the compiled march never hands a step over.
    """
    rubs: dict[str, Any] = {}
    if mu > 0.0:
        friction = {"coefficient": mu, "slip_velocity": 1.0e-5}
        rubs = {"contact": {"stiffness": SOFT, "friction": friction}, "model": {"type": "beam", "elements": 4}}
    model = thrown(1.0e-5, hole={"tilt": 1.0e-3}, wear={}, **rubs)
    plan, start = replace(Simulation(model).plan, steps=200 if mu else 500), seated(model).state
    passed = Accounts.opened(plan.system, plan.law, start, plan.dt)
    *_, last = CompiledLoop(plan).blocks(start, 50, passed)
    accounts = Accounts.opened(plan.system, plan.law, start, plan.dt)
    for step in march(plan, start):
        accounts.take(step)
        end = step.new
    largest = np.abs(end.u[VALUE]).max()
    assert last.end.u[VALUE] == pytest.approx(end.u[VALUE], abs=1e-10 * largest)
    assert last.end.depth == pytest.approx(end.depth, abs=1e-10 * CLEARANCE)
    contact = model.system.contact
    assert contact.surfaces.sum() == pytest.approx(pi * AREA, rel=1e-3)
    assert contact.weights.sum() == pytest.approx(AREA, rel=1e-3)
    work = last.records.sliding.rows[-1]
    assert work == pytest.approx(accounts.sliding.by_face, rel=1e-9)
    assert work[0] > 0.0
    assert passed.ledger.friction_loss == pytest.approx(accounts.ledger.friction_loss, rel=1e-9)
    assert (passed.ledger.friction_loss > 0.0) == (mu > 0.0)
    assert passed.tally.halved == 0


def turn_of_a_bounce(stiffness: float) -> float:
    """Return the angle from bounce to bounce in the potential K A (r - c)^2 / 2, rad (`test_orbits_in_a_ring.py`)."""
    momentum = SPEED * CLEARANCE * sin(ALPHA)

    def square(r: float) -> float:
        return SPEED**2 - stiffness * AREA * (r - CLEARANCE) ** 2 / MASS - (momentum / r) ** 2

    largest = brentq(square, CLEARANCE, 2.0 * CLEARANCE, xtol=1e-18)

    def rate(s: float) -> float:
        r = largest - s * s
        return 2.0 * s * momentum / r**2 / sqrt(max(square(r), 1e-300))

    inside, _ = quad(rate, 0.0, sqrt(largest - CLEARANCE), epsabs=0.0, epsrel=1e-10, limit=200)
    return pi - 2.0 * ALPHA + 2.0 * inside


@pytest.mark.parametrize("stiffness", [SOFT, 10.0 * SOFT, 1000.0 * SOFT])
def test_a_bounce_turns_by_its_quadrature(stiffness: float) -> None:
    """Six bounces to 2e-3 of the angle, up to a wall so hard that it is a mirror to 1e-2."""
    step = 2.0e-6 * sqrt(SOFT / stiffness)
    flight = 2.0 * CLEARANCE * cos(ALPHA) / SPEED
    response = flown(thrown(step, stiffness), round(9.0 * flight / step))
    force = response.history["contact_resultant"][:, 0]
    pressed = np.concatenate([[0], (np.hypot(*force.T) > 0.0).astype(int), [0]])
    begins, ends = np.flatnonzero(np.diff(pressed) == 1), np.flatnonzero(np.diff(pressed) == -1)
    impulses = np.array([force[begin:end].sum(axis=0) for begin, end in zip(begins, ends, strict=True)])[:6]
    turns = np.abs(np.diff(np.unwrap(np.arctan2(*impulses.T))))
    assert len(turns) == 5
    assert turns == pytest.approx(np.full(5, turn_of_a_bounce(stiffness)), rel=2e-3)
    if stiffness > 100.0 * SOFT:
        assert turns == pytest.approx(np.full(5, pi - 2.0 * ALPHA), rel=1e-2)


def particle(
    damping: float, force: float, omega: float, steps: int, mu: float = 0.0
) -> tuple[March, SemiDiscreteSystem]:
    """Return 1 kg on springs of 1 N/m in a hole of the clearance 0.5 m and 100 N/m, driven by a force that rotates.

    Its three DOFs are x, along the hole, y and z.
    """
    angles = np.arange(8) * pi / 4.0
    outward = np.column_stack([np.zeros(8), np.sin(angles), -np.cos(angles)])
    around = np.column_stack([np.zeros(8), np.cos(angles), np.sin(angles)])
    tangents = np.stack([np.tile([1.0, 0.0, 0.0], (8, 1)), -around], axis=1).reshape(16, 3)
    points = ContactOperator(
        interface=Interface(3, np.arange(3), np.arange(3)),
        gap_matrix=csr_matrix(-outward),
        weights=np.full(8, pi / 8.0),
        initial_gap=np.full(8, 0.5),
        faces=np.zeros(8, dtype=int),
        support=Support((BoreFace("hole", 0.0, 0.5, exact=True),), area=pi),
        positions=5.0 * outward,
        tangents=csr_matrix(tangents),
        frictionless=mu == 0.0,
        measures_sliding=True,
    )
    contact = circle_contact(points, [True])
    assert contact.weights == pytest.approx([1.0])
    operators = DenseOperators(np.eye(3), np.diag([1.0e-6, 1.0, 1.0]))
    loads = tuple(
        Load(name, np.eye(3)[axis], lambda time, lag=lag: force * cos(omega * time - lag))
        for name, axis, lag in (("aside", 1, 0.0), ("up", 2, pi / 2.0))
    )
    dashpots = RankOnes(np.eye(3)[1:], np.full(2, damping))
    system = SemiDiscreteSystem(operators, contact, loads, dashpots=dashpots)
    friction = CoulombFriction(mu, 1.0e-9) if mu else None
    law = ContactLaw(Spring(100.0), friction=friction)
    scheme, dt = scheme_of("discrete-gradient"), 2.0 * pi / omega / steps
    return March(system, law, scheme, EffectiveOperators(system, scheme), dt, steps), system


def rub(r: float, damping: float, omega: float, mu: float = 0.0) -> tuple[float, float]:
    """Return the forces along and across r that a full annular rub of the radius r takes, N."""
    pressed = 100.0 * (r - 0.5)
    return (1.0 - omega**2) * r + pressed, damping * omega * r + mu * pressed


def on_its_way(plan: March, r: float, damping: float, omega: float, force: float, mu: float = 0.0) -> State:
    """Return the state of a rub at t = 0, when the force points to +y."""
    along, across = rub(r, damping, omega, mu)
    phase = np.arctan2(-across, along)
    assert np.hypot(along, across) == pytest.approx(force, rel=1e-9)
    place, speed = np.array([0.0, cos(phase), sin(phase)]), np.array([0.0, -sin(phase), cos(phase)])
    operators, contact = plan.system.operators, plan.system.contact
    depth = contact.depth(r * place)
    state = State(0.0, imaged(operators, r * place), imaged(operators, omega * r * speed), depth, 100.0 * depth)
    return begun(plan, state)


def test_full_annular_rub_with_friction() -> None:
    """Radius, normal force and work rate of a rub with friction, marched: r = .514884522543, rate .1149571542."""
    radius, mu, omega = 0.514884522543, 0.1, 1.5
    steps = 160
    plan, _ = particle(0.5, 1.0, omega, steps, mu)
    start = on_its_way(plan, radius, 0.5, omega, 1.0, mu)
    accounts = Accounts.opened(plan.system, plan.law, start, plan.dt)
    radii, forces = [], []
    for step in march(plan, start):
        accounts.take(step)
        radii.append(float(np.hypot(*step.new.u[VALUE][1:])))
        forces.append(float(step.new.pressure[0]))
    assert radii == pytest.approx(np.full(steps, radius), rel=2e-4)
    assert forces == pytest.approx(np.full(steps, 1.4884522543), rel=1e-2)
    period = plan.dt * plan.steps
    assert mu * accounts.sliding.work.sum() / period == pytest.approx(0.1149571542, rel=2e-3)
    assert accounts.ledger.energies.friction_loss / period == pytest.approx(0.1149571542, rel=2e-3)


@pytest.mark.parametrize(("near", "stable"), [(0.511, True), (0.5015, False)])
def test_rubs_are_found_by_shooting(near: float, stable: bool) -> None:
    """Both rubs of F = 0.5 N above resonance to 1e-8, extrapolated from two steps; one is unstable, and is not kept."""
    damping, force, omega = 0.05, 0.5, 1.5

    def missed(r: float) -> float:
        return float(np.hypot(*rub(r, damping, omega)) - force)

    exact = brentq(missed, near - 6e-4, near + 6e-4, xtol=1e-15)
    found, multipliers = [], []
    for steps in (1000, 2000):
        plan, system = particle(damping, force, omega, steps)
        modal = modal_system(system)
        assert modal is not None
        period = ModalMap(modal, plan.law, plan.scheme, plan.dt, steps)
        x = period.coordinates(on_its_way(plan, exact, damping, omega, force))
        for _ in range(3):
            after, tangent = period.with_tangent(x)
            x = x + np.linalg.solve(np.eye(6) - tangent, after - x)
        assert period.after(x) == pytest.approx(x, abs=1e-12)
        found.append(float(np.hypot(*modal.dofs(x[:3])[1:])))
        multipliers.append(float(np.abs(np.linalg.eigvals(tangent)).max()))
    assert (4.0 * found[1] - found[0]) / 3.0 == pytest.approx(exact, rel=1e-8)
    assert (multipliers[1] < 1.0) == stable


def test_the_derivative_of_a_period_is_that_of_differences() -> None:
    """The monodromy matrix against central differences of the march, to 1e-6."""
    plan, system = particle(0.05, 0.5, 1.5, 400)
    modal = modal_system(system)
    assert modal is not None
    period = ModalMap(modal, plan.law, plan.scheme, plan.dt, 400)
    x = period.coordinates(
        on_its_way(plan, brentq(lambda r: float(np.hypot(*rub(r, 0.05, 1.5)) - 0.5), 0.5104, 0.5118), 0.05, 1.5, 0.5)
    )
    _, tangent = period.with_tangent(x)
    size = 1.0e-6
    columns = [(period.after(x + size * unit) - period.after(x - size * unit)) / (2.0 * size) for unit in np.eye(6)]
    assert tangent == pytest.approx(np.array(columns).T, abs=1e-6 * np.abs(tangent).max())


@pytest.mark.parametrize("angle", [0.0, 20.0, -100.0, 180.0])
def test_a_tube_rests_where_its_weight_points(angle: float) -> None:
    """The axis stands that way from the middle of its hole, as deep as K A says."""
    down = np.array([sin(np.radians(angle)), -cos(np.radians(angle))])
    gravity = {"type": "gravity", "direction": [0.0, *down.tolist()]}
    hole = HOLE | {"lateral": 5.0e-5, "offset": -3.0e-5}
    model = ring(2, SOFT, 1e-5, support=[hole], load=[gravity])
    response = respond(model, seated(model).state, 1, model.step)
    place = response.history["displacement"][0, 0, 1:] - np.array([5.0e-5, -3.0e-5])
    weight = 9.81 * MASS
    assert place == pytest.approx((CLEARANCE + weight / (SOFT * AREA)) * down, abs=1e-5 * CLEARANCE)
    assert response.history["contact_force"][0, 0] == pytest.approx(weight, rel=1e-3)
