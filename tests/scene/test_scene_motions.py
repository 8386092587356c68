"""Scenes against answers from elsewhere: closed forms, event-driven integration, exact restitution and orbits."""

from __future__ import annotations

from math import gamma, pi, sqrt
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq

import gapbeam as gb
from benchmarks.stiff_marches import march
from gapbeam.solver.scene import structure
from gapbeam.solver.scene.marcher import Marcher

SQUARE = np.array([[1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]])


def bilinear(end: float) -> np.ndarray:
    """Return displacement and velocity of a bilinear oscillator, integrated from event to event."""
    force, frequency, ratio, gap, stiff = 0.5, 0.7, 0.01, 0.5, 100.0
    t, y, inside = 0.0, np.zeros(2), False
    while t < end:

        def hit(_: float, y: np.ndarray) -> float:
            return float(y[0] - gap)

        hit.terminal, hit.direction = True, -1 if inside else 1  # type: ignore[attr-defined]
        k = stiff if inside else 0.0

        def rate(t: float, y: np.ndarray, k: float = k) -> list[float]:
            return [y[1], force * np.cos(frequency * t) - 2 * ratio * y[1] - y[0] - k * (y[0] - gap)]

        found = solve_ivp(rate, (t, end), y, events=hit, rtol=1e-12, atol=1e-13, method="DOP853")
        t, y = found.t[-1], found.y[:, -1]
        inside = not inside if found.status == 1 else inside
    return y


def test_a_bilinear_oscillator_follows_event_driven_integration() -> None:
    """Of order 2, the balance closed to round-off; the exact displacement at 40 is -1.15731593."""
    one = gb.mass(1.0, stiffness=1.0, damping=0.02)
    stop = gb.Contact(one["at"], gb.HalfPlane(0.5), gb.KelvinVoigt(stiffness=100.0))
    scene = gb.Scene(one, contacts=[stop], loads=[gb.Force(one["at"], lambda t: 0.5 * np.cos(0.7 * t))])
    exact, ends = bilinear(40.0), []
    assert exact[0] == pytest.approx(-1.15731593, abs=1e-8)
    for steps in (8000, 16000, 32000):
        found = gb.history(scene, 40.0 / steps, 40.0)
        ends.append([found.displacement["at"][-1], found.velocity["at"][-1]])
        assert abs(found.last.balance) < 1e-11
    error = np.abs(np.array(ends) - exact)
    assert error[-1].max() < 3e-5
    assert np.abs((4 * np.array(ends[2]) - ends[1]) / 3 - exact).max() < 3e-6
    assert np.abs(np.log2(error[:-1] / error[1:]) - 2.0).max() < 0.15


def test_two_equal_masses_exchange_their_velocities() -> None:
    """Momentum and energy are kept at every step, and one mass takes all of the velocity of the other."""
    a, b = gb.mass(2.0, name="a"), gb.mass(2.0, name="b")
    touch = gb.Contact((a["at"], b["at"]), gb.HalfPlane(0.01), gb.HuntCrossley(stiffness=1e6), name="touch")
    scene = gb.Scene(a, b, contacts=[touch])
    for step in gb.march(scene, 1e-5, 0.03, scene.state(velocity={a: 1.0})):
        assert step[a["at"]].velocity + step["b.at"].velocity == pytest.approx(1.0, abs=1e-12)
        assert step.balance == pytest.approx(1.0, abs=1e-12)
    assert abs(step["a.at"].velocity) < 1e-12
    assert step["b.at"].velocity == pytest.approx(1.0, abs=1e-12)


def test_a_ball_bounces_when_it_should() -> None:
    """Flights of 2 v0 / g between contacts under gravity, whose duration has a closed form."""
    g, stiff, height = 9.81, 1e8, 0.1
    ball = gb.mass(1.0)
    ground = gb.Contact(ball["at"], gb.HalfPlane(0.0, normal=-1.0), gb.KelvinVoigt(stiffness=stiff), name="ground")
    scene = gb.Scene(ball, contacts=[ground], loads=[gb.Force(ball["at"], -g)])
    speed, w = sqrt(2 * g * height), sqrt(stiff)
    period = 2 * speed / g + 2 / w * (pi - np.arctan(speed * w / g))
    found = gb.history(scene, 2e-6, 1.0, scene.state(displacement={ball: height}))
    force = found.force["ground"]
    touches = found.t[np.flatnonzero((force[1:] > 0.0) & (force[:-1] == 0.0))]
    assert len(touches) == 3
    assert np.abs(touches - sqrt(2 * height / g) - period * np.arange(3)).max() < 4e-6


