"""Forces of a flow on scenes: transfer functions, linear stability and refusals, against formulas assembled here."""

from __future__ import annotations

from collections.abc import Callable
from math import cos, pi, sin, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

import gapbeam as gb
from gapbeam.solver.scene.flow_force import pade_error
from gapbeam.solver.scene.flow_margin import state_matrix
from gapbeam.solver.scene.linear_scheme import LinearScheme
from gapbeam.solver.scene.marcher import Marcher
from gapbeam.solver.scene.scene import SceneState


def transfer(flow: Any, s: complex) -> Any:
    """Return the force of a feedback per displacement e^(s t), (motions, motions)."""
    motions = flow.D.shape[1] // 2
    read = np.vstack([np.eye(motions), s * np.eye(motions)])
    return (flow.C @ np.linalg.solve(s * np.eye(len(flow.A)) - flow.A, flow.B) + flow.D) @ read


def one_step(scene: gb.Scene, h: float) -> Any:
    """Return the matrix of one step on (q, v, z), from unit states in one ensemble."""
    n, states = scene.size, sum(len(one.A) for one in scene.feedbacks)
    unit = np.eye(2 * n + states)
    still = np.zeros((scene.motions, len(unit)))
    start = SceneState(0.0, unit[:n], unit[n : 2 * n], unit[2 * n :], still)
    found = gb.ensemble(scene, step=h, end=h, start=start)
    return np.vstack([found.q, found.v, found.z])


def test_forces_have_the_transfer_functions_of_their_formulas(tmp_path: Path) -> None:
    """At s = i w: Price and Paidoussis with the exact delay, exponentials, Roger's form and measured coefficients."""
    w, U, rho, D = 7.0, 3.0, 1.2, 0.04
    flat, s = gb.mass(1.0, motions=2), 7.0j
    slope = np.array([[0.3, -0.2], [-1.5, 0.4]])
    delayed = gb.quasi_steady(
        flat["at"], velocity=U, density=rho, diameter=D, drag=0.8, lift=0.3, slope=slope, delay=2.0, frequency=w,
        tolerance=1e-9,
    )  # fmt: skip
    late = np.exp(-s * 2.0 * D / U)
    speeds = np.array([[-2 * 0.8, 0.3], [-2 * 0.3, -0.8]])
    assert np.allclose(transfer(delayed, s), rho * U**2 * D / 2 * (slope * late / D + speeds * s / U), rtol=1e-8)
    assert delayed.error < 1e-9
    assert delayed.delay == 2.0 * D / U
    skew = np.array([[1.0, 2.0], [-3.0, 0.5]])
    slow = gb.unsteady(
        flat["at"], velocity=U, density=rho, diameter=D, stiffness=skew, damping=np.eye(2), amplitudes=[0.3, 0.5],
        rates=[0.1, 2.0],
    )  # fmt: skip
    k = 1j * w * D / U
    memory = 1 - 0.3 * k / (k + 0.1) - 0.5 * k / (k + 2.0)
    assert np.allclose(transfer(slow, s), rho * U**2 / 2 * (skew * memory - np.eye(2) * D / U * s), rtol=1e-12)
    lagged = gb.aerodynamic_lag(
        flat["at"],
        velocity=U,
        density=rho,
        half_chord=0.5,
        steady=skew,
        damping=2 * skew,
        lags=[0.2],
        matrices=[skew.T],
    )
    k = 1j * w * 0.5 / U
    assert np.allclose(transfer(lagged, s), rho * U**2 / 2 * (skew + k * 2 * skew + skew.T * k / (k + 0.2)), rtol=1e-12)
    reduced = np.linspace(1.0, 40.0, 25)
    k = 2j * pi / reduced
    c = -2.0 - 0.7 * k + 1.3 * k / (k + 0.4) - 0.6 * k / (k + 2.5)
    np.savetxt(tmp_path / "c.csv", np.column_stack([reduced, c.real, c.imag]), delimiter=",", header="U/fD,re,im")
    one = gb.mass(1.0)
    fitted = gb.measured(one["at"], tmp_path / "c.csv", velocity=U, density=rho, diameter=D, frequencies=[100.0, w * 4])
    assert fitted.law.fit is not None
    assert fitted.law.fit.misfit < 1e-6
    exact = -2.0 - 0.7j * 100 * D / U + sum(a * 1j / (1j + d * U / (100 * D)) for a, d in ((1.3, 0.4), (-0.6, 2.5)))
    assert transfer(fitted, 100j)[0, 0] == pytest.approx(rho * U**2 / 2 * exact, rel=1e-6)


