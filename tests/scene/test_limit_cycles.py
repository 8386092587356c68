"""Limit cycles of tubes and wings with play, by march and by shooting, against adaptive integration done here."""

from __future__ import annotations

import json
from collections.abc import Callable
from math import pi
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import gapbeam as gb
from gapbeam.solver.scene.flow_margin import state_matrix
from gapbeam.solver.scene.scene import SceneState
from gapbeam.studies.atlas import cycle_search
from gapbeam.studies.atlas.cycle_search import cycle_atlas
from tests.shared.command import called

Motion = Callable[[float], Any]


class Cycle(NamedTuple):
    """Figures of a cycle: amplitude, m; angular frequency, rad/s; peak and mean of |force|, N."""

    amplitude: float
    frequency: float
    peak: float
    mean: float


def delayed(rate: Callable[[Any, Any], Any], lag: float, start: Any, spans: int) -> Callable[[Any], Any]:
    """Integrate x' = rate(x, x(t - lag)) from a constant past, lag by lag with an adaptive method; return x(t)."""
    pieces: list[Any] = []
    for k in range(spans):
        past: Motion = pieces[-1] if pieces else lambda t: start  # noqa: ARG005
        x = pieces[-1](k * lag) if pieces else np.asarray(start)
        found = solve_ivp(
            lambda t, x, past=past: rate(x, past(t - lag)), (k * lag, (k + 1) * lag), x, "DOP853", dense_output=True,
            rtol=1e-9, atol=1e-13, max_step=lag / 40,
        )  # fmt: skip
        pieces.append(found.sol)
    return lambda times: np.array([pieces[min(int(t / lag), spans - 1)](t) for t in times]).T


def figures(times: Any, y: Any, force: Any) -> Cycle:
    """Return the figures of the last whole cycles of a motion."""
    up = np.flatnonzero((y[:-1] <= 0.0) & (y[1:] > 0.0))
    crossings = times[up] - y[up] * (times[up + 1] - times[up]) / (y[up + 1] - y[up])
    one = (times >= crossings[-3]) & (times < crossings[-1])
    size = np.abs(force[one])
    return Cycle(np.abs(y[one]).max(), 4 * pi / (crossings[-1] - crossings[-3]), size.max(), size.mean())


def pressed(y: Any, v: Any, gap: float, stiffness: float, damping: float) -> Any:
    """Return the force of two stops at +-gap: springs and dampers that do not pull."""
    depth = np.abs(y) - gap
    return -np.sign(y) * np.where(depth > 0.0, np.maximum(stiffness * depth + damping * v * np.sign(y), 0.0), 0.0)


GAP, K, C = 5e-4, 800.0, 0.4


def price() -> tuple[gb.Scene, Cycle]:
    """Return a tube with a delayed force between stops, and its cycle by the delay equation."""
    m, k, c, U, D, slope, mu = 1.0, 100.0, 0.8, 3.0, 0.05, -8.0, 8.0
    tube = gb.mass(m, stiffness=k, damping=c)
    flow = gb.quasi_steady(
        tube["at"], velocity=U, density=1.0, diameter=D, drag=1.0, slope=slope, delay=mu, frequency=40.0, name="flow"
    )
    stop = gb.Contact(tube["at"], gb.Slot(2 * GAP), gb.KelvinVoigt(stiffness=K, damping=C), name="stop")
    q = 0.5 * U * U

    def rate(x: Any, past: Any) -> Any:
        force = -k * x[0] - c * x[1] + q * slope * past[0] - q * D / U * x[1] + pressed(x[0], x[1], GAP, K, C)
        return np.array([x[1], force / m])

    lag = mu * D / U
    motion = delayed(rate, lag, [6e-4, 0.0], 60)
    times = np.linspace(52 * lag, 60 * lag, 16001)
    y, v = motion(times)
    return gb.Scene(tube, contacts=[stop], feedbacks=[flow]), figures(times, y, pressed(y, v, GAP, K, C))


MEMORY = 100.0, 0.3, 2.0, 0.1, 0.9, 0.2, 1200.0


def remembering() -> gb.Scene:
    """Return a tube with a memory between stiffer stops without damper."""
    k, c, U, D, a, d, stiff = MEMORY
    tube = gb.mass(1.0, stiffness=k, damping=c)
    flow = gb.unsteady(
        tube["at"], velocity=U, density=1.0, diameter=D, stiffness=-15.0, damping=0.2, amplitudes=[a], rates=[d],
        name="flow",
    )  # fmt: skip
    stop = gb.Contact(tube["at"], gb.Slot(2 * GAP), gb.KelvinVoigt(stiffness=stiff), name="stop")
    return gb.Scene(tube, contacts=[stop], feedbacks=[flow])