@pytest.mark.parametrize(("loss", "restitution"), [(0.0, 1.0), (0.5, 0.74843493160), (2.0, 0.41071968606)])
def test_restitution_of_a_hertz_contact_with_losses(loss: float, restitution: float) -> None:
    """Restitution by quadrature for chi v0 = loss, and the duration of an elastic contact by gamma functions."""
    stiff, size, speed, n = 1e7, 0.5, 0.3, 1.5
    one = gb.mass(size)
    law = gb.HuntCrossley(stiffness=stiff, chi=loss / speed)
    scene = gb.Scene(one, contacts=[gb.Contact(one["at"], gb.HalfPlane(0.0), law, name="wall")])
    found = gb.history(scene, 5e-7, 1.2e-2, scene.state(velocity={one: speed}))
    assert -found.last["at"].velocity / speed == pytest.approx(restitution, abs=1e-6)
    if loss == 0.0:
        deep = ((n + 1) * size * speed**2 / (2 * stiff)) ** (1 / (n + 1))
        duration = 2 * deep / speed * sqrt(pi) * gamma(1.4) / gamma(0.9)
        assert np.count_nonzero(found.force["wall"]) * 5e-7 == pytest.approx(duration, abs=1e-6)


def test_an_orbit_in_a_hole_keeps_energy_and_angular_momentum() -> None:
    one = gb.mass(1.0, motions=2)
    scene = gb.Scene(one, contacts=[gb.Contact(one["at"], gb.Disc(1.0), gb.HuntCrossley(stiffness=1e5))])
    start = scene.state(displacement={one: [0.5, 0.0]}, velocity={one: [0.3, 1.7]})
    for step in gb.march(scene, 1e-3, 20.0, start, every=10):
        (x, y), (u, v) = step["at"].displacement, step["at"].velocity
        assert x * v - y * u == pytest.approx(0.85, abs=2e-11)
    assert step.balance == pytest.approx(0.5 * (0.09 + 1.7**2), abs=2e-11)


@pytest.mark.parametrize(("sliding", "close"), [(1e-6, 1e-4), (0.0, 1e-4)])
def test_friction_stops_a_slide_after_its_distance(sliding: float, close: float) -> None:
    """A mass on a plane stops after v^2 / (2 mu g), and friction has taken m v^2 / 2."""
    one = gb.mass(1.0, motions=2)
    law = gb.KelvinVoigt(stiffness=1e6)
    plane = gb.Contact(one["at"], gb.HalfPlane(0.0, normal=[0.0, -1.0]), law, friction=0.3, sliding=sliding)
    scene = gb.Scene(one, contacts=[plane], loads=[gb.Force(one["at"], -9.81, direction=[0.0, 1.0])])
    start = scene.state(displacement={one: [0.0, -9.81e-6]}, velocity={one: [1.0, 0.0]})
    *_, step = gb.march(scene, 1e-3, 0.6, start, every=100)
    assert step["at"].displacement[0] == pytest.approx(1.0 / (2 * 0.3 * 9.81), rel=close)
    assert step.energy["friction"] == pytest.approx(0.5, rel=1e-5)


@pytest.mark.parametrize("stiffness", [1e4, 1e8, 1e12, 1e16])
@pytest.mark.parametrize("region", [gb.Disc(1.0), gb.Polygon(SQUARE)], ids=["disc", "square"])
def test_stiff_walls_and_coarse_steps_keep_energy(stiffness: float, region: object) -> None:
    one = gb.mass(1.0, motions=2)
    for h in (1e-5, 1e-3, 1e-2):
        scene = gb.Scene(one, contacts=[gb.Contact(one["at"], region, gb.KelvinVoigt(stiffness=stiffness))])
        start = scene.state(displacement={one: [0.999, 0.0]}, velocity={one: [0.3, 1.7]})
        for step in gb.march(scene, h, 1000 * h, start, every=1000):
            assert step.balance == pytest.approx(0.5 * (0.09 + 1.7**2), abs=1e-6)