@pytest.mark.parametrize("angle", [0.2, 1.0, 2.0, 4.0, 5.0])
def test_critical_velocity_of_a_delayed_force_is_that_of_the_delay_equation(angle: float) -> None:
    """Equation m w^2 = k - A s cos(a), c w = -A s sin(a), a = w tau at the boundary; damping and delay follow."""
    m, k, U, rho, D, drag = 1.0, 100.0, 3.0, 1.0, 0.05, 1.0
    A, slope = 0.5 * rho * U * U, -8.0 if angle < pi else 8.0
    w = sqrt((k - A * slope * cos(angle)) / m)
    c = -A * slope * sin(angle) / w - 0.5 * rho * U * D * drag
    tube = gb.mass(m, stiffness=k, damping=c)
    flow = gb.quasi_steady(
        tube["at"], velocity=U, density=rho, diameter=D, drag=drag, slope=slope, delay=angle / w * U / D,
        frequency=1.2 * w, name="flow",
    )  # fmt: skip
    found = gb.critical_velocity(gb.Scene(tube, feedbacks=[flow]), "flow.velocity", 0.9 * U, 1.1 * U)
    assert found.value == pytest.approx(U, rel=1e-4)
    assert found.frequency == pytest.approx(w, rel=1e-4)


def test_pade_states_err_as_published() -> None:
    """Order 4 at omega tau = 3: 5.9e-4, order 6 at 5: 1.3e-4."""
    assert pade_error(4, 3.0) == pytest.approx(5.9e-4, rel=0.02)
    assert pade_error(6, 5.0) == pytest.approx(1.3e-4, rel=0.04)


def coupled(U: float) -> tuple[gb.Scene, Any]:
    """Return a mass of two motions in a flow with two memories, and its matrix assembled here."""
    rho, D, k, c = 1.1, 0.02, 300.0, 0.4
    K, C = np.array([[-40.0, 900.0], [-700.0, 60.0]]), np.array([[1.0, 0.2], [-0.1, 0.7]])
    a, d = np.array([0.3, 0.4]), np.array([0.02, 0.1])
    tube = gb.mass(1.0, motions=2, stiffness=k, damping=c)
    flow = gb.unsteady(
        tube["at"], velocity=U, density=rho, diameter=D, stiffness=K, damping=C, amplitudes=a, rates=d, name="flow"
    )
    q, E, N = 0.5 * rho * U * U, np.eye(2), np.zeros((2, 2))
    S = np.block(
        [
            [N, E, N, N],
            [q * K - k * E, -c * E - q * D / U * C, -q * a[0] * K, -q * a[1] * K],
            [N, E, -d[0] * U / D * E, N],
            [N, E, N, -d[1] * U / D * E],
        ]
    )
    return gb.Scene(tube, feedbacks=[flow]), S


