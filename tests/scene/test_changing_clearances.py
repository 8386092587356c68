"""Clearances of pairs that change over time, against springs in closed form and a SciPy integration."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

import gapbeam as gb
from tests.scene.test_face_contacts import sled
from tests.shared.slips import Change, check_slip, put

Array = np.ndarray
SPRING, STOP, GAP, PRESSED = 4e4, 1e6, 2e-4, 3e-4
"""N/m, N/m, and m that the clearance is at the start and that it is pressed by at the end."""
CLOSURE = {"type": "clearance_change", "name": "closure", "support": "gap", "times": [0.0, 0.05, 0.1],
           "changes": [0.0, -1e-4, -GAP - PRESSED]}  # fmt: skip
LAW = {"type": "kelvin-voigt", "stiffness": STOP, "damping": 200.0}


def closing(region: dict[str, Any], motions: int = 1, **closure: Any) -> dict[str, Any]:
    """Return the tables of a damped mass on a spring, in a region that closes until it presses."""
    model = {"type": "mass", "mass": 2.0, "stiffness": SPRING, "damping": 300.0, "motions": motions}
    return {
        "structure": [{"name": "box", "model": model}],
        "pair": [{"name": "gap", "between": ["box.at"], "region": region, "law": LAW}],
        "load": [CLOSURE | closure],
        "time": {"step": 2e-4, "end": 0.5},
    }


ONE = {"type": "half-plane", "clearance": GAP}
ALONG = np.array([0.6, 0.8])
SQUARE = {"type": "polygon", "corners": [[-GAP, -GAP], [GAP, -GAP], [GAP, GAP], [-GAP, GAP]]}
SINKS = PRESSED * STOP / (STOP + SPRING)  # of the mass, where one face presses it against its spring
ENDS = [
    ("a stop", ONE, [-SINKS], {"gap": [SPRING * SINKS]}),
    ("a stop below", ONE | {"normal": -1}, [SINKS], {"gap": [-SPRING * SINKS]}),
    ("an oblique stop", ONE | {"normal": ALONG.tolist()}, -SINKS * ALONG, {"gap": SPRING * SINKS * ALONG}),
    ("a slot", {"type": "slot", "clearance": GAP}, [0.0], {"gap-0": [0.5 * STOP * PRESSED]}),
    ("a square", SQUARE, [0.0, 0.0], {"gap-1": [STOP * PRESSED, 0.0], "gap-0": [0.0, -STOP * PRESSED]}),
]


@pytest.mark.parametrize(("region", "place", "forces"), [one[1:] for one in ENDS], ids=[one[0] for one in ENDS])
def test_a_region_that_closes_presses_as_springs_in_a_row(region: Any, place: Any, forces: Any, tmp_path: Path) -> None:
    """A stop sinks a mass into its spring; faces on both sides press without moving it. The walls do the work."""
    tables = closing(region, len(place))
    outcome = gb.run(gb.scene(tables), step=2e-4, end=0.5, output=tmp_path / "run")
    assert outcome.exit_status == 0, outcome.message
    found = gb.history(gb.scene(tables), 2e-4, 0.5)
    assert found.displacement["at"][-1] == pytest.approx(place if len(place) > 1 else place[0], abs=1e-9)
    for name, force in forces.items():
        assert found.force[name][-1] == pytest.approx(-np.array(force if len(force) > 1 else force[0]), rel=1e-5)
    energy = found.last.energy
    assert energy["walls"] > 0.0
    assert energy["walls"] == pytest.approx(
        energy["strain"] + energy["contact"] + energy["law"] + energy["damping"], rel=1e-6
    )


def moved(t: Any, changes: Any = CLOSURE["changes"]) -> Any:
    """Return the change of the clearance and its rate."""
    times, changes = np.array(CLOSURE["times"]), np.array(changes)
    slopes = PchipInterpolator(times, changes).derivative()(times)
    slopes[[0, -1]] = 0.0
    curve = CubicHermiteSpline(times, changes, slopes)
    return curve(min(t, times[-1])), curve(t, 1) if t < times[-1] else 0.0


def test_a_stop_that_closes_moves_a_mass_as_an_integration_has_it() -> None:
    """The mass is met and driven back, with the damper of the law; the midpoint rule is of order 2."""

    def rates(t: float, y: Any) -> Any:
        x, speed = moved(t)
        deep, pace = y[0] - GAP - x, y[1] - speed
        force = max(STOP * deep + 200.0 * pace, 0.0) if deep > 0.0 else 0.0
        return [y[1], (-SPRING * y[0] - 300.0 * y[1] - force) / 2.0]

    exact = solve_ivp(rates, (0.0, 0.16), [0.0, 0.0], "DOP853", rtol=1e-10, atol=1e-14, max_step=1e-4).y[0, -1]
    far = []
    for h in (8e-4, 4e-4, 2e-4, 1e-4):
        found = gb.history(gb.scene(closing(ONE)), h, 0.16)
        far.append(abs(found.displacement["at"][-1] - exact))
    assert far[-1] < 1e-4 * abs(exact)
    assert np.polyfit(np.log([8.0, 4.0, 2.0, 1.0]), np.log(far), 1)[0] > 1.5


def test_a_pair_of_structures_and_a_pair_of_faces_close(tmp_path: Path) -> None:
    """Two masses on springs are pressed apart as three springs in a row; faces lift a block by what they close."""
    tables = closing(ONE)
    tables["structure"].append({"name": "other", "model": {"type": "mass", "mass": 1.0, "stiffness": 2.0 * SPRING,
                                                           "damping": 300.0}})  # fmt: skip
    tables["pair"][0]["between"] = ["box.at", "other.at"]
    found = gb.history(gb.scene(tables), 2e-4, 0.6)
    force = PRESSED / (1.0 / STOP + 1.0 / SPRING + 0.5 / SPRING)
    assert found.displacement["box.at"][-1] == pytest.approx(-force / SPRING, rel=1e-6)
    assert found.displacement["other.at"][-1] == pytest.approx(0.5 * force / SPRING, rel=1e-6)
    given = sled(tmp_path)
    given["load"] = [CLOSURE | {"support": "under", "times": [0.0, 0.01], "changes": [0.0, -1e-6]}, given["load"][0]]
    given["contact"] = {"law": {"type": "kelvin-voigt", "stiffness": 1e13, "damping": 1e9}}
    scene = gb.scene(given)
    lifted = gb.history(scene, 1e-5, 0.02)
    still = gb.history(gb.scene(given | {"load": given["load"][1:]}), 1e-5, 0.02)
    assert len(scene.contacts) > 4
    block = scene.structures[0]
    assert block.geometry is not None
    risen = (lifted.last.state.q - still.last.state.q)[: block.size, 0]
    u = block.geometry.displacements(risen if scene.is_large else block.modes[2] @ risen)
    assert u.mean(axis=0) == pytest.approx([0.0, 1e-6, 0.0], abs=1e-11)


SLIPS: dict[str, tuple[Change, str, str]] = {
    "an unknown pair": (put("load", 0, "support", value="gab"), "closure.*support", "one of gap"),
    "a disc": (put("pair", 0, "region", value={"type": "disc", "clearance": GAP}), "closure.*changes", "is a point"),
    "times that fall": (put("load", 0, "times", value=[0.0, 0.1, 0.05]), "closure.*times", "ascending"),
    "a jump at the start": (put("load", 0, "changes", value=[1e-4, 0.0, 0.0]), "closure.*changes", "0.0"),
    "a change too many": (put("load", 0, "changes", value=[0.0, 0.0]), "closure.*changes", "one change for each"),
    "a direction": (put("load", 0, "direction", value=[1.0]), "closure.*direction", "unknown"),
    "no pair": (put("load", 0, "support", value=None), "closure.*support", "missing"),
}


@pytest.mark.parametrize("slip", SLIPS)
def test_slips_of_clearances_that_change_are_refused(slip: str, tmp_path: Path) -> None:
    """Status 2, at the key that is wrong, in words that name it."""
    given = closing(ONE, 2 if slip == "a disc" else 1)
    check_slip(given, SLIPS[slip], tmp_path)


HOLE = {"type": "disc", "clearance": GAP}
CLOSED = [0.0, -1e-4, -0.9 * GAP]


def orbit(t: float) -> Array:
    """Return a force that drives a mass around a hole, (2,), N."""
    return np.array([6.0 + 4.0 * np.sin(60.0 * t), 3.0 + 4.0 * np.cos(43.0 * t)])


@pytest.mark.parametrize(("friction", "sliding"), [(0.0, 0.0), (0.2, 1e-4)])
def test_a_hole_that_closes_moves_a_mass_as_an_integration_has_it(friction: float, sliding: float) -> None:
    """A mass is driven around a hole that closes to a tenth: of order 2, with the work of the wall in the balance."""
    tables = closing(HOLE, 2, changes=CLOSED)
    tables["pair"][0] |= {"friction": friction, "sliding": sliding}
    alone = gb.scene(tables)
    forces = [gb.Force(alone.point("box.at"), lambda t, i=i: orbit(t)[i], np.eye(2)[i]) for i in (0, 1)]
    scene = gb.Scene(*alone.structures, contacts=alone.contacts, loads=forces)
    assert scene.contact_names == ("gap",)

    def rates(t: float, y: Any) -> Any:
        x, v, (by, pace) = y[:2], y[2:], moved(t, CLOSED)
        away = np.hypot(*x)
        n = x / (away + 1e-300)
        deep, slip = away - GAP - by, n[0] * v[1] - n[1] * v[0]
        force = max(STOP * deep + 200.0 * (n @ v - pace), 0.0) if deep > 0.0 else 0.0
        rub = friction * force * slip / np.hypot(slip, max(sliding, 1e-300))
        return [*v, *(orbit(t) - SPRING * x - 300.0 * v - force * n - rub * np.array([-n[1], n[0]])) / 2.0]

    times, far = np.linspace(0.0, 0.16, 201)[1:], []
    exact = solve_ivp(rates, (0.0, 0.16), np.zeros(4), "DOP853", rtol=1e-9, atol=1e-14, max_step=2e-4, t_eval=times)
    for h in (8e-4, 4e-4, 2e-4, 1e-4):
        found = gb.history(scene, h, 0.16)
        there = found.displacement["at"][round(8e-4 / h) - 1 :: round(8e-4 / h)]
        far.append(np.abs(there - exact.y[:2].T).max())
        assert abs(found.last.balance) < 1e-12 * found.last.energy["walls"]
        assert found.force["gap"].shape == (len(found.t), 2)
    assert found.last.energy["walls"] > 0.0
    assert far[-1] < 1e-3 * np.ptp(exact.y[0])
    assert np.polyfit(np.log([8.0, 4.0, 2.0, 1.0]), np.log(far), 1)[0] > 1.5


@gb.region
def oval(x: Any, y: Any, a: Any, b: Any) -> Any:
    """Return about the distance to an ellipse."""
    return np.sqrt((x / a) ** 2 + (y / b) ** 2) * a - a


REGIONS = {
    "a stop": (lambda by: gb.HalfPlane(GAP + by), 1),
    "an oblique stop": (lambda by: gb.HalfPlane(GAP + by, ALONG), 2),
    "a stop in space": (lambda by: gb.HalfPlane(GAP + by, [0.48, 0.64, 0.6]), 3),
    "a slot": (lambda by: gb.Slot(GAP + by, 1e-5), 1),
    "a hole": (lambda by: gb.Disc(GAP + by), 2),
    "a triangle": (lambda by: gb.Polygon((GAP + by) * np.array([[2.0, 0.0], [-1.0, 3**0.5], [-1.0, -(3**0.5)]])), 2),
}
SMOOTH: dict[str, float] = {}
STICKS, SLIDES = {"friction": 0.3}, {"friction": 0.3, "sliding": 1e-3}
ALPHA = gb.generalized_alpha(0.8)


@pytest.mark.parametrize(
    ("name", "scheme", "rough"),
    [
        *((name, gb.midpoint(), SMOOTH) for name in REGIONS),
        ("a hole", gb.midpoint(), STICKS),
        ("a hole", gb.midpoint(), SLIDES),
        ("a triangle", gb.midpoint(), SLIDES),
        ("a slot", ALPHA, SMOOTH),
        ("a hole", ALPHA, SMOOTH),
        ("a hole", ALPHA, STICKS),
        ("a triangle", gb.euler(), SMOOTH),
    ],
)
def test_an_opening_that_stays_is_a_region_of_that_clearance(name: str, scheme: Any, rough: dict[str, float]) -> None:
    """Motion, forces and energies are those of a region that was made with the other clearance."""
    made, motions = REGIONS[name]
    ball, law, by = gb.mass(1.0, motions, 100.0, 1.0, name="ball"), gb.KelvinVoigt(1e5, 5.0), -0.4 * GAP
    ways = np.eye(motions)
    loads = [
        gb.Force(ball["at"], lambda t, i=i: 8.0 * np.cos((40.0 + 9.0 * i) * t + i), ways[i]) for i in range(motions)
    ]
    scenes = [
        gb.Scene(ball, contacts=[gb.Contact(ball["at"], region, law, opening=opening, **rough)], loads=loads)
        for region, opening in ((made(by), None), (made(0.0), lambda t: by))  # noqa: ARG005
    ]
    one, other = (gb.history(scene, 1e-3, 0.3, scheme=scheme) for scene in scenes)
    assert np.abs(one.force[0]).max() > 0.1
    assert np.abs(one.displacement["at"] - other.displacement["at"]).max() < 1e-7 * np.abs(one.displacement["at"]).max()
    assert np.abs(one.force[0] - other.force[0]).max() < 1e-5 * np.abs(one.force[0]).max()
    for key, energy in one.last.energy.items():
        assert other.last.energy[key] == pytest.approx(energy, rel=1e-5, abs=1e-12)
    if not rough:
        push = gb.Force(ball["at"], 1.0, ways[0])
        still = [gb.seat(gb.Scene(ball, contacts=scene.contacts, loads=[push])) for scene in scenes]
        assert still[0].q == pytest.approx(still[1].q, rel=1e-9)


def test_a_slot_and_an_oval_open_as_their_faces_move() -> None:
    """A slot that opens is two stops with walls; work of the walls closes the balance of an oval, too."""
    ball, law = gb.mass(1.0, 1, 100.0, 1.0, name="ball"), gb.KelvinVoigt(1e5, 5.0)

    def by(t: float) -> float:
        return 0.5 * GAP * np.sin(30.0 * t)

    push = gb.Force(ball["at"], lambda t: 0.5 * np.cos(47.0 * t))
    slot = gb.Contact(ball["at"], gb.Slot(GAP), law, opening=by)
    stops = [gb.Contact(ball["at"], gb.HalfPlane(0.5 * GAP, side), law, wall=lambda t, side=side: 0.5 * side * by(t))
             for side in (1, -1)]  # fmt: skip
    one, two = (gb.history(gb.Scene(ball, contacts=some, loads=[push]), 1e-3, 1.0) for some in ([slot], stops))
    assert np.abs(one.displacement["at"] - two.displacement["at"]).max() < 1e-7 * np.abs(one.displacement["at"]).max()
    assert one.last.energy["walls"] == pytest.approx(two.last.energy["walls"], rel=1e-7)
    round_ball = gb.mass(1.0, 2, 100.0, 1.0)
    hole = gb.Contact(round_ball["at"], oval(GAP, 2.0 * GAP), law, friction=0.2, opening=by)
    loads = [
        gb.Force(round_ball["at"], lambda t, i=i: 0.5 * np.cos((40.0 + 9.0 * i) * t + i), np.eye(2)[i]) for i in (0, 1)
    ]
    last = gb.history(gb.Scene(round_ball, contacts=[hole], loads=loads), 1e-3, 1.0).last
    assert last.energy["friction"] > 0.0
    assert abs(last.energy["walls"]) > 1e-6
    assert abs(last.balance) < 1e-9 * last.energy["loads"]


@pytest.mark.parametrize("region", [gb.Slot(2e-2), gb.Disc(1e-2)], ids=["slot", "hole"])
def test_a_wall_that_closes_strikes_with_its_speed(region: Any) -> None:
    """Newton's law of impact relative to the wall: a ball of speed v leaves with u - e (v - u)."""
    motions, pace, speed, e = region.motions, -0.2 / region.share, 0.7, 0.4
    ball = gb.mass(1.0, motions, name="ball")
    touch = gb.Contact(ball["at"], region, gb.Unilateral(e), opening=lambda t: pace * t, name="touch")
    scene = gb.Scene(ball, contacts=[touch])
    start = scene.state(velocity={ball: np.append(speed, np.zeros(motions - 1))})
    left = None
    for step in gb.march(scene, 1e-4, 0.015, start):
        left = float(np.ravel(step["at"].velocity)[0])
    assert left == pytest.approx(-0.2 - e * (speed + 0.2), rel=1e-9)


