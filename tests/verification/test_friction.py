"""Coulomb friction on a sliding mass: closed forms, the same for every scheme.

A mass presses a plane with N and slides along it, t = -mu p v / sqrt(|v|^2 + v0^2). With a = mu N / m and
r = sqrt(v^2 + v0^2) the deceleration a v / r integrates to

    a t = F(v(0)) - F(v(t)),  F = r - v0 asinh(v0 / v),      a x = [v r + v0^2 asinh(v / v0)] / 2,

elementary integrals of the law of Kikuchi and Oden (1988), Contact Problems in Elasticity, ch. 10; v0 to 0 gives what
textbooks have for Coulomb's law, v(0)^2 / (2 mu g), and 4 mu N / k of amplitude lost in a cycle (Den Hartog 1931).
"""

from __future__ import annotations

from math import asinh, hypot, pi, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csr_matrix

from gapbeam.solver.contact.laws.contact_law import ContactLaw, StagePressure
from gapbeam.solver.contact.laws.damper import CoulombFriction
from gapbeam.solver.contact.laws.springs import Spring
from gapbeam.solver.contact.solve.condensation import CondensedOperator, ForceResponse
from gapbeam.solver.contact.solve.friction_solve import Sliding, solve_contact_and_friction
from gapbeam.solver.integrators.scheme_choice import scheme_of
from gapbeam.solver.integrators.time_scheme import TimeScheme
from gapbeam.solver.supports.support import Face, Support
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Array, Interface, Load
from gapbeam.solver.system.semi_discrete import ContactOperator, SemiDiscreteSystem, State, Step, imaged
from tests.shared.toys import IMPLICIT, SCHEMES, ledger_of, steps_of

MASS, PRESSED, MU = 2.0, 30.0, 0.3  # kg, N, no unit
DECELERATION = MU * PRESSED / MASS
STIFF = 1.0e8  # Pa/m, of the plane
FRICTION_SCHEMES: dict[str, TimeScheme] = {
    **{name: SCHEMES[name] for name in IMPLICIT},
    "hht-alpha": scheme_of("hht-alpha", alpha=0.1),
    "moreau-jean": scheme_of("moreau-jean", theta=0.5),
}
MIDPOINT_SCHEMES = ("discrete-gradient", "implicit-midpoint", "moreau-jean")  # u1 - u0 = dt v of the balance
EVERY_SCHEME = pytest.mark.parametrize("name", FRICTION_SCHEMES)


def slider(spring: float = 0.0, pull: float = 0.0, components: int = 1) -> SemiDiscreteSystem:
    """A mass on a plane, on a spring and pulled along x; its last DOF is the height."""
    size = components + 1
    height, along, down = np.zeros(size), np.eye(size)[:components], np.zeros(size)
    height[-1], down[-1] = 1.0, -1.0
    contact = ContactOperator(
        interface=Interface(size, np.arange(size), np.arange(size)),
        gap_matrix=csr_matrix(height[None]),
        weights=np.array([0.5]),
        initial_gap=np.array([0.0]),
        faces=np.array([0]),
        support=Support((Face("plane", -1.0),), area=1.0),
        positions=np.zeros((1, 3)),
        tangents=csr_matrix(along),
    )
    stiffness = spring * np.diag([1.0] * components + [0.0])
    loads = (Load("weight", down, lambda _time: PRESSED), Load("pull", along[0], lambda _time: pull))
    return SemiDiscreteSystem(DenseOperators(MASS * np.eye(size), stiffness), contact, loads)


def sliding_law(slip_velocity: float, name: str = "", coefficient: float = MU) -> ContactLaw:
    """The plane with friction."""
    return ContactLaw(
        Spring(STIFF),
        friction=CoulombFriction(coefficient, slip_velocity),
        stores_energy=name != "moreau-jean",
    )