@pytest.mark.parametrize("modes", [1, 2])
def test_boundary_is_that_of_own_matrices_and_of_the_step(modes: int) -> None:
    """One mode with y'' = ... and two that the flow couples: 1e-9 between the scene, own matrices and the march."""

    def whole(U: float) -> tuple[gb.Scene, Any]:
        if modes == 2:
            return coupled(U)
        tube = gb.mass(1.0, stiffness=100.0, damping=0.1)
        flow = gb.unsteady(
            tube["at"], velocity=U, density=1.0, diameter=0.1, stiffness=6.0, damping=0.2, amplitudes=[0.8],
            rates=[0.5], name="flow",
        )  # fmt: skip
        q = 0.5 * U * U
        rows = [[0.0, 1.0, 0.0], [6.0 * q - 100.0, -0.1 - q * 0.1 / U * 0.2, -4.8 * q], [0.0, 1.0, -0.5 * U / 0.1]]
        return gb.Scene(tube, feedbacks=[flow]), np.array(rows)

    low, high = (0.05, 2.0) if modes == 2 else (1.0, 8.0)
    found = gb.critical_velocity(whole(low)[0], "flow.velocity", low, high)

    def root(growth: Callable[[float], float]) -> float:
        return float(brentq(growth, 0.9 * found.value, 1.1 * found.value, xtol=1e-15, rtol=1e-14))

    own = root(lambda U: np.linalg.eigvals(whole(U)[1]).real.max())
    assert found.value == pytest.approx(own, rel=1e-9)
    h = 2 * pi / max(found.frequency, 1.0) / 50
    step = root(lambda U: np.abs(np.linalg.eigvals(one_step(whole(U)[0], h))).max() - 1.0)
    assert step == pytest.approx(own, rel=1e-9)
    values = gb.eigenvalues(whole(found.value)[0])
    mapped = (1 + 0.5 * h * values) / (1 - 0.5 * h * values)
    steps = np.linalg.eigvals(one_step(whole(found.value)[0], h))
    assert max(np.abs(steps - one).min() for one in mapped) < 1e-10


PLACES = {f"x{i}": i / 40 for i in range(41)}


def tube_in_flow(velocity: float, tolerance: float = 1e-9) -> gb.Scene:
    """Return two modes of a pinned tube in a flow over half of it, with a velocity profile over the other half."""
    shapes = {name: np.sin(np.outer([x], [1, 2]) * pi)[0] * sqrt(2) for name, x in PLACES.items()}
    tube = gb.from_modes([10.0, 14.0], 0.01, shapes)
    half = {name: x for name, x in PLACES.items() if x <= 0.5}
    rest = {name: x for name, x in PLACES.items() if x >= 0.5}
    flows = [
        gb.quasi_steady(
            span, velocity=velocity, density=1.0, diameter=0.1, drag=0.5, slope=-3.0, delay=1.0, frequency=16.0,
            tolerance=tolerance, name=name,
        )
        for span, name in (
            (gb.span(tube, half), "flow near"),
            (gb.span(tube, rest, velocity=lambda x: 1.0 + x, density=0.5), "flow far"),
        )
    ]  # fmt: skip
    return gb.Scene(tube, feedbacks=flows)


def test_growth_rates_of_eight_velocities_are_those_of_the_characteristic_matrix() -> None:
    """det(s^2 + 2 z w s + w^2 - int phi phi^T f(s, U(x)) dx) = 0 by Newton's method, exact delays and integrals."""
    velocities = np.linspace(2.0, 9.0, 8)
    found = gb.root_locus(tube_in_flow(2.0), "flow*.velocity", velocities)
    x, weights = np.polynomial.legendre.leggauss(60)

    def matrix(s: complex, U: float) -> Any:
        w = np.array([10.0, 14.0])
        T = np.diag(s * s + 0.02 * w * s + w * w).astype(complex)
        for a, b, share, density in ((0.0, 0.5, lambda x: x * 0 + 1, 1.0), (0.5, 1.0, lambda x: 1 + x, 0.5)):
            at = (a + b) / 2 + (b - a) / 2 * x
            phi, V = sqrt(2) * np.sin(np.outer([1, 2], at) * pi), U * share(at)
            f = density * V**2 * 0.1 / 2 * (-3.0 * np.exp(-s * 0.1 / V) / 0.1 - 0.5 * s / V)
            T -= (phi * (weights * (b - a) / 2 * f)) @ phi.T
        return T

    for U, row in zip(velocities, found, strict=True):
        for start in row:
            s = complex(start)
            for _ in range(20):
                value, e = np.linalg.det(matrix(s, U)), 1e-5
                s -= value / ((np.linalg.det(matrix(s + e, U)) - np.linalg.det(matrix(s - e, U))) / (2 * e))
            assert abs((s - start).real) < 1e-6
            assert abs(s - start) < 1e-6 * abs(s)