def granger() -> tuple[gb.Scene, Cycle]:
    """Return that tube, and its cycle by adaptive integration."""
    k, c, U, D, a, d, stiff = MEMORY
    q = 0.5 * U * U

    def rate(t: float, x: Any) -> Any:  # noqa: ARG001
        y, v, z = x
        force = -k * y - c * v - 15.0 * q * (y - a * z) - q * 0.2 * D / U * v + pressed(y, v, GAP, stiff, 0.0)
        return [v, force, v - d * U / D * z]

    times = np.linspace(28.0, 30.0, 20001)
    y, v, _ = solve_ivp(rate, (0, 30.0), [6e-4, 0.0, 0.0], "LSODA", times, rtol=1e-9, atol=1e-13, max_step=0.01).y
    return remembering(), figures(times, y, pressed(y, v, GAP, stiff, 0.0))


@pytest.mark.slow(minutes=0.3)
@pytest.mark.parametrize("made", [price, granger])
def test_cycles_between_stops_are_those_of_adaptive_integration(made: Callable[[], tuple[gb.Scene, Cycle]]) -> None:
    """Amplitude, frequency, peak and mean force to 1e-3 at 200 steps a period, by shooting and by march."""
    scene, own = made()
    found = gb.limit_cycle(scene, steps=200)
    once = gb.history(scene, found.period / 200, found.state.t + found.period, found.state)
    size = np.abs(once.force["stop"])
    shot = Cycle(np.abs(once.displacement["at"]).max(), found.frequency, size.max(), size.mean())
    step = found.period / 200
    long = gb.history(scene, step, 16000 * step, scene.state(displacement={scene.structures[0]: 6e-4}))
    marched = figures(long.t, long.displacement["at"], long.force["stop"])
    for one in (shot, marched):
        assert one == pytest.approx(own, rel=1e-3)
    assert found.is_stable
    assert found.is_decided


def test_work_of_the_flow_is_in_the_ledger() -> None:
    """Over a cycle the flow brings in what damping takes; the scheme creates nothing."""
    scene = remembering()
    found = gb.limit_cycle(scene, steps=100)
    for step in gb.march(scene, found.period / 100, found.state.t + found.period, found.state):
        last = step
    assert last.work["flow"] > 0.0
    assert last.work["flow"] == last.energy["feedback"]
    assert last.work["flow"] == pytest.approx(last.energy["damping"], rel=1e-6)
    first = next(gb.march(scene, 1e-9, found.state.t + 1e-9, found.state))
    assert abs(last.balance - first.balance) < 1e-9 * last.work["flow"]


@pytest.mark.parametrize("ratio", [0.003, 0.05, 20.0])
def test_modes_that_a_step_does_not_resolve_do_not_hide_the_stability_of_a_cycle(ratio: float) -> None:
    """A stiff body beside the tube decays within a period: the multipliers of the tube stay the largest ones.

    The steps turn the body's velocity round: by them its multipliers lie beside -1, whatever its damping.
    """
    alone = gb.limit_cycle(remembering(), steps=100)
    omega = 40.0 * 100 / alone.period
    body = gb.mass(0.7, stiffness=0.7 * omega**2, damping=2.0 * ratio * 0.7 * omega)
    tube = remembering()
    both = gb.Scene(*tube.structures, body, contacts=tube.contacts, feedbacks=tube.feedbacks)
    found = gb.limit_cycle(both, steps=100)
    largest = [float(np.abs(one.multipliers).max()) for one in (found, alone)]
    assert largest[0] == pytest.approx(largest[1], rel=1e-4)


def in_flow(modes: int) -> gb.Scene:
    """Return a tube without contacts: one mode in a flow with a memory, or two that the flow couples."""
    tube = gb.mass(1.0, motions=modes, stiffness=100.0, damping=0.3)
    stiffness, damping = (-15.0, 0.2) if modes == 1 else ([[-15.0, 40.0], [-30.0, -5.0]], [[0.2, 0.0], [0.1, 0.3]])
    flow = gb.unsteady(
        tube["at"], velocity=1.0, density=1.0, diameter=0.1, stiffness=stiffness, damping=damping, amplitudes=[0.9],
        rates=[0.2], name="flow",
    )  # fmt: skip
    return gb.Scene(tube, feedbacks=[flow])