def pressed_start(system: SemiDiscreteSystem, name: str, velocity: list[float], x: float = 0.0) -> State:
    """The mass in balance with the plane across it, at x with a velocity along it."""
    u, v = np.zeros(system.operators.size), np.array([*velocity, 0.0])
    u[0] = x
    u[-1] = 0.0 if name == "moreau-jean" else -PRESSED / (STIFF * system.contact.weights[0])
    place, speed = imaged(system.operators, u), imaged(system.operators, v)
    return State(0.0, place, speed, system.contact.depth(u), PRESSED / system.contact.weights)


def slid(name: str, slip_velocity: float, speed: float, dt: float, count: int) -> tuple[SemiDiscreteSystem, list[Step]]:
    """Steps of the mass from a speed along x, on its own."""
    system = slider()
    start = pressed_start(system, name, [speed])
    return system, steps_of(system, sliding_law(slip_velocity, name), FRICTION_SCHEMES[name], start, dt, count)


def braking_time(speed: float, slip_velocity: float) -> float:
    """F(v) / a."""
    return (hypot(speed, slip_velocity) - slip_velocity * asinh(slip_velocity / speed)) / DECELERATION


def braking_distance(speed: float, slip_velocity: float) -> float:
    """Distance to rest, [v r + v0^2 asinh(v / v0)] / (2 a)."""
    bent = slip_velocity**2 * asinh(speed / slip_velocity)
    return (speed * hypot(speed, slip_velocity) + bent) / (2.0 * DECELERATION)


@EVERY_SCHEME
def test_mass_stops_where_coulomb_says(name: str) -> None:
    """From 1 m/s with v0 = 1e-6 m/s: mu g of deceleration, rest after v^2 / (2 mu g), and no creep back."""
    dt = 1.0e-3
    _, steps = slid(name, 1.0e-6, 1.0, dt, 300)
    early = steps[20].new
    assert early.v[0, 0] == pytest.approx(1.0 - DECELERATION * early.time, rel=1e-9)
    assert steps[-1].new.u[0, 0] == pytest.approx(1.0 / (2.0 * DECELERATION), rel=2e-5)
    last = [step.new.u[0, 0] for step in steps[-50:]]
    assert np.ptp(last) < 1e-7


@EVERY_SCHEME
def test_braking_distance_of_the_regularized_law(name: str) -> None:
    """A large v0 = 0.2 m/s: the distance to rest follows the closed form to 1e-4, 4 % from Coulomb's."""
    _, steps = slid(name, 0.2, 1.0, 2.0e-3, 500)
    expected = braking_distance(1.0, 0.2)
    assert steps[-1].new.u[0, 0] == pytest.approx(expected, rel=1e-4)
    assert expected > 1.04 / (2.0 * DECELERATION)


@EVERY_SCHEME
def test_order_in_time(name: str) -> None:
    """The time at which a speed is reached, against the closed form: order 2 (order 2 of each scheme, no impacts)."""
    errors = []
    for count in (20, 40, 80):
        end = 0.15
        _, steps = slid(name, 0.3, 1.0, end / count, count)
        reached = braking_time(1.0, 0.3) - braking_time(float(steps[-1].new.v[0, 0]), 0.3)
        errors.append(abs(reached - end))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx([2.0, 2.0], abs=0.15)


@EVERY_SCHEME
def test_oscillator_loses_the_same_amplitude_in_every_cycle(name: str) -> None:
    """4 mu N / k in each cycle, at the angular frequency sqrt(k / m) (Den Hartog 1931)."""
    spring = 2000.0
    lost = 4.0 * MU * PRESSED / spring
    count = 300
    period = 2.0 * pi * sqrt(MASS / spring)
    system = slider(spring)
    start = pressed_start(system, name, [0.0], x=4.5 * lost)
    law, dt = sliding_law(1.0e-5, name), period / count
    steps = steps_of(system, law, FRICTION_SCHEMES[name], start, dt, 2 * count)
    ends = [steps[cycle * count - 1].new.u[0, 0] for cycle in (1, 2)]
    assert ends == pytest.approx([3.5 * lost, 2.5 * lost], abs=2e-3 * lost)