def test_a_step_with_many_kinds_of_feedback_is_the_midpoint_rule_of_the_linear_system() -> None:
    """Flows on few modes and on profiles, a controller between tubes, a joint: (1 - h S / 2)^-1 (1 + h S / 2)."""
    random = np.random.default_rng(3)
    shapes = {name: np.sin(np.outer([x], np.arange(1, 7)) * pi)[0] for name, x in PLACES.items()}
    numbers, kinds = np.arange(1, 7), ((7.0, "near"), (5.0, "far"))
    near, far = (gb.from_modes(first * numbers, 0.01, shapes, name=name) for first, name in kinds)
    air: dict[str, Any] = {"density": 1.0, "diameter": 0.1}
    loaded = {"slope": -3.0, "drag": 0.5, "frequency": 40.0}
    half = {name: x for name, x in PLACES.items() if x <= 0.5}
    places: Any = [near["x3"], (near["x9"], far["x20"])]
    drawn: Any = [random.standard_normal(size) for size in ((3, 3), (3, 4), (1, 3), (1, 4))]
    flows = [
        gb.quasi_steady(gb.span(far, PLACES), velocity=3.0, **air, **loaded, modes=2, name="few"),
        gb.quasi_steady(gb.span(far, half, velocity=lambda x: 1.0 + (x > 0.2)), velocity=2.0, **air, **loaded),
        gb.unsteady(
            gb.span(far, half), velocity=2.0, **air, stiffness=1.0, damping=0.5, amplitudes=[0.3], rates=[0.4], modes=2
        ),
        gb.Feedback(places, far["x7"], *drawn),
    ]  # fmt: skip
    law = gb.KelvinVoigt(stiffness=1e3)
    stop = gb.Contact(far["x13"], gb.Slot(1e3), law, name="stop")
    joint = gb.Joint((near["x9"], far["x20"]), 30.0, 0.1)
    scene, h = gb.Scene(near, far, contacts=[stop], feedbacks=flows, joints=[joint]), 0.02
    S = state_matrix(scene)
    unit = np.eye(len(S))
    assert len({len(one.A) for one in flows}) == 4
    assert np.allclose(one_step(scene, h), np.linalg.solve(unit - 0.5 * h * S, unit + 0.5 * h * S), atol=1e-10)
    alone = Marcher(scene, h, scene.state(velocity={far: 1.0}))
    x = np.concatenate([alone.q, alone.v, alone.z])
    alone.advance(1)
    assert np.allclose(np.concatenate([alone.q, alone.v, alone.z]), one_step(scene, h) @ x, atol=1e-12)
    assert abs(alone.balance - 0.5 * (x**2)[12:24].sum()) < 1e-9


def supported(velocity: float) -> tuple[gb.Scene, Any, Any]:
    """Return a tube on two pins with four supports that may idle, in a flow; the structure and the places."""
    places = {f"x{i}": 0.05 * i for i in range(21)}
    section, steel = gb.section("tube", 0.02, wall=0.002), gb.material(2.0e11, 7850.0)
    tube = gb.beam(1.0, section, steel, places, pinned=(0.0, 1.0), elements=20, modes=8, ratio=0.01)
    law = gb.KelvinVoigt(stiffness=1e7)
    supports = [gb.Contact(tube[name], gb.Slot(1e-4), law, name=name) for name in ("x3", "x7", "x13", "x17")]
    flow = gb.unsteady(
        gb.span(tube, places), velocity=velocity, density=1000.0, diameter=0.02, stiffness=1.0, damping=2.0,
        amplitudes=[3.0], rates=[0.3], name="flow",
    )  # fmt: skip
    return gb.Scene(tube, contacts=supports, feedbacks=[flow]), tube, places


def test_supports_that_may_idle_are_counted_as_by_own_matrices() -> None:
    """All sets of closed supports, with springs k b b^T and the flow's states assembled here by Simpson's rule."""
    scene, tube, places = supported(30.0)
    found = gb.idle_supports(scene, ["x3", "x7", "x13", "x17"])
    U, D, n = 30.0, 0.02, tube.size
    q = 0.5 * 1000.0 * U * U
    weights = 0.05 / 3 * np.array([1, *[4, 2] * 9, 4, 1])
    G = sum(w * tube[name].rows.T @ tube[name].rows for w, name in zip(weights, places, strict=True))
    tolerated = None
    for idle, rate in found.growth.items():
        K = tube.K - q * G
        for name in {"x3", "x7", "x13", "x17"} - idle:
            K = K + 1e7 * tube[name].rows.T @ tube[name].rows
        E, N = np.eye(n), np.zeros((n, n))
        S = np.block([[N, E, N], [-K, -tube.C - q * D / U * 2.0 * G, -3.0 * q * G], [N, E, -0.3 * U / D * E]])
        own = np.linalg.eigvals(S).real.max()
        assert rate == pytest.approx(own, rel=1e-3, abs=1e-3), idle
        if own > 0.0:
            tolerated = min(len(idle) - 1, tolerated if tolerated is not None else 9)
    assert found.tolerated == tolerated
    assert 0 <= found.tolerated < 4, found
    assert len(found.unstable[0]) == found.tolerated + 1