def test_a_wall_that_moves_returns_a_mass_at_twice_its_speed() -> None:
    one = gb.mass(1.0)
    law = gb.KelvinVoigt(stiffness=1e6)
    wall = gb.Contact(one["at"], gb.HalfPlane(0.0), law, offset=-0.1, wall=lambda t: -0.5 * t)
    scene = gb.Scene(one, contacts=[wall])
    for step in gb.march(scene, 1e-5, 0.2, scene.state(velocity={one: 1.0}), every=1000):
        assert step.balance == pytest.approx(0.5, abs=1e-11)
    assert step["at"].velocity == pytest.approx(-2.0, abs=1e-8)


SCHEMES = {
    "midpoint": (gb.theta(0.5), 2),
    "newmark": (gb.newmark(), 2),
    "hht": (gb.hht(0.1), 2),
    "generalized": (gb.generalized_alpha(0.6), 2),
    "euler": (gb.euler(), 1),
    "theta": (gb.theta(0.7), 1),
}


@pytest.mark.parametrize("name", SCHEMES)
def test_schemes_have_their_order_in_free_damped_vibration(name: str) -> None:
    """X = exp(-z w t) cos(w_d t) with the start on the exact motion, halving the step twice."""
    scheme, order = SCHEMES[name]
    w, ratio = 7.0, 0.05
    decay, free = ratio * w, w * sqrt(1 - ratio**2)
    one = gb.mass(2.0, stiffness=2.0 * w * w, damping=2.0 * 2.0 * ratio * w)
    scene = gb.Scene(one)
    start = scene.state(displacement={one: 1.0}, velocity={one: -decay})
    errors = []
    for steps in (200, 400, 800):
        found = gb.history(scene, 2.0 / steps, 2.0, start, scheme=scheme)
        exact = np.exp(-decay * found.t) * np.cos(free * found.t)
        errors.append(np.abs(found.displacement["at"] - exact).max())
    assert np.abs(np.log2(np.array(errors[:-1]) / errors[1:]) - order).max() < 0.15


def test_a_sparse_structure_moves_as_its_modes_do() -> None:
    """One chain as matrices of a small and of a large structure: two marches of different kinds."""
    count = 200
    K = 1e4 * (2 * np.eye(count) - np.eye(count, k=1) - np.eye(count, k=-1))
    ends = []
    for size in (count, 700):  # beyond 600 DOFs: sparse; the others are masses of their own
        M, stiff = np.eye(size) * 0.1, np.eye(size) * 1e4
        stiff[:count, :count] = K
        chain = gb.Structure(M, stiff, 1e-5 * stiff, points={"end": 0, "middle": 100})
        assert chain.is_large == (size > 600)
        stop = gb.Contact(chain["end"], gb.Slot(2e-4), gb.KelvinVoigt(stiffness=1e5, damping=3.0), name="stop")
        joint = gb.Joint(chain["middle"], stiffness=500.0, damping=0.1)
        load = gb.Force(chain["end"], lambda t: 5.0 * np.sin(200.0 * t))
        scene = gb.Scene(chain, contacts=[stop], loads=[load], joints=[joint])
        found = gb.history(scene, 1e-4, 0.1)
        assert abs(found.last.balance) < 1e-12 * found.last.energy["loads"] + 1e-13
        ends.append(found)
    assert np.abs(ends[0].displacement["end"] - ends[1].displacement["end"]).max() < 1e-10
    assert np.abs(ends[0].force["stop"]).max() > 1.0


@pytest.mark.parametrize("ratio", [0.05, 0.3, 0.9])
def test_a_damper_that_its_spring_limits_rebounds_as_its_three_phases(ratio: float) -> None:
    """A force -(k x + min(max(c x', -k x), k x)): 2 k x at first, then k x + c x', then none.

    The first phase is sin(sqrt(2 k / m) t), the second an exponential of the damped oscillator.
    """
    m, k, speed = 2.0, 1.8e6, 0.7
    c = 2.0 * ratio * sqrt(k * m)
    w = sqrt(2.0 * k / m)
    first = np.arctan(c * w / k)
    state = np.array([speed / w * np.sin(first), speed * np.cos(first)])
    damped = np.array([[0.0, 1.0], [-k / m, -c / m]])

    def force(t: float) -> float:
        return float(np.array([k, c]) @ expm(damped * t) @ state)

    end = brentq(force, 0.0, pi / sqrt(k / m))
    rebound = float((expm(damped * end) @ state)[1])
    one = gb.mass(m)
    stop = gb.Contact(one["at"], gb.HalfPlane(1e-3), gb.ElastoGap(stiffness=k, damping=c), name="stop")
    scene = gb.Scene(one, contacts=[stop])
    errors = []
    for step in (2e-5, 1e-5, 5e-6):
        found = gb.history(scene, step, 0.01, scene.state(velocity={one: speed}))
        errors.append(abs(float(found.last.state.v[0, 0]) / sqrt(m) - rebound))
        assert found.force["stop"].max() <= 0.0
    assert errors[-1] < 2e-4 * speed
    assert errors[2] < 0.7 * errors[0]