@pytest.mark.parametrize("modes", [1, 2])
def test_drawn_starts_decay_below_the_boundary_and_grow_above(modes: int) -> None:
    """200 drawn states without contact: 1 % below the critical velocity all decay, 1 % above those that excite it grow.

    Those whose part in the unstable mode is a hundredth of their size or more; these are nearly all.
    """
    scene = in_flow(modes)
    critical = gb.critical_velocity(scene, "flow.velocity", 0.1, 3.0)
    random = np.random.default_rng(36)
    x = random.standard_normal((3, modes, 200)) * np.array([1.0, 10.0, 1.0])[:, None, None]
    start = SceneState(0.0, *x, np.zeros((0, 200)))
    h = 2 * pi / critical.frequency / 50
    for ratio, grows in ((0.99, False), (1.01, True)):
        one = scene.with_({"flow.velocity": ratio * critical.value})
        values, left = np.linalg.eig(state_matrix(one).T)
        first = int(np.argmax(values.real))
        rate = float(values[first].real)
        assert (rate > 0.0) == grows
        assert np.sum(values.real > 0.0) == (2 if grows else 0)  # one pair
        cycles = round(0.5 / abs(rate) / (50 * h))
        early, late = (gb.ensemble(one, step=h, end=50 * h * n, start=start) for n in (cycles, 4 * cycles))
        sizes = [np.sqrt((100.0 * found.q**2 + found.v**2).sum(axis=0)) for found in (early, late)]
        part = np.abs(left[:, first] @ np.vstack(x)) / np.linalg.norm(left[:, first])
        excited = part > 0.01 * np.linalg.norm(np.vstack(x), axis=0)
        assert excited.sum() > 190
        assert np.all(sizes[1][excited] > 1.2 * sizes[0][excited] if grows else 1.2 * sizes[1] < sizes[0])


def test_subcritical_cycle_is_found_beside_a_stable_rest(tmp_path: Path) -> None:
    """A tube that is stable until its supports stiffen it: small motions decay, large ones end on the cycle.

    A run of it passes its gates: the work of the flow is not energy that the scheme creates.
    """
    tube = gb.mass(1.0, stiffness=100.0, damping=0.3, name="tube")
    flow = gb.quasi_steady(
        tube["at"], velocity=3.0, density=1.0, diameter=0.05, drag=1.0, slope=8.0, delay=14.0, frequency=30.0,
        name="flow",
    )  # fmt: skip
    stop = gb.Contact(tube["at"], gb.Slot(1e-3), gb.Cubic(stiffness=200.0, scale=1e-3), name="stop")
    scene = gb.Scene(tube, contacts=[stop], feedbacks=[flow])
    assert gb.eigenvalues(scene)[0].real < 0.0
    with pytest.raises(gb.UserError, match="needs a start with a large motion"):
        gb.limit_cycle(scene)
    small, large = (scene.state(displacement={tube: x}) for x in (6e-4, 2e-3))
    found = gb.limit_cycle(scene, steps=200, start=large)
    assert found.is_subcritical
    assert found.is_stable
    h = found.period / 200
    once = gb.history(scene, h, found.state.t + found.period, found.state)
    many = gb.ensemble(scene, step=h, end=20000 * h, settle=19000 * h, start=both(small, large))
    assert many.peak["at"][0] < 1e-9
    assert many.peak["at"][1] == pytest.approx(np.abs(once.displacement["at"]).max(), rel=1e-4)
    whole = cycle_atlas(scene, scene.state(), 16, 4.0, 0, 200, 300, 2)
    rest, cycle = sorted(whole.points[0].responses, key=lambda one: one.order)
    assert (rest.order, cycle.order, rest.count + cycle.count) == (0, 1, 16)
    assert cycle.peak["at"] == pytest.approx(np.abs(once.displacement["at"]).max(), rel=2e-3)
    assert cycle.period == pytest.approx(found.period, rel=1e-4)
    assert min(rest.count, cycle.count) > 0
    outcome = gb.run(scene, step=h, end=1000 * h, start=large, output=tmp_path / "run")
    assert outcome.exit_status == 0


def both(one: SceneState, two: SceneState) -> SceneState:
    """Return two states as lanes of one."""
    parts = (np.hstack([getattr(one, key), getattr(two, key)]) for key in ("q", "v", "z", "F"))
    return SceneState(0.0, *parts)