def test_connors_velocity_is_his_formula() -> None:
    """K f D sqrt(m delta / (rho D^2)); a flow over all of a tube that doubles has an effective velocity above 1."""
    found = gb.connors(
        K=3.0, frequency=2 * pi * 20.0, mass=0.5, decrement=0.06, diameter=0.02, density=900.0, velocity=0.5
    )
    assert found.critical == pytest.approx(3.0 * 20.0 * 0.02 * sqrt(0.5 * 0.06 / (900.0 * 0.02**2)))
    assert found.ratio == pytest.approx(0.5 / found.critical)
    tube = gb.from_modes([1.0], 0.0, {f"p{i}": [1.0] for i in range(9)})
    part = gb.span(tube, {f"p{i}": i / 8 for i in range(9)}, velocity=lambda x: 1 + x)
    whole = gb.connors(
        K=3.0, frequency=1.0, mass=0.5, decrement=0.06, diameter=0.02, density=9.0, velocity=2.0, span=part
    )
    assert whole.effective == pytest.approx(2.0 * sqrt(7 / 3))  # the mean of (1 + x)^2


def test_added_mass_lowers_frequencies_and_weighs_nothing() -> None:
    """A rigid mass over 1 m of fluid: w^2 = k / (m + m_a); the weight stays m g."""
    dry = gb.Structure(np.diag([2.0]), [[100.0]], points={"a": [1.0], "b": [1.0]}, frame=[1.0])
    wet = gb.in_fluid(dry, {"a": 0.0, "b": 1.0}, 0.5)
    assert wet.modes[0][0] == pytest.approx(100.0 / 2.5)
    assert gb.weight(wet, -9.81).pattern_on(wet) == pytest.approx(gb.weight(dry, -9.81).pattern_on(dry))


def test_an_ensemble_over_the_velocity_is_that_of_its_scenes() -> None:
    """Two motions in flows of three velocities, each as a march of its own."""
    scene, velocities = coupled(0.1)[0], [0.1, 0.2, 0.3]
    start = scene.state(velocity={scene.structures[0]: 1.0})
    many = gb.ensemble(scene, {"flow.velocity": velocities}, step=1e-3, end=1.0, start=start)
    for i, velocity in enumerate(velocities):
        one = gb.history(scene.with_({"flow.velocity": velocity}), 1e-3, 1.0, start)
        assert np.allclose(many.peak["at"][:, i], np.abs(one.displacement["at"]).max(0), rtol=1e-12)
    assert np.ptp(many.peak["at"][0]) > 1e-4


@pytest.mark.parametrize("size", [1e-5, 1.0, 50.0])
def test_members_have_delays_of_the_order_of_their_velocity(tmp_path: Path, size: float) -> None:
    """Thirty-fold velocities beside drawn gaps: each member is the march of its own scene, also read from a folder."""
    tube = gb.mass(size**3, stiffness=size, damping=0.02 * size**2, name="tube")
    w, rng = 1.0 / size, np.random.default_rng(4)
    flow = gb.quasi_steady(
        tube["at"], velocity=w * size, density=0.1 * size, diameter=0.3 * size, drag=1.0, slope=-3.0,
        frequency=5.0 * w, name="flow",
    )  # fmt: skip
    stop = gb.Contact(tube["at"], gb.Slot(size), gb.KelvinVoigt(stiffness=50.0 * size), name="stop")
    push = gb.Force(tube["at"], lambda t: size**2 * np.sin(0.8 * w * t), name="push")
    scene = gb.Scene(tube, contacts=[stop], loads=[push], feedbacks=[flow])
    members = {
        "flow.velocity": w * size * np.repeat([0.5, 2.0, 15.0], 12),
        "stop.clearance": size * rng.uniform(0.2, 3.0, 36),
    }
    step, end = 0.02 / w, 20.0 / w
    many = [gb.ensemble(scene, members, step=step, end=end, output=tmp_path / "kept") for _ in range(2)]
    orders = set()
    for i in range(36):
        one = gb.history(scene.with_({path: value[i] for path, value in members.items()}), step, end)
        z = one.last.state.z[:, 0]
        orders.add(len(z))
        for found in many:
            assert found.peak["at"][i] == pytest.approx(np.abs(one.displacement["at"]).max(), rel=1e-6)
            assert found.z[: len(z), i] == pytest.approx(z, rel=1e-4, abs=1e-6 * size)
            assert not found.z[len(z) :, i].any()
    assert len(orders) == 3