@EVERY_SCHEME
def test_energy_balance_closes_with_friction(name: str) -> None:
    """The loss in friction closes the balance to round-off, on a spring with reversals of slip."""
    system = slider(2000.0)
    law, start = sliding_law(1.0e-3, name), pressed_start(system, name, [1.0])
    steps = steps_of(system, law, FRICTION_SCHEMES[name], start, 1.0e-3, 400)
    ledger = ledger_of(system, law, start, steps)
    energy = 0.5 * MASS
    assert abs(ledger.residual) < 5e-12 * energy
    assert ledger.friction_loss > 0.9 * energy
    midpoint = name in MIDPOINT_SCHEMES
    assert ledger.contact_gain < (1e-20 if midpoint else 1e-4) * energy


@pytest.mark.parametrize("name", MIDPOINT_SCHEMES)
def test_dissipation_is_the_kinetic_energy_lost(name: str) -> None:
    """Midpoint schemes: friction takes exactly what the mass loses, and takes some in every step."""
    system, steps = slid(name, 1.0e-2, 1.0, 5.0e-3, 60)
    law, start = sliding_law(1.0e-2, name), pressed_start(slider(), name, [1.0])
    ledger = ledger_of(system, law, start, steps)
    lost = 0.5 * MASS * (1.0 - float(steps[-1].new.v[0, 0]) ** 2)
    assert ledger.friction_loss == pytest.approx(lost, rel=1e-11)
    for step in steps[:40]:
        assert step.stage.traction is not None
        assert float(step.stage.traction[0, 0] * (step.new.u[0, 0] - step.old.u[0, 0])) < 0.0


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9, 0.99])
@pytest.mark.parametrize("name", ["generalized-alpha 0", "discrete-gradient", "moreau-jean"])
def test_creep_below_the_limit(share: float, name: str) -> None:
    """Pulled by q mu N, q < 1, the mass creeps at v0 q / sqrt(1 - q^2)."""
    slip_velocity = 0.01
    system = slider(pull=share * MU * PRESSED)
    start = pressed_start(system, name, [0.0])
    steps_to_settle = 500 if share > 0.9 else 150  # it settles at a rate of (1 - q^2)^(3/2) mu N / (m v0)
    law = sliding_law(slip_velocity, name)
    steps = steps_of(system, law, FRICTION_SCHEMES[name], start, 0.05, steps_to_settle)
    assert steps[-1].new.v[0, 0] == pytest.approx(slip_velocity * share / sqrt(1.0 - share**2), rel=1e-8)


@EVERY_SCHEME
def test_friction_opposes_a_skew_velocity(name: str) -> None:
    """In 3D the mass slides straight on, and as far as in 2D: the law has no preferred direction."""
    system = slider(components=2)
    start = pressed_start(system, name, [0.6, 0.8])
    law = sliding_law(1.0e-3, name)
    steps = steps_of(system, law, FRICTION_SCHEMES[name], start, 2.0e-3, 130)  # rest after 111
    _, straight = slid(name, 1.0e-3, 1.0, 2.0e-3, 130)
    for step, same in zip(steps, straight, strict=True):
        assert step.new.u[0, :2] == pytest.approx(step.new.u[0, 0] / 0.6 * np.array([0.6, 0.8]), abs=1e-10)
        assert np.linalg.norm(step.new.u[0, :2]) == pytest.approx(abs(same.new.u[0, 0]), abs=1e-9)