FLUTTER = Path(__file__).parents[2] / "cases/scenes/freeplay-flutter.toml"


def section(ratio: float) -> tuple[gb.Scene, Callable[[float, Any], Any]]:
    """Return the shipped typical section with play in pitch below its flutter velocity, and its equations written out.

    Theodorsen's function by Jones' two exponentials; half chord and pi rho b^2 are 1, the pitching frequency is near 1.
    """
    rho, a, k_h, k_a, c, play = 1 / pi, -0.5, 2.0, 12.5, 0.1, 0.01
    M = np.array([[51.0, 12.5 - a], [12.5 - a, 12.5 + 1 / 8 + a * a]])
    A, b = np.array([0.165, 0.335]), np.array([0.0455, 0.3])
    scene = gb.scene(FLUTTER)
    scene = scene.with_parts(scene.contacts, [])
    U = ratio * gb.critical_velocity(scene, "air.velocity", 1.0, 8.0, closed=["freeplay"]).value
    inverse = np.linalg.inv(M)

    def rate(t: float, x: Any) -> Any:  # noqa: ARG001
        h, alpha, sink, turn, *z = x
        w = sink + U * alpha + (0.5 - a) * turn
        late = w - b * U * np.array(z)
        L = 2 * pi * rho * U * (w - A @ late)
        moment = -k_a * np.sign(alpha) * max(abs(alpha) - play, 0.0) - c * turn
        force = [-L - U * turn - k_h * h - c * sink, (0.5 + a) * L - U * (0.5 - a) * turn + moment]
        return [sink, turn, *(inverse @ force), *late]

    return scene.with_({"air.velocity": U}), rate


@pytest.mark.parametrize("ratio", [0.7, 0.8, 0.9])
def test_freeplay_flutter_of_a_typical_section_is_that_of_its_equations(ratio: float) -> None:
    """Pitch and plunge of the limit cycle below the flutter velocity, and its period, at 200 steps a period."""
    scene, rate = section(ratio)
    times = np.linspace(500.0, 600.0, 10001)
    start = [0.0, 0.03, 0.0, 0.0, 0.0, 0.0]
    own = solve_ivp(rate, (0.0, 600.0), start, "LSODA", times, rtol=1e-8, atol=1e-11, max_step=0.5).y
    wing = scene.structures[0]
    found = gb.limit_cycle(scene, steps=200, start=scene.state(displacement={wing: [0.0, 0.03]}), period=12.0)
    once = gb.history(scene, found.period / 200, found.state.t + found.period, found.state)
    for name, row in (("pitch", own[1]), ("plunge", own[0])):
        assert np.abs(once.displacement[name]).max() == pytest.approx(np.abs(row).max(), rel=0.01)
    up = np.flatnonzero((own[1][:-1] <= 0.0) & (own[1][1:] > 0.0))
    assert found.period == pytest.approx((times[up[-1]] - times[up[0]]) / (len(up) - 1), rel=0.01)
    assert found.is_stable


@pytest.mark.slow(minutes=0.4)
def test_atlas_over_the_velocity_has_the_cycles_of_the_equations(tmp_path: Path) -> None:
    """At 0.8 and 0.9 of the flutter velocity all starts come to the cycle of the equations, by command."""
    ratios = [section(0.8), section(0.9)]
    speeds = [scene.feedbacks[0].velocity for scene, _ in ratios]  # type: ignore[attr-defined]
    vary = f"feedback.air.velocity={speeds[0]},{speeds[1]}"
    words = ["atlas", str(FLUTTER), "--vary", vary, "--starts", "8", "--settle", "60", "--output", str(tmp_path / "a")]
    assert called(*words).returncode == 0
    times, start = np.linspace(500.0, 600.0, 10001), [0.0, 0.03, 0.0, 0.0, 0.0, 0.0]
    points = json.loads((tmp_path / "a/atlas.json").read_text())
    for (_, rate), point in zip(ratios, points, strict=True):
        pitch = solve_ivp(rate, (0.0, 600.0), start, "LSODA", times, rtol=1e-8, atol=1e-11, max_step=0.5).y[1]
        assert [(one["order"], one["starts"]) for one in point["responses"]] == [(1, 8)]
        cycle = point["responses"][0]
        assert cycle["peak"]["pitch"] == pytest.approx(np.abs(pitch).max(), rel=0.01)
        up = np.flatnonzero((pitch[:-1] <= 0.0) & (pitch[1:] > 0.0))
        assert cycle["period"] == pytest.approx((times[up[-1]] - times[up[0]]) / (len(up) - 1), rel=0.01)
        assert cycle["largest_multiplier"] < 1.0
    assert "cycle of 0.07335 Hz" in (tmp_path / "a/atlas.csv").read_text()
    assert (tmp_path / "a/atlas-responses.png").stat().st_size > 0