@pytest.mark.parametrize("region", ["hole", "square"])
@pytest.mark.parametrize("stiffness", [1e6, 1e10, 1e14])
@pytest.mark.parametrize("sliding", [0.0, 1e-6])
def test_friction_that_sticks_converges_in_stiff_holes_and_keeps_the_balance(
    region: str, stiffness: float, sliding: float
) -> None:
    """A mass strikes the wall of its hole and sticks there: sticking is found from the force, not from the slip."""
    assert march(region, stiffness, 1e-5, 0.3, sliding) < 1e-6


def test_a_stiff_joint_makes_one_of_two_masses() -> None:
    """Two masses on a joint of 1e9 N/m oscillate on a spring as their sum does."""
    a, b = gb.mass(1.0, stiffness=50.0, name="a"), gb.mass(2.0, name="b")
    scene = gb.Scene(a, b, joints=[gb.Joint((a["at"], b["at"]), stiffness=1e9)])
    w = sqrt(50.0 / 3.0)
    found = gb.history(scene, 1e-3, 5.0, scene.state(velocity={a: 1.0, b: 1.0}))
    assert np.abs(found.displacement["a.at"] - np.sin(w * found.t) / w).max() < 1e-5
    assert abs(found.last.balance - 1.5) < 1e-9


def test_a_mass_on_a_point_moves_as_a_heavier_structure() -> None:
    one = gb.mass(1.0, stiffness=90.0).with_masses({"at": 9.0})
    assert gb.weight(one, 9.81).pattern == pytest.approx([10.0])
    scene = gb.Scene(one)
    found = gb.history(scene, 1e-4, 2.0, scene.state(velocity={one: 1.0}))
    assert np.abs(found.displacement["at"] - np.sin(3.0 * found.t) / 3.0).max() < 1e-6


def test_point_masses_of_a_scene_move_weigh_and_are_shaken_as_those_of_a_structure() -> None:
    """A clamped beam with a tip mass: one motion by two ways, and the sag of Timoshenko's closed form."""
    made = gb.section("rectangle", thickness=0.01, width=0.02), gb.material(2e11, 7850.0)
    beam = gb.beam(0.5, *made, {"tip": 0.5, "middle": 0.25}, clamped=[0.0], elements=6, name="beam")
    heavy = beam.with_masses({"tip": 0.4})

    def found(structure: gb.Structure, masses: list[Any]) -> Any:
        loads = [gb.weight(structure, -9.81), gb.BaseMotion(structure, lambda t: 5.0 * np.sin(80.0 * t))]
        stop = gb.Contact(structure["tip"], gb.HalfPlane(1e-4), gb.KelvinVoigt(stiffness=1e6), name="stop")
        scene = gb.Scene(structure, contacts=[stop], loads=loads, masses=masses)
        return gb.history(scene, 1e-4, 0.1, gb.seat(scene)).displacement["tip"]

    by_scene, by_structure = found(beam, [(beam["tip"], 0.3), (beam["tip"], 0.1)]), found(heavy, [])
    assert np.abs(by_scene - by_structure).max() < 1e-12
    sags = []
    for kg in (0.0, 0.4):
        scene = gb.Scene(beam, loads=[gb.weight(beam, -9.81)], masses=[(beam["tip"], kg)])
        sags.append(float((scene.rows([beam["tip"]]) @ gb.seat(scene).q)[0, 0]))
    section, _ = made
    soft = 0.5**3 / (3.0 * 2e11 * section.second_moment) + 0.5 * 2.6 / (2e11 * section.shear_area)
    assert sags[0] - sags[1] == pytest.approx(0.4 * 9.81 * soft, rel=1e-9)


@pytest.mark.parametrize("entry", [0.3, ("tip", 0.3), (gb.mass(1.0)["at"], 0.3)])
def test_masses_that_are_at_no_point_of_the_scene_are_refused(entry: Any) -> None:
    with pytest.raises(gb.UserError, match="mass"):
        gb.Scene(gb.mass(1.0), masses=[entry])


