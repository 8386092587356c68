"""Forces, masses, cars and supports that move, against the series of Fryba, SciPy and a moving frame."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy

import gapbeam as gb
from gapbeam.solver.loads.time_function import Harmonic
from gapbeam.solver.messages.errors import CaseError
from gapbeam.solver.system.operators import Array
from tests.shared.slips import Change, Tables, check_refused, check_slip, put

LENGTH, SPEED, WHEEL = 10.0, 30.0, 1000.0  # m, m/s, N
SECTION = gb.section("rectangle", 0.1)._replace(shear_area=float("inf"))  # Euler and Bernoulli
STEEL = gb.material(2.1e11, 7850.0)


def series(t: Array, x: float) -> Array:
    """Return the displacement of a simply supported beam while the force is on it.

    Source: Fryba (1999), Vibration of Solids and Structures under Moving Loads, 3rd ed., eq. 1.31 without damping.
    """
    mass, bending = STEEL.density * SECTION.area, STEEL.young_modulus * SECTION.second_moment
    found = np.zeros(len(t))
    for n in range(1, 60):
        k = n * np.pi / LENGTH
        w, turn = k * k * np.sqrt(bending / mass), k * SPEED
        found += np.sin(k * x) * (np.sin(turn * t) - turn / w * np.sin(w * t)) / (w * w - turn * turn)
    return np.asarray(2.0 * WHEEL / (mass * LENGTH) * found)


def driven(count: int, force: Any = WHEEL, position: Any = SPEED) -> gb.History:
    """March a beam with so many points along it."""
    x = np.linspace(0.0, LENGTH, count)
    points = {f"p{i}": float(at) for i, at in enumerate(x)} | {"middle": 0.4 * LENGTH}
    beam = gb.beam(LENGTH, SECTION, STEEL, points, pinned=[0.0, LENGTH], elements=60, modes=20)
    wheel = gb.moving_force([beam[f"p{i}"] for i in range(count)], x, force, position, name="wheel")
    return gb.history(gb.Scene(beam, loads=wheel), 1e-4, 0.4)


def test_a_wheel_crosses_a_bridge() -> None:
    """0.05 % with 21 points, and an error that falls faster than the third power of their distance."""
    errors = []
    for count in (6, 11, 21):
        found = driven(count)
        on = found.t <= LENGTH / SPEED
        wanted = series(found.t[on], 0.4 * LENGTH)
        errors.append(np.abs(found.displacement["middle"][on] - wanted).max() / np.abs(wanted).max())
    assert errors[2] < 5e-4, errors
    assert errors[1] < errors[0] / 8.0
    assert abs(found.last.balance) < 1e-12 * found.last.energy["kinetic"]


def test_force_and_position_may_be_functions() -> None:
    """The same way by a function; half the force moves half as far; behind the end the beam is free."""
    one = driven(11)
    two = driven(11, lambda t: 0.5 * WHEEL + 0.0 * t, lambda t: SPEED * t)
    assert np.abs(2.0 * two.displacement["middle"] - one.displacement["middle"]).max() < 1e-12
    still = driven(11, position=lambda t: -1.0 - t)
    assert np.abs(still.displacement["middle"]).max() == 0.0


@pytest.mark.parametrize(
    ("places", "words"),
    [([0.0], "a place for each"), ([0.0, 0.0], "beyond the one before"), ([1.0, "a"], "real numbers")],
)
def test_nonsense_is_refused(places: Any, words: str) -> None:
    beam = gb.beam(1.0, SECTION, STEEL, {"a": 0.0, "b": 1.0})
    with pytest.raises(gb.UserError, match=words):
        gb.moving_force([beam["a"], beam["b"]], places, 1.0, 1.0)


MODES = np.arange(1, 7) * np.pi / LENGTH
LINE = STEEL.density * SECTION.area  # kg/m
SQUARES = MODES**4 * STEEL.young_modulus * SECTION.second_moment / LINE
CAR, AXLE, SPRING, DAMPER, TREAD, GRAVITY = 2000.0, 400.0, 1e5, 2e3, 4e6, 9.81


def shapes(x: float) -> Array:
    """Return the mass-normalized modes of the beam at x."""
    return np.sqrt(2.0 / (LINE * LENGTH)) * np.sin(MODES * x)


def crossed(tread: float, axle: float, car: float, times: Array) -> tuple[Array, Array]:
    """Return the motions of the beam at 0.4 of its length and of the wheel, downward, by SciPy: free to lift off."""
    n, spring, damper = len(MODES), SPRING * (car > 0.0), DAMPER * (car > 0.0)

    def slopes(t: float, s: Array) -> Array:
        q, v, (z, u, y, w) = s[:n], s[n : 2 * n], s[2 * n :]
        b = shapes(SPEED * t) * (SPEED * t <= LENGTH)
        force, inner = tread * max(0.0, z - b @ q), spring * (z - y) + damper * (u - w)
        rest = [u, GRAVITY - (force + inner) / axle, w, GRAVITY + inner / (car or 1.0)]
        return np.concatenate([v, b * force - SQUARES * q, rest])

    start, weight = np.zeros(2 * n + 4), (axle + car) * GRAVITY
    start[2 * n], start[2 * n + 2] = weight / tread, weight / tread + (car * GRAVITY / SPRING if car else 0.0)
    found = scipy.integrate.solve_ivp(slopes, (0.0, times[-1]), start, "DOP853", times, rtol=1e-8, atol=1e-11,
                                      max_step=2e-3)  # fmt: skip
    return shapes(0.4 * LENGTH) @ found.y[:n], found.y[2 * n]


def marched(h: float, tread: float, axle: float, car: float) -> gb.History:
    """March the same."""
    x = np.linspace(0.0, LENGTH, 41)
    points = {f"p{i}": shapes(at) for i, at in enumerate(x)} | {"middle": shapes(0.4 * LENGTH)}
    bridge, wheel, body = gb.from_modes(np.sqrt(SQUARES), 0.0, points), gb.mass(axle, name="wheel"), gb.mass(car or 1.0)
    road = gb.moving_point([bridge[f"p{i}"] for i in range(41)], x, SPEED, "road")
    contact = gb.Contact((wheel["at"], road), gb.HalfPlane(0.0), gb.KelvinVoigt(stiffness=tread), name="tread")
    bodies, joints = [bridge, wheel], []
    if car:
        bodies.append(body)
        joints = [gb.Joint((body["at"], wheel["at"]), SPRING, DAMPER)]
    loads = [gb.weight(one, GRAVITY, [1.0]) for one in bodies[1:]]
    scene = gb.Scene(*bodies, contacts=[contact], loads=loads, joints=joints)
    return gb.history(scene, h, 0.4, gb.seat(scene))


@pytest.mark.parametrize("car", [0.0, CAR])
def test_a_mass_and_a_car_cross_a_bridge(car: float) -> None:
    """About order 2 in the step against SciPy, and energy to round-off; the wheel lifts off late."""
    errors = []
    for h in (6e-4, 3e-4):
        found = marched(h, TREAD, AXLE, car)
        middle, wheel = crossed(TREAD, AXLE, car, found.t)
        at = found.displacement["wheel.at" if car else "at"]
        pairs = ((found.displacement["middle"], middle), (at, wheel))
        errors.append([np.abs(a - b).max() / np.abs(b).max() for a, b in pairs])
    assert np.max(errors[-1]) < 2e-3, errors
    assert np.min(np.log2(np.array(errors[0]) / errors[-1])) > 1.5, errors
    energy = found.last.energy
    started = (AXLE + car) ** 2 * GRAVITY**2 / (2.0 * TREAD)  # in the tread; what the spring had is not counted
    assert found.last.balance == pytest.approx(started, abs=1e-11 * energy["walls"])


def test_a_mass_that_stays_on_a_bridge() -> None:
    """On a stiff tread it moves with the beam, as the equations of a mass that never parts say: Fryba, ch. 8."""
    n, mass = len(MODES), 600.0

    def slopes(t: float, s: Array) -> Array:
        q, v, x = s[:n], s[n:], SPEED * t
        b, k = shapes(x), np.sqrt(2.0 / (LINE * LENGTH)) * MODES * np.cos(MODES * x)
        moved = GRAVITY - 2.0 * SPEED * k @ v + SPEED**2 * MODES**2 * b @ q
        return np.concatenate([v, np.linalg.solve(np.eye(n) + mass * np.outer(b, b), mass * b * moved - SQUARES * q)])

    found = marched(2e-4, 1e9, mass, 0.0)
    on = found.t < 0.6 * LENGTH / SPEED
    wanted = scipy.integrate.solve_ivp(slopes, (0.0, 0.4), np.zeros(2 * n), "DOP853", found.t[on], rtol=1e-10)
    middle = shapes(0.4 * LENGTH) @ wanted.y[:n]
    assert np.abs(found.displacement["middle"][on] - middle).max() < 1e-3 * np.abs(middle).max()


def crossing() -> Tables:
    """Return the tables of a wheel on a beam, and of a force that moves beside it."""
    model = {"type": "beam", "length": LENGTH, "thickness": 0.1,
             "material": {"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": 7850.0}}  # fmt: skip
    return {
        "structure": [{"name": "bridge", "model": model, "reduce": {"modes": 10}},
                      {"name": "wheel", "model": {"type": "mass", "mass": AXLE}}],
        "joint": [{"type": "pinned", "structure": "bridge", "at": at} for at in (0.0, LENGTH)],
        "point": [{"name": "middle", "structure": "bridge", "at": 0.4 * LENGTH},
                  {"name": "road", "structure": "bridge", "at": 0.0, "speed": SPEED}],
        "pair": [{"name": "tread", "between": ["wheel.at", "bridge.road"],
                  "region": {"type": "half-plane", "clearance": 0.0},
                  "law": {"type": "kelvin-voigt", "stiffness": TREAD}}],
        "load": [{"type": "constant_force", "name": "push", "point": "wheel.at", "amplitude": AXLE * GRAVITY}],
        "time": {"step": 4e-4, "end": 0.4},
        "start": {"state": "seat"},
    }  # fmt: skip


def test_files_have_points_that_move() -> None:
    """A wheel as from SciPy, within what shear and more modes change, and a force by the series."""
    tables = crossing()
    scene = gb.scene(tables)
    found = gb.history(scene, 4e-4, 0.4, gb.seat(scene))
    middle, _ = crossed(TREAD, AXLE, 0.0, found.t)
    assert np.abs(found.displacement["middle"] - middle).max() < 1e-2 * np.abs(middle).max()
    tables["pair"] = []
    tables["load"][0] |= {"point": "bridge.road", "amplitude": WHEEL, "direction": [-1.0]}
    pushed = gb.history(gb.scene(tables), 4e-4, 0.3)
    wanted = -series(pushed.t, 0.4 * LENGTH)
    assert np.abs(pushed.displacement["middle"] - wanted).max() < 1e-2 * np.abs(wanted).max()


def test_a_point_moves_along_a_frame() -> None:
    """A wheel over a straight frame as over the beam; behind its end nothing carries it."""
    tables, histories = crossing(), []
    tables["joint"] = [{"type": "clamped", "structure": "bridge", "at": at} for at in (0.0, LENGTH)]
    for model in ({}, {"type": "frame", "route": [[0, 0, 0], [0, LENGTH, 0]]}):
        if model:
            del tables["structure"][0]["model"]["length"]
            for point in tables["point"]:
                point["direction"] = [0, 0, 1]
        tables["structure"][0] |= {"reduce": {"modes": 60 if model else 20}}  # of a frame across, sideways and along
        tables["structure"][0]["model"] |= model
        histories.append(gb.history(gb.scene(tables), 4e-4, 0.4))
    for name in ("middle", "at"):
        one, two = (found.displacement[name] for found in histories)
        assert np.abs(one - two).max() < 1e-3 * np.abs(one).max()
    put("point", 1, "at", value=LENGTH)(tables, Path())
    check_refused(tables, "road", "30 m/s at 10 m of 10 m")


@pytest.mark.parametrize("kind", ["beam", "frame"])
def test_an_axle_that_starts_outside_comes_later(kind: str) -> None:
    """Two axles are the sum of one and the same one later, in either direction; what starts too early is refused."""
    step, late = 5e-4, 0.08

    def marched(*starts: float, speed: float = SPEED) -> Any:
        tables = crossing()
        tables["structure"], tables["pair"], tables["load"] = tables["structure"][:1], [], []
        tables["point"] = tables["point"][:1] + [
            {"name": f"road{i}", "structure": "bridge", "at": at, "speed": speed} for i, at in enumerate(starts)
        ]
        tables["load"] = [
            {"type": "constant_force", "name": f"axle{i}", "point": f"bridge.road{i}", "amplitude": -WHEEL}
            for i in range(len(starts))
        ]
        tables["start"] = {"state": "rest"}
        if kind == "frame":
            del tables["structure"][0]["model"]["length"]
            tables["structure"][0]["model"] |= {"type": "frame", "route": [[0, 0, 0], [0, LENGTH, 0]]}
            tables["structure"][0]["reduce"] = {"modes": 40}
            for point in tables["point"]:
                point["direction"] = [0, 0, 1]
        return gb.history(gb.scene(tables), step, 0.4).displacement["middle"].ravel()

    for speed, first, second in ((SPEED, 0.0, -SPEED * late), (-SPEED, LENGTH, LENGTH + SPEED * late)):
        alone, both = marched(first, speed=speed), marched(first, second, speed=speed)
        count = round(late / step)
        wanted = alone + np.r_[np.zeros(count), alone[:-count]]
        assert np.abs(both - wanted).max() < 1e-3 * np.abs(wanted).max()
    with pytest.raises(CaseError, match=r"no minus sign, or a speed above 0|along the axis from there"):
        marched(-1.0, speed=-SPEED)


@pytest.mark.parametrize("spans", [2, 7, 15])
def test_wheels_of_runways_of_any_length_follow_their_spans(spans: int) -> None:
    """A slow wheel at the middle of a span: the deflection of a beam on as many supports, by its own elements."""
    side, count = 3.0, 8
    tables = crossing()
    tables["structure"] = [tables["structure"][0] | {"reduce": {"modes": 12 * spans}, "ratio": 0.02}]
    tables["structure"][0]["model"] |= {"length": side * spans, "elements": count * spans}
    tables["joint"] = [{"type": "pinned", "structure": "bridge", "at": side * i} for i in range(spans + 1)]
    tables["point"] = [
        {"name": "road", "structure": "bridge", "at": 0.0, "speed": 0.5},
        {"name": "middle", "structure": "bridge", "at": 0.5 * side},
    ]
    tables["pair"], tables["start"] = [], {"state": "rest"}
    tables["load"] = [{"type": "constant_force", "name": "wheel", "point": "bridge.road", "amplitude": -1e4}]
    found = gb.history(gb.scene(tables), 5e-3, 0.5 * side / 0.5).displacement["middle"].ravel()[-1]
    length, n = side / count, count * spans
    bending, shear = STEEL.young_modulus * 1e-4 / 12.0, STEEL.young_modulus / 2.6 * 1e-2 * 5.0 / 6.0
    phi = 12.0 * bending / (shear * length**2)
    rows = np.array([[12, 6, -12, 6], [6, 4 + phi, -6, 2 - phi], [-12, -6, 12, -6], [6, 2 - phi, -6, 4 + phi]])
    scale = np.array([1.0, length, 1.0, length])
    K = np.zeros((2 * n + 2, 2 * n + 2))
    for i in range(n):
        part = slice(2 * i, 2 * i + 4)
        K[part, part] += bending / (length**3 * (1.0 + phi)) * rows * np.outer(scale, scale)
    free = np.setdiff1d(np.arange(2 * n + 2), [2 * count * i for i in range(spans + 1)])
    force = np.zeros(2 * n + 2)
    force[count] = -1e4
    moved = np.zeros(2 * n + 2)
    moved[free] = np.linalg.solve(K[np.ix_(free, free)], force[free])
    assert found == pytest.approx(moved[count], rel=0.02)


def test_fast_points_are_resolved_and_steps_beyond_them_said(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """A force that crosses in 0.7 ms leaves the impulse that it has in the first modes; a long step is said."""
    tables = crossing()
    speed = 500.0 * SPEED
    tables["structure"], tables["pair"], tables["start"] = tables["structure"][:1], [], {"state": "rest"}
    tables["point"][1]["speed"] = speed
    tables["load"] = [{"type": "constant_force", "name": "wheel", "point": "bridge.road", "amplitude": -WHEEL}]
    del tables["time"]["step"]
    found = gb.run(tables, output=tmp_path / "run")
    x, t = 0.4 * LENGTH, found.history.time.values
    wanted = np.zeros(len(t))
    mass, bending = STEEL.density * SECTION.area, STEEL.young_modulus * SECTION.second_moment
    for n in range(1, 11, 2):
        k = n * np.pi / LENGTH
        w = k * k * np.sqrt(bending / mass)
        wanted -= 2.0 * WHEEL / (mass * LENGTH) * 2.0 / (k * speed) / w * np.sin(w * t) * np.sin(k * x)
    assert np.ptp(found.history.displacement.values.ravel()) == pytest.approx(np.ptp(wanted), rel=0.05)
    with caplog.at_level(logging.WARNING, "gapbeam"):
        gb.scene(tables | {"time": {"end": 0.4, "step": 1e-4}})
    assert "steps in a period of the crossing of bridge by road" in caplog.text


ROAD = ("point", 1)
SLIPS: dict[str, tuple[Change, str, str]] = {
    "at its end": (put(*ROAD, "at", value=LENGTH), "road", "a speed along the axis from there"),
    "no speed": (put(*ROAD, "speed", value=0.0), "road.*speed", "where the point stays"),
    "along a mass": (put(*ROAD, value={"name": "road", "structure": "wheel", "speed": 1.0}), "road.*speed",
                     "model beam, rigid or frame"),
    "a spring to it": (put("joint", 1, value={"type": "elastic", "between": ["wheel.at", "bridge.road"],
                                              "stiffness": 1.0}), "joint", "which moves"),
    "noise": (put("load", 0, value={"type": "random", "name": "noise", "point": "bridge.road", "seed": 1,
                                    "spectrum": {"type": "white", "density": 1.0, "low": 1.0, "high": 50.0}}),
              "noise.*point", "which moves"),
}  # fmt: skip


@pytest.mark.parametrize("slip", SLIPS)
def test_slips_of_points_that_move_are_refused(slip: str, tmp_path: Path) -> None:
    """Status 2, at the key that is wrong, in words that name it."""
    given = crossing()
    check_slip(given, SLIPS[slip], tmp_path)


def test_what_takes_no_points_that_move_says_so(tmp_path: Path) -> None:
    """Forces, joints, masses, other schemes, and all that condenses a scene once."""
    scene = gb.scene(crossing())
    road, wheel = scene.contacts[0].between[1], scene.structures[1]
    refused = [
        lambda: gb.Force(road, 1.0),
        lambda: gb.Joint(road, 1.0),
        lambda: gb.Scene(wheel, road.structure, masses=[(road, 1.0)]),
        lambda: gb.history(scene, 1e-3, 0.1, scheme=gb.newmark()),
        lambda: gb.ensemble(scene, {"tread.stiffness": [1e6, 2e6]}, step=1e-3, end=0.1),
        lambda: gb.periodic(scene, 0.1, 100),
        lambda: gb.seat(scene, 0.1),
        lambda: gb.fmu(scene.with_parts(scene.contacts, []), tmp_path / "a.fmu", step=1e-3),
    ]
    for call in refused:
        with pytest.raises(gb.UserError, match="move"):
            call()


def on_moving_supports() -> Tables:
    """Return the tables of a mass on a spring and in a rough hole, whose sides on the frame move alike."""
    motion = {"type": "support_motion", "amplitude": 1e-3, "frequency": 7.0, "ramp": 0.1, "direction": [0.6, 0.8]}
    return {
        "structure": [{"name": "box", "model": {"type": "mass", "mass": 3.0, "motions": 2}}],
        "joint": [{"type": "elastic", "name": "spring", "between": ["box.at"], "stiffness": 4e4, "damping": 20.0}],
        "pair": [{"name": "hole", "between": ["box.at"], "region": {"type": "disc", "clearance": 3e-4},
                  "friction": 0.2, "law": {"type": "kelvin-voigt", "stiffness": 1e6}}],
        "load": [{**motion, "name": f"of-{one}", "support": one} for one in ("spring", "hole")],
        "time": {"step": 5e-5, "end": 0.4},
    }  # fmt: skip


def test_supports_that_move_alike_are_a_moving_frame() -> None:
    """Against the inertia m s'' in the frame of the supports, which is another sum of steps: of order 2."""
    far = []
    for h in (1e-4, 5e-5):
        found = gb.history(gb.scene(on_moving_supports()), h, 0.4)
        box, s = gb.mass(3.0, 2), Harmonic(1e-3, 7.0, 0.0, 0.1)
        hole = gb.Contact(box["at"], gb.Disc(3e-4), gb.KelvinVoigt(stiffness=1e6), friction=0.2, name="hole")
        inertia = gb.Force(box["at"], lambda t, s=s: -3.0 * s.value(t, derivative=2), [0.6, 0.8])
        still = gb.Scene(box, contacts=[hole], joints=[gb.Joint(box["at"], 4e4, 20.0)], loads=[inertia])
        own = gb.history(still, h, 0.4)
        relative = found.displacement["at"] - np.outer(s.value(found.t), [0.6, 0.8])
        far.append(np.abs(relative - own.displacement["at"]).max() / np.abs(relative).max())
        assert found.force["hole"].max() > 1.0
    assert far[1] < 0.35 * far[0] < 1e-4


MOVED = {
    "an unknown support": (put("load", 0, "support", value="sprung"), "of-spring.*support", "one of hole, spring"),
    "a clamp": (
        put("load", 0, "support", value="foot"),
        "of-spring.*support",
        "one clamp alone: give its .*joint.* a name",
    ),
    "no direction of it": (put("load", 1, "direction", value=[1.0]), "of-hole.*direction", "a number for each"),
    "no support": (put("load", 1, "support", value=None), "of-hole.*support", "missing"),
}


@pytest.mark.parametrize("slip", MOVED)
def test_slips_of_supports_that_move_are_refused(slip: str, tmp_path: Path) -> None:
    check_slip(on_moving_supports(), MOVED[slip], tmp_path)