def test_a_mass_in_the_air_feels_no_friction() -> None:
    """Lifted off the plane, the mass keeps its speed; landed again, it brakes."""
    system = slider()
    law = sliding_law(1.0e-3)
    start = pressed_start(system, "moreau-jean", [1.0])
    start.v[:, -1] += 0.3 * np.array([1.0, MASS, 0.0])
    steps = steps_of(system, law, FRICTION_SCHEMES["moreau-jean"], start, 1.0e-3, 80)
    flying = [step for step in steps if step.stage.pressure[0] == 0.0]
    assert 35 < len(flying) < 45  # 2 v / (N / m) = 40 ms
    for step in flying:
        assert step.new.v[0, 0] == pytest.approx(step.old.v[0, 0], rel=1e-13)
    assert steps[-1].new.v[0, 0] < flying[0].new.v[0, 0] - 0.05


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    components=st.sampled_from([1, 2]),
    coefficient=st.sampled_from([1e-6, 0.3, 10.0]),
    slip_velocity=st.floats(-9.0, 1.0).map(lambda power: 10.0**power),
)
def test_friction_of_coupled_points_satisfies_law_and_balance(
    seed: int, components: int, coefficient: float, slip_velocity: float
) -> None:
    """Random coupled points, of which some carry nothing: h = -b v / sqrt(|v|^2 + v0^2) at v = v_free + S h."""
    random, points = np.random.default_rng(seed), 12
    law = CoulombFriction(coefficient, slip_velocity)
    root = random.standard_normal((components * points, components * points))
    compliance, free = 0.1 * root @ root.T, random.standard_normal((points, components))
    normal = np.where(random.random(points) < 0.3, 0.0, 10.0 ** random.uniform(-6.0, 1.0, points))
    nothing = np.zeros(points)
    found = solve_contact_and_friction(
        Sliding(law, 0.5, free, np.zeros_like(free)), CoupledAlongFaces(points, compliance), 1.0, nothing,
        np.ones(points), lambda _depth: StagePressure(normal, nothing, normal), nothing,
    ).friction  # fmt: skip
    assert found is not None
    slip = free + 0.5 * (compliance @ found.reshape(-1)).reshape(free.shape)
    expected = -coefficient * normal[:, None] * slip / np.sqrt(np.sum(slip**2, axis=1) + slip_velocity**2)[:, None]
    most = coefficient * normal.max()
    # round-off in v, a few eps, over v0 is what the law makes of it
    assert np.abs(found - expected).max() <= most * max(1e-11, 1e-13 / slip_velocity)
    assert np.all(found[normal == 0.0] == 0.0)
    assert np.all(np.linalg.norm(found, axis=1) <= coefficient * normal * (1.0 + 1e-9))


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    coefficient=st.sampled_from([1e-6, 0.3, 10.0]),
    left=st.floats(-14.0, -6.0).map(lambda power: 10.0**power),
)
def test_points_that_let_go_keep_what_round_off_leaves(seed: int, coefficient: float, left: float) -> None:
    """Forces that are a small part of those held, of which they are the difference: the laws hold to its round-off."""
    random, points, creep = np.random.default_rng(seed), 6, 1.0
    root = random.standard_normal((points, points))
    compliance, free = 0.1 * root @ root.T, random.standard_normal((points, 1))
    held = 10.0 ** random.uniform(-1.0, 3.0, points)
    normal, nothing = left * held.max() * random.random(points), np.zeros(points)
    found = solve_contact_and_friction(
        Sliding(CoulombFriction(coefficient, creep), 0.5, free, np.zeros_like(free)),
        CoupledAlongFaces(points, compliance), 1.0, nothing, np.ones(points),
        lambda _depth: StagePressure(normal, np.ones(points), normal), held,
    )  # fmt: skip
    assert found.friction is not None
    near = 2.0e-15 * held.max()
    assert held + found.change == pytest.approx(normal, abs=near)
    slip = free[:, 0] + 0.5 * compliance @ found.friction[:, 0]
    wanted = -coefficient * normal * slip / np.hypot(slip, creep)
    assert found.friction[:, 0] == pytest.approx(wanted, abs=coefficient * (near + 1.0e-10 * normal.max()))


class CoupledAlongFaces(CondensedOperator):
    """Points that move along faces under each other's friction, and whose gaps nothing moves."""

    symmetric, block = True, None

    def __init__(self, points: int, along: Array) -> None:
        self.largest_compliance = 0.0
        self.compliance = np.zeros((points + len(along), points + len(along)))
        self.compliance[points:, points:] = along

    def respond_all(self, forces: Array, friction: Array) -> tuple[Array, Array]:
        """Return no gaps, and what friction moves."""
        moved = self.compliance @ np.concatenate([forces, friction.reshape(-1)])
        return moved[: len(forces)], moved[len(forces) :].reshape(friction.shape)

    def respond(self, forces: Array) -> ForceResponse:
        """Return no gaps."""
        return ForceResponse(np.zeros_like(forces))