def test_steps_and_histories_agree_bit_for_bit() -> None:
    one = gb.mass(0.3, motions=2, stiffness=500.0, damping=0.1)
    hole = gb.Contact(one["at"], gb.Disc(1e-3), gb.HuntCrossley(stiffness=1e7, chi=0.5), friction=0.2, sliding=1e-3)
    scene = gb.Scene(one, contacts=[hole], loads=[gb.Force(one["at"], lambda t: 2.0 * np.sin(40.0 * t), [1.0, 0.4])])
    found = gb.history(scene, 1e-4, 0.1)
    steps = [step["at"].displacement for step in gb.march(scene, 1e-4, 0.1)]
    assert np.array_equal(found.displacement["at"], np.array(steps))


def test_a_march_continues_from_its_state() -> None:
    one = gb.mass(1.0, stiffness=100.0)
    stop = gb.Contact(one["at"], gb.HalfPlane(0.01), gb.KelvinVoigt(stiffness=1e5))
    scene = gb.Scene(one, contacts=[stop])
    start = scene.state(velocity={one: 1.0})
    whole = Marcher(scene, 1e-4, start)
    whole.advance(2000)
    half = Marcher(scene, 1e-4, start)
    half.advance(1000)
    rest = Marcher(scene, 1e-4, half.state)
    rest.advance(1000)
    assert np.array_equal(rest.q, whole.q)
    assert np.array_equal(rest.v, whole.v)


def disc_and_bar(monkeypatch: pytest.MonkeyPatch, kind: str) -> gb.Scene:
    """Return a ball of two motions in a hole beside a beam, in modes, with sparse matrices, or under a moving mass."""
    ball = gb.mass(0.5, motions=2, stiffness=2e3, damping=2.0, name="ball")
    hole = gb.Contact(ball["at"], gb.Disc(3e-4), gb.KelvinVoigt(1e6, 10.0), friction=0.2, sliding=1e-3, name="hole")
    push = gb.Force(ball["at"], lambda t: 3.0 * np.sin(2 * pi * 30.0 * t), [0.8, 0.6], name="push")
    section, steel = gb.section("rectangle", thickness=0.01, width=0.02), gb.material(2.1e11, 7850.0)
    way = {f"p{k}": 0.1 * k for k in range(1, 8)}
    beam = gb.beam(1.0, section, steel, {"tip": 1.0, **way}, pinned=[0.0, 0.8], elements=10, name="beam")
    shake = gb.Force(beam["tip"], lambda t: 20.0 * np.cos(2 * pi * 25.0 * t), name="shake")
    bodies, contacts = [ball, beam], [hole]
    if kind == "sparse":
        monkeypatch.setattr(structure, "LARGE", 3)
    if kind == "moving":
        wheel = gb.mass(1.0, name="wheel")
        road = gb.moving_point([beam[name] for name in way], list(way.values()), lambda t: 0.1 + 5.0 * t)
        contacts.append(gb.Contact((wheel["at"], road), gb.HalfPlane(0.0), gb.KelvinVoigt(1e6, 50.0), name="tread"))
        bodies.append(wheel)
    return gb.Scene(*bodies, contacts=contacts, loads=[push, shake])


@pytest.mark.parametrize(
    ("kind", "scheme"),
    [(kind, gb.midpoint()) for kind in ("modes", "sparse", "moving")]
    + [(kind, gb.generalized_alpha(0.8)) for kind in ("modes", "sparse")],
)
def test_histories_have_the_velocities_of_each_step(kind: str, scheme: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of every point and motion, those of a march step by step; and the midpoint rule moves by their means."""
    scene, h = disc_and_bar(monkeypatch, kind), 2e-4
    found = gb.history(scene, h, 0.1, scheme=scheme)
    for k, step in enumerate(gb.march(scene, h, 0.1, scheme=scheme)):
        for name in scene.point_names:
            assert found.velocity[name][k] == pytest.approx(step[name].velocity, rel=1e-12, abs=1e-15)
    assert found.velocity["ball.at" if kind == "moving" else "at"].shape == (500, 2)
    for name, v in found.velocity.items():
        if scheme == gb.midpoint():
            moved = np.diff(found.displacement[name], axis=0) / h
            assert np.abs(moved - 0.5 * (v[1:] + v[:-1])).max() < 1e-9 * np.abs(v).max()