def test_marches_with_gaps_turn_unstable_at_as_many_idle_supports_as_eigenvalues() -> None:
    """Small motions within the gaps of each set of idle supports, all others closed: the march grows or decays."""
    scene, tube, _ = supported(30.0)
    names = ["x3", "x7", "x13", "x17"]
    found, unstable = gb.idle_supports(scene, names), list[int]()
    random = np.random.default_rng(5).standard_normal(tube.size)
    for idle, rate in found.growth.items():
        joints = [gb.Joint(tube[name], 1e7) for name in names if name not in idle]
        loose = [one for one in scene.contacts if one.name in idle]
        one = gb.Scene(tube, contacts=loose, feedbacks=scene.feedbacks, joints=joints)
        start, sizes = one.state(velocity={tube: 1e-9 * random}), list[float]()
        for step in gb.march(one, 1e-4, 0.2, start, every=1000):
            sizes.append(step.energy["kinetic"] + step.energy["strain"])
            assert not any(force.force for force in step.contacts.values())
        assert (sizes[1] > sizes[0]) == (rate > 0.0), idle
        unstable += [len(idle)] if sizes[1] > sizes[0] else []
    assert min(unstable) == found.tolerated + 1 == 3


EXPLICIT = LinearScheme(0.0, 0.0, (1.0, -1.0, 0.0), (0.5, 0.5, 0.0), (1.0, 0.0, 0.0))
"""Central differences with velocities between the steps."""


def test_schemes_are_refused_beyond_their_limit() -> None:
    """2 / w, with springs of a feedback: below, a mass swings with sin(W h / 2) = w h / 2; above, it is refused."""
    tube = gb.mass(1.0, stiffness=60.0)
    scene = gb.Scene(tube, joints=[gb.Joint(tube["at"], 40.0)])
    start, h = scene.state(displacement={tube: 1.0}), 0.15
    found = gb.history(scene, h, 150 * h, start, EXPLICIT).displacement["at"]
    turns = 2.0 * np.arcsin(0.5 * 10.0 * h) * np.arange(1, 151)
    shape = np.column_stack([np.cos(turns), np.sin(turns)])
    assert np.abs(shape @ np.linalg.lstsq(shape, found, rcond=None)[0] - found).max() < 1e-9
    words = r"stable up to about 0\.2 s for the fastest mode of 10 rad/s, found step 0\.21"
    with pytest.raises(gb.UserError, match=words):
        gb.history(scene, 0.21, 2.1, start, EXPLICIT)
    linear = gb.newmark(beta=1 / 6)  # linear acceleration: 2 sqrt(3) / w
    assert np.abs(gb.history(scene, 0.34, 34.0, start, linear).displacement["at"]).max() < 10.0
    with pytest.raises(gb.UserError, match=r"stable up to about 0\.34[67] s"):
        gb.history(scene, 0.36, 3.6, start, linear)