def test_a_hole_that_closes_is_run_reported_and_refused_by_name(tmp_path: Path) -> None:
    """Penetration and force are those of the closed hole; what cannot march it says so."""
    tables = closing(HOLE, 2, changes=CLOSED)
    tables["load"].append({"type": "constant_force", "name": "push", "point": "box.at", "amplitude": 20.0})
    outcome = gb.run(tables, output=tmp_path / "run")
    assert outcome.exit_status == 0, outcome.message
    deep = (20.0 - SPRING * 0.1 * GAP) / (STOP + SPRING)
    last = outcome.history.isel(time=-1)
    assert float(last.penetration[0]) == pytest.approx(deep, rel=1e-6)
    assert float(last.contact_force[0]) == pytest.approx(STOP * deep, rel=1e-6)
    assert "moving walls" in outcome.history["load"].values
    scene = gb.scene(tables)
    with pytest.raises(gb.UserError, match=r"gap.*Disc.*clearance changes"):
        gb.ensemble(scene, {"push.value": np.array([1.0, 2.0])}, step=2e-4, end=0.1)
    ball = gb.mass(1.0, 2)
    closed = gb.Contact(ball["at"], gb.Disc(GAP), gb.KelvinVoigt(1e5), opening=lambda t: -t, name="gap")
    with pytest.raises(gb.UserError, match=r"gap.*closes by"):
        gb.history(gb.Scene(ball, contacts=[closed]), 1e-3, 0.1)