@pytest.mark.slow(minutes=0.1)
def test_starts_that_come_to_two_frequencies_are_named_and_not_shot_at(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two masses, each in a cycle of its own of another frequency: together they never repeat, nor are they chaotic.

    Both frequencies and forces are those of either mass alone.
    """
    law, asked = gb.KelvinVoigt(stiffness=400.0, damping=4.0), list[Any]()
    bodies = [gb.mass(1.0, stiffness=k, damping=0.1, name=name) for k, name in ((100.0, "one"), (190.0, "two"))]
    stops = [gb.Contact(one["at"], gb.Slot(2e-3), law, name=f"stop {one.name}") for one in bodies]
    pushes = [gb.Feedback(one["at"], one["at"], [], [], [], [0.0, 1.0]) for one in bodies]
    cycles = []
    for parts in zip(bodies, stops, pushes, strict=True):
        alone = gb.Scene(parts[0], contacts=parts[1:2], feedbacks=parts[2:])
        point = cycle_atlas(alone, alone.state(), 3, 2.0, 0, 100, 60, 2).points[0]
        assert [(one.order, one.count, one.frequencies) for one in point.responses] == [(1, 3, ())]
        cycles.append(point.responses[0])
    monkeypatch.setattr(cycle_search, "limit_cycle", lambda *given, **_: asked.append(given))
    both = gb.Scene(*bodies, contacts=stops, feedbacks=pushes)
    point = cycle_atlas(both, both.state(), 3, 2.0, 0, 100, 60, 2).points[0]
    assert (point.unsettled, point.chaotic, asked) == (0.0, 0.0, [])
    (found,) = point.responses
    assert (found.order, found.count, found.multipliers) == (-1, 3, pytest.approx(1.0, abs=0.05))
    assert sorted(found.frequencies) == pytest.approx([1.0 / one.period for one in cycles], rel=2e-3)
    assert found.peak_force == pytest.approx(cycles[0].peak_force | cycles[1].peak_force, rel=5e-3)


def test_a_free_motion_sets_no_period() -> None:
    """A wing without spring in pitch but what round-off leaves marches to its cycle from a start without a period."""
    M, K, C = np.diag([51.0, 13.0]), np.diag([2.0, 1e-60]), np.diag([-0.1, 0.4])
    wing = gb.Structure(M, K, C, points={"pitch": [0.0, 1.0], "plunge": [1.0, 0.0]}, name="wing")
    stop = gb.Contact(wing["plunge"], gb.Slot(0.02), gb.KelvinVoigt(stiffness=12.5, damping=0.4), name="stop")
    scene = gb.Scene(wing, contacts=[stop], joints=[gb.Joint(wing["pitch"], 20.0, 0.4)])
    found = gb.limit_cycle(scene, start=scene.state(displacement={wing: [0.02, 0.0]}))
    assert 5.0 < found.period < 2.0 * pi * np.sqrt(51.0 / 2.0)  # of the plunge, which the stops stiffen
    assert found.is_stable


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e3])
@pytest.mark.parametrize("kind", ["integral", "lag"])
def test_a_body_that_feedback_alone_holds_has_its_cycle(size: float, kind: str) -> None:
    """A PID with too much integral, and a lagged magnet, between stops: as SciPy integrates, at any size."""
    ki, kp, kd = (9.0, 1.0, 2.0) if kind == "integral" else (0.0, 1.0, 0.5)
    gap, stiff, damping = 0.1, 40.0, 0.5
    m, k, w = size**3, size, 1.0 / size
    body = gb.mass(m, name="body")
    if kind == "integral":
        law: dict[str, Any] = {"A": [[0.0]], "B": [[1.0, 0.0]], "C": [[-k * w * ki]], "D": [[-k * kp, -k / w * kd]]}
    else:  # F = -(k_p x + k_d x') through a lag of 1 / w
        law = {"A": [[-w]], "B": [[k * kp * w, k * kd]], "C": [[-1.0]]}
    loop = gb.Feedback(body["at"], body["at"], **law, name="loop")
    stop = gb.Contact(
        body["at"], gb.Slot(2 * gap * size), gb.KelvinVoigt(stiffness=stiff * k, damping=damping * k / w), name="stop"
    )
    found = gb.limit_cycle(gb.Scene(body, contacts=[stop], feedbacks=[loop]), steps=400)

    def rate(t: float, x: Any) -> Any:  # noqa: ARG001
        y, v, z = x
        force = pressed(y, v, gap, stiff, damping)
        if kind == "integral":
            return [v, force - kp * y - kd * v - ki * z, y]
        return [v, force - z, kp * y + kd * v - z]

    times = np.linspace(180.0, 200.0, 40001)
    y, v, _ = solve_ivp(rate, (0, 200.0), [1e-2, 0.0, 0.0], "LSODA", times, rtol=1e-10, atol=1e-13, max_step=0.02).y
    own = figures(times, y, pressed(y, v, gap, stiff, damping))
    once = gb.history(gb.Scene(body, contacts=[stop], feedbacks=[loop]), found.period / 400,
                      found.state.t + found.period, found.state)  # fmt: skip
    assert np.abs(once.displacement["at"]).max() == pytest.approx(size * own.amplitude, rel=1e-3)
    assert found.frequency == pytest.approx(w * own.frequency, rel=1e-3)
    assert found.is_stable


def hopeless() -> dict[str, tuple[Callable[[], Any], type[Exception], str]]:
    tube = gb.mass(1.0, stiffness=100.0, damping=0.1, name="tube")
    law = gb.KelvinVoigt(stiffness=1e4)
    stop, far = (gb.Contact(tube["at"], gb.Slot(gap), law, name="stop") for gap in (1e-3, 1e3))
    slow = gb.mass(1.0, stiffness=100.0, damping=2.0, name="slow")
    calm = gb.Scene(slow, contacts=[gb.Contact(slow["at"], gb.Slot(1e-3), law, name="stop")])
    push = gb.Feedback(tube["at"], tube["at"], [], [], [], [0.0, 0.5])
    fast = gb.Feedback(tube["at"], tube["at"], [], [], [], [1.02e4, 1.0])  # beyond the stiffness of the stop
    shake = gb.Force(tube["at"], lambda t: np.sin(t), name="shake")
    still, moved = gb.Scene(tube, contacts=[stop]), gb.Scene(tube, contacts=[stop], feedbacks=[push], loads=[shake])
    return {
        "no contact": (lambda: gb.limit_cycle(gb.Scene(tube, feedbacks=[push])), gb.UserError, "no contacts"),
        "stable": (lambda: gb.limit_cycle(still), gb.UserError, "all motions decay"),
        "decays": (
            lambda: gb.limit_cycle(calm, steps=20, start=calm.state(velocity={calm.structures[0]: 1.0})),
            gb.NotConverged,
            "decays to rest",
        ),
        "load": (lambda: gb.limit_cycle(moved), gb.UserError, "load shake varies in time"),
        "atlas": (
            lambda: cycle_atlas(moved, moved.state(), 2, 2.0, 0, 50, 10, 1), gb.UserError, "atlas: load shake varies"
        ),
        "atlas without contact": (
            lambda: cycle_atlas(gb.Scene(tube), gb.Scene(tube).state(), 2, 2.0, 0, 50, 10, 1), gb.UserError,
            "touches a contact",
        ),
        "grows": (
            lambda: gb.limit_cycle(
                gb.Scene(tube, contacts=[far], feedbacks=[push]), steps=20, cycles=150,
                start=gb.Scene(tube, feedbacks=[push]).state(velocity={tube: 1e-4}),
            ),
            gb.NotConverged,
            "limit cycle: ",
        ),
        "diverges": (
            lambda: gb.limit_cycle(
                gb.Scene(tube, contacts=[stop], feedbacks=[fast]), steps=100, cycles=200,
                start=gb.Scene(tube, feedbacks=[fast]).state(velocity={tube: 1e-2}),
            ),
            gb.NotConverged, "grows without limit",
        ),
    }  # fmt: skip


@pytest.mark.parametrize("name", hopeless())
def test_scenes_without_a_limit_cycle_are_refused(name: str) -> None:
    call, kind, words = hopeless()[name]
    with pytest.raises(kind, match=words):
        call()