def refused() -> dict[str, tuple[Callable[[], Any], str]]:
    one, flat = gb.mass(1.0, stiffness=1.0, name="one"), gb.mass(1.0, motions=2, stiffness=1.0)
    table = [[2.0, -1.0, 0.1], [9.0, -0.7, 0.2], [20.0, -0.5, 0.2]]
    air: dict[str, Any] = {"velocity": 1.0, "density": 1.0, "diameter": 0.1}
    steady: dict[str, Any] = air | {"drag": 1.0, "slope": -1.0}
    flow = gb.quasi_steady(one["at"], **steady, frequency=10.0, name="flow")
    scene = gb.Scene(
        one,
        contacts=[gb.Contact(one["at"], gb.Slot(0.1), gb.Cubic(stiffness=1.0, scale=1.0), name="stop")],
        feedbacks=[flow],
    )
    blown = gb.history(scene, 0.1, 2.0, scene.state(displacement={one: 1.0})).last.state
    fit = gb.measured(one["at"], table, **air, frequencies=[5.0], states=1, name="fit")
    fast = gb.Scene(one, feedbacks=[fit]).with_({"fit.velocity": 2.0})
    unseen = {"A": [[1.0, 0.0], [0.0, -1.0]], "B": np.ones((2, 2)), "C": [[0.0, 1.0]]}
    return {
        "outside": (
            lambda: gb.measured(one["at"], table, **air, frequencies=[1.0], states=1),
            r"reduced velocity U/\(f D\) = 62.83 at 1 m/s and 0.1592 Hz is outside of the table, 2 to 20",
        ),
        "faster": (lambda: gb.history(fast, 1e-3, 0.05), r"= 25.13 at 2 m/s and 0.7958 Hz is outside of the table"),
        "members that are faster": (
            lambda: gb.ensemble(gb.Scene(one, feedbacks=[fit]), {"fit.velocity": [0.5, 2.0]}, step=0.01, end=1.0),
            r"flow fit: [^$]*= 25.13 at 2 m/s and 0.7958 Hz is outside of the table",
        ),
        "columns": (lambda: gb.measured(one["at"], [[1.0, 2.0]], **air, frequencies=[1.0]), "3 or 9 columns"),
        "no table": (lambda: gb.measured(one["at"], "none.csv", **air, frequencies=[1.0]), "none.csv"),
        "delay": (lambda: gb.quasi_steady(one["at"], **steady, frequency=1e4), "give a lower `frequency`"),
        "unseen": (lambda: gb.Feedback(one["at"], one["at"], **unseen), r"a state grows as exp\(1 t\) and no output"),
        "velocity": (lambda: gb.quasi_steady(one["at"], **(steady | {"velocity": -1.0}), frequency=1.0), "above 0"),
        "motions": (lambda: gb.quasi_steady(flat["at"], **steady, frequency=1.0), "points of 2 motions and a law of 1"),
        "members": (
            lambda: gb.ensemble(scene, {"flow.velocity": [1.0, 0.2]}, step=0.1, end=3.0, start=blown),
            "begin where the states are 0",
        ),
        "lanes": (lambda: scene.with_({"flow.velocity": np.ones(2)}), "a flow has one velocity"),
        "path": (lambda: scene.with_({"flow.speed": 1.0}), "it has velocity, density"),
        "closed": (lambda: gb.eigenvalues(scene, ["gate"]), "no contact is called 'gate'"),
        "law": (lambda: gb.eigenvalues(scene, ["stop"]), "give it: closed={'stop': 1e6}"),
        "bounds": (lambda: gb.critical_velocity(scene, "flow.velocity", 0.5, 0.51), "expected decay at one bound"),
        "no beta": (lambda: gb.newmark(beta=0.0), "beta 0.0 and gamma 0.5, expected above 0"),
        "growth": (lambda: gb.newmark(gamma=0.4), "expected above 0 and from 1/2 on"),
        "span": (lambda: gb.span(one, {"at": 0.0}), "two or more that differ"),
        "long": (
            lambda: gb.history(scene, 1e-3, 0.05),
            "flow flow: its delay of 0.1 s is longer than the march of 0.05 s",
        ),
        "long members": (lambda: gb.ensemble(scene, step=1e-3, end=0.05, members=3), r"of 0.1 s is longer than the ma"),
        "long run": (lambda: gb.run(scene, step=1e-3, end=0.05, output="none"), r"of 0.1 s is longer than the march"),
    }


@pytest.mark.parametrize("name", refused())
def test_nonsense_is_refused(name: str) -> None:
    call, words = refused()[name]
    with pytest.raises(gb.UserError, match=words):
        call()
