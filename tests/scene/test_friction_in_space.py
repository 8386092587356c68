"""Friction of points in space: against the slip, at most mu N, by laws of Coulomb and closed forms."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import gapbeam as gb
from gapbeam.solver.scene import structure
from gapbeam.solver.scene.marcher import Marcher
from gapbeam.solver.system.operators import Array

MASS, MU, STIFF, GRAVITY = 2.0, 0.3, 1e6, 9.81
TURN = Rotation.from_euler("xyz", [0.4, 0.7, -1.1]).as_matrix()


def block(turn: Array, sliding: float, *loads: Array) -> tuple[gb.Scene, gb.Structure]:
    """Return a mass above a plane across the third of three directions, and forces along them."""
    one = gb.mass(MASS, motions=3, name="block")
    plane = gb.Contact(one["at"], gb.HalfPlane(0.0, normal=-turn[:, 2]), gb.KelvinVoigt(stiffness=STIFF), friction=MU,
                       sliding=sliding, name="plane")  # fmt: skip
    forces = [gb.Force(one["at"], 1.0, direction=turn @ f) for f in loads]
    return gb.Scene(one, contacts=[plane], loads=forces), one


@pytest.mark.parametrize("sliding", [1e-6, 0.0])
def test_a_slide_stops_after_its_distance_in_its_direction(sliding: float) -> None:
    """v^2 / (2 mu g) along v, on a plane of any slope; friction takes m v^2 / 2."""
    for turn in (np.eye(3), TURN):
        scene, one = block(turn, sliding, [0.0, 0.0, -MASS * GRAVITY])
        start = scene.state({one: turn @ [0.0, 0.0, -MASS * GRAVITY / STIFF]}, {one: turn @ [0.8, 0.6, 0.0]})
        *_, step = gb.march(scene, 1e-3, 0.6, start, every=100)
        place = turn.T @ step["at"].displacement
        assert place[:2] == pytest.approx(np.array([0.8, 0.6]) / (2 * MU * GRAVITY), rel=1e-4)
        assert step.energy["friction"] == pytest.approx(0.5 * MASS, rel=1e-5)


@pytest.mark.parametrize("sliding", [1e-6, 0.0])
@pytest.mark.parametrize("pull", [0.5, 1.5])
def test_a_slide_that_is_pulled_aside_bends_and_sticks(pull: float, sliding: float) -> None:
    """M v' = f - mu m g v / |v| by SciPy; pulled by half of what friction holds, the block stays where it stops."""
    limit, v0 = MU * MASS * GRAVITY, 1.0
    scene, one = block(TURN, sliding, [0.0, 0.0, -MASS * GRAVITY], [0.0, pull * limit, 0.0])

    def slid(_: float, x: Array) -> Array:
        speed = np.hypot(x[2], x[3])
        return np.array([x[2], x[3], *(np.array([0.0, pull]) - x[2:] / speed) * limit / MASS])

    stops = None if pull > 1.0 else lambda _, x: np.hypot(x[2], x[3]) - 1e-6
    if stops is not None:
        stops.terminal = True  # type: ignore[attr-defined]
    wanted = solve_ivp(slid, (0.0, 0.6), [0.0, 0.0, v0, 0.0], rtol=1e-10, atol=1e-13, events=stops).y[:2, -1]
    start = scene.state({one: TURN @ [0.0, 0.0, -MASS * GRAVITY / STIFF]}, {one: TURN @ [v0, 0.0, 0.0]})
    found = gb.history(scene, 2e-4, 0.6, start)
    assert (TURN.T @ found.displacement["at"][-1])[:2] == pytest.approx(wanted, abs=1e-5)
    if pull < 1.0:  # the midpoint rule rings, undamped
        force = TURN.T @ found.force["plane"][-100:].mean(axis=0)
        assert force == pytest.approx([0.0, -pull * limit, MASS * GRAVITY], abs=1e-2)


@pytest.mark.parametrize("aside", [0.3, 2.0])
def test_an_oblique_throw_rebounds_by_walton(aside: float) -> None:
    """The tangential impulse is mu times the normal one, or what stops the slip; its direction stays."""
    scene, one = block(TURN, 0.0)
    along, down = np.array([0.6, -0.8, 0.0]), 1.0
    start = scene.state({one: TURN @ [0.0, 0.0, 1e-4]}, {one: TURN @ (aside * along - [0.0, 0.0, down])})
    *_, step = gb.march(scene, 1e-6, 6e-3, start, every=100)
    kept = max(aside - 2 * MU * down, 0.0)
    assert TURN.T @ step["at"].velocity == pytest.approx([*(kept * along)[:2], down], abs=1e-3)
    before = 0.5 * MASS * (aside**2 + down**2)
    assert step.balance == pytest.approx(before, rel=1e-11)
    assert step.energy["friction"] == pytest.approx(0.5 * MASS * (aside**2 - kept**2), rel=1e-3)


@pytest.mark.parametrize("sliding", [1e-3, 0.0])
def test_in_a_plane_it_is_the_contact_of_two_motions(sliding: float) -> None:
    found, scheme = [], gb.generalized_alpha(0.8)
    for d, normal in ((2, [-1.0, 0.0]), (3, [-1.0, 0.0, 0.0])):
        one = gb.mass(MASS, motions=d, stiffness=1e3, damping=3.0)
        law = gb.HuntCrossley(stiffness=1e8, chi=0.2)
        wall = gb.Contact(one["at"], gb.HalfPlane(1e-4, normal), law, friction=MU, sliding=sliding)
        shaken = gb.Force(one["at"], lambda t: 20.0 * np.sin(60.0 * t) - 5.0, direction=[0.8, 0.6, 0.0][:d])
        scene = gb.Scene(one, contacts=[wall], loads=[shaken])
        *_, step = gb.march(scene, 1e-4, 0.3, scheme=scheme, every=100)
        found.append([*step["at"].displacement[:2], step.energy["friction"], step.energy["law"]])
    assert found[1] == pytest.approx(found[0], rel=1e-7)
    assert found[0][2] > 0.0


@pytest.mark.slow(minutes=0.1)
def test_a_mass_that_is_thrown_in_a_file(tmp_path: Path) -> None:
    """It slides a part of the way; the record of friction is mu times the force, the work of sliding its loss."""
    tables = {
        "structure": [{"name": "puck", "model": {"type": "mass", "mass": MASS, "motions": 3},
                       "place": {"origin": [0.0, 0.0, 0.0]}, "velocity": [0.8, 0.6, 0.0]}],
        "pair": [{"name": "table", "between": ["puck.at"], "friction": MU,
                  "region": {"type": "half-plane", "clearance": 0.0, "normal": [-1.0, 0.0, 0.0]},
                  "law": {"type": "kelvin-voigt", "stiffness": 1e6, "damping": 2e3}}],
        "load": [{"type": "gravity", "structure": "puck", "direction": [0.0, 0.0, -1.0]},
                 {"type": "step_force", "name": "push", "point": "puck.at", "amplitude": 1e-9,
                  "direction": [0.0, 0.6, 0.8]}],
        "time": {"step": 2e-4, "end": 0.2},
    }  # fmt: skip
    run = gb.run(tables, output=tmp_path / "out")
    assert run.exit_status == 0, run.message
    force, friction = (run.history[name].to_numpy().ravel() for name in ("contact_force", "friction_force"))
    assert friction[5:] == pytest.approx(MU * force[5:], rel=1e-9)
    lost = 0.5 * MASS * (1.0 - (1.0 - MU * GRAVITY * 0.2) ** 2)
    assert run.summary["wear"]["faces"]["table"]["work"] * MU == pytest.approx(lost, rel=1e-2)


@pytest.mark.parametrize("stiff", [1e6, 1e8, 1e11])
@pytest.mark.parametrize("count", [1, 5])
@pytest.mark.parametrize("d", [2, 3])
def test_masses_between_two_faces_stick_up_to_twice_mu_n(d: int, count: int, stiff: float) -> None:
    """M x'' = T - 2 mu N sign x' for the rigid whole of pinched masses on a rod; a step takes a few passes.

    Two contacts of a point share its motion, so that their friction is known to its sum alone.
    """
    turn, pressed, steps, h = TURN[:, :d] if d == 3 else np.eye(2), 1e-5, 400, 1e-4
    bodies = [gb.mass(MASS, motions=d, name=f"m{i}") for i in range(count)]
    held = 2 * MU * stiff * pressed
    faces = [
        gb.Contact(one["at"], gb.HalfPlane(-pressed, normal=side * turn[:d, -1]), gb.KelvinVoigt(stiffness=stiff),
                   friction=MU, name=f"{one.name}{side}")
        for one in bodies for side in (-1.0, 1.0)
    ]  # fmt: skip
    rods = [gb.Joint((one["at"], other["at"]), stiffness=stiff, name=f"rod {one.name}")
            for one, other in pairwise(bodies)]  # fmt: skip
    for pull in (0.9, 1.5):
        pulls = [gb.Force(one["at"], pull * held, direction=turn[:d, 0]) for one in bodies]
        marcher = Marcher(gb.Scene(*bodies, contacts=faces, joints=rods, loads=pulls), h)
        marcher.advance(steps)
        assert marcher.passes <= 8 * steps
        ways = marcher.q.reshape(count, d) @ turn[:d, 0] / np.sqrt(MASS)
        moved = max(pull - 1.0, 0.0) * held / MASS * (steps * h) ** 2 / 2
        assert ways == pytest.approx(np.full(count, moved), rel=1e-9, abs=1e-12 * held / MASS * (steps * h) ** 2)


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("away", [0.0, 1.0])
def test_a_block_that_slid_far_sticks_in_fine_steps(away: float, d: int) -> None:
    """M x'' = T - mu N: at 1 m and 1e-6 s, round-off of the place was 44 N by the stiffness of sticking, mu N 6 N."""
    along, up, steps, h = np.eye(d)[0], np.eye(d)[-1], 2000, 1e-6
    one = gb.mass(MASS, motions=d)
    plane = gb.Contact(one["at"], gb.HalfPlane(0.0, normal=-up), gb.KelvinVoigt(stiffness=STIFF), friction=MU)
    for pull in (0.99, 1.01):
        loads = [gb.Force(one["at"], MASS * GRAVITY, -up), gb.Force(one["at"], pull * MU * MASS * GRAVITY, along)]
        scene = gb.Scene(one, contacts=[plane], loads=loads)
        start = scene.state({one: away * along - MASS * GRAVITY / STIFF * up})
        marcher = Marcher(scene, h, start)
        marcher.advance(steps)
        assert marcher.passes <= 6 * steps
        moved = max(pull - 1.0, 0.0) * MU * GRAVITY * (steps * h) ** 2 / 2
        assert (marcher.q - start.q)[0, 0] / np.sqrt(MASS) == pytest.approx(moved, rel=1e-4, abs=1e-12 * away + 1e-20)


def test_a_pin_that_starts_in_the_center_of_a_tight_bore_moves_as_without_friction() -> None:
    """It has no direction to slip in: x = F / k (1 - cos w t) along the force."""
    one, force = gb.mass(MASS, motions=2), np.array([3.0, -4.0])
    for sliding in (0.0, 1e-3):
        bore = gb.Contact(one["at"], gb.Disc(0.0), gb.KelvinVoigt(stiffness=1e4), friction=MU, sliding=sliding)
        found = gb.history(gb.Scene(one, contacts=[bore], loads=[gb.Force(one["at"], 1.0, direction=force)]), 1e-4, 0.1)
        wanted = np.outer(1.0 - np.cos(np.sqrt(1e4 / MASS) * found.t), force / 1e4)
        assert np.abs(found.displacement["at"] - wanted).max() < 1e-5 * 1e-3


@pytest.mark.parametrize("shape", ["table", "groove", "clamp"])
@pytest.mark.parametrize(("large", "sliding"), [(False, 0.0), (False, 1e-6), (True, 0.0)])
def test_a_seat_holds_by_friction_what_pulls_along_a_bar_up_to_its_limit(
    shape: str, large: bool, sliding: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a bar on a table mu W, in a groove of 90 degrees mu W / cos 45, in a clamp 2 mu k x; it stays in a march."""
    if large:
        monkeypatch.setattr(structure, "LARGE", 3)
    steel, mass, stiff, pressed = gb.material(2.1e11, 7850.0), 7850.0 * 1.0 * 1e-4, 1e7, 1e-5
    places = {"a": (0.1, np.eye(3)), "b": (0.7, np.eye(3)), "end": (1.0, np.eye(3))}
    bar = gb.frame([[0, 0, 0], [1, 0, 0]], gb.space_section("rectangle", 0.01), steel, places, elements=6, name="bar")
    normals = {"table": [[0, 0, -1]], "groove": [[0, 1, -1], [0, -1, -1]], "clamp": [[0, 0, -1], [0, 0, 1]]}[shape]
    limit = MU * {"table": mass * GRAVITY, "groove": mass * GRAVITY * np.sqrt(2.0), "clamp": 4 * stiff * pressed}[shape]
    clear = -pressed if shape == "clamp" else 0.0
    faces = [
        gb.Contact(bar[at], gb.HalfPlane(clear, normal=n), gb.KelvinVoigt(stiffness=stiff), friction=MU,
                   sliding=sliding, name=f"{at}{k}")
        for at in ("a", "b") for k, n in enumerate(normals)
    ]  # fmt: skip
    down = [] if shape == "clamp" else [gb.weight(bar, GRAVITY, direction=[0.0, 0.0, -1.0])]
    for pull in (0.3, 0.98, 1.02):
        scene = gb.Scene(bar, contacts=faces, loads=[*down, gb.Force(bar["end"], pull * limit, direction=[1.0, 0, 0])])
        if pull > 1.0:
            with pytest.raises(gb.NoSeat, match="of bar that contacts do not hold, nor does their friction") as refused:
                gb.seat(scene)
            assert refused.value.escape.power > 0.0
            continue
        rest = gb.seat(scene)
        forces = rest.F.reshape(-1, 3)
        assert forces.sum(axis=0) == pytest.approx([-pull * limit, 0.0, len(down) * mass * GRAVITY], abs=1e-6 * limit)
        found = gb.history(scene, 1e-4, 0.05, rest)
        creep = sliding * 0.05 / np.sqrt(pull**-2 - 1.0) if sliding else 0.0
        assert np.ptp(found.displacement["end"][:, 0]) == pytest.approx(creep, rel=0.3, abs=1e-6 * limit / stiff)


@pytest.mark.parametrize("kind", ["frame", "matrices"])
def test_points_of_files_rub_in_three_directions(kind: str, tmp_path: Path) -> None:
    """A bar on two rests, on a plane of any slope, pulled along it: x = (T / m - mu g) t^2 / 2 as a whole."""
    steel = {"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": 8000.0}
    model: dict[str, object] = {"type": "frame", "route": [[0.0, 0.0, 0.0], TURN[:, 0].tolist()], "thickness": 0.01,
                                "section": {"type": "rectangle"}, "material": steel, "elements": 4}  # fmt: skip
    points: list[dict[str, object]] = [{"name": name, "structure": "bar", "at": at, "direction": TURN.T.tolist()}
                                       for name, at in (("a", 0.2), ("b", 0.8))]  # fmt: skip
    if kind == "matrices":
        (tmp_path / "bar.dof").write_text("".join(f"{node}.{way}\n" for node in (1, 2) for way in (1, 2, 3)))
        np.save(tmp_path / "M.npy", 0.4 * np.eye(6))
        np.save(tmp_path / "K.npy", 1e9 * np.kron([[1.0, -1.0], [-1.0, 1.0]], np.eye(3)))
        model = {"type": "matrices", "units": "m-kg-s", **{
            key: str(tmp_path / name) for key, name in (("mass", "M.npy"), ("stiffness", "K.npy"), ("dofs", "bar.dof"))
        }}  # fmt: skip
        points = [{"name": name, "structure": "bar", "node": node, "direction": TURN.T.tolist()}
                  for node, name in ((1, "a"), (2, "b"))]  # fmt: skip
    down, mass, pull = (-TURN[:, 2]).tolist(), 0.8, 2.0 * MU * 0.8 * GRAVITY
    weight = {"type": "gravity", "direction": down} if kind == "frame" else None
    loads = [weight] if weight else [
        {"type": "constant_force", "name": f"w-{at}", "point": f"bar.{at}", "amplitude": 0.4 * GRAVITY,
         "direction": [0.0, 0.0, -1.0]} for at in "ab"
    ]  # fmt: skip
    tables = {
        "structure": [{"name": "bar", "model": model}], "point": points,
        "contact": {"friction": MU, "law": {"type": "kelvin-voigt", "stiffness": 1e6, "damping": 100.0}},
        "pair": [{"name": at, "between": [f"bar.{at}"],
                  "region": {"type": "half-plane", "clearance": 0.0, "normal": [0.0, 0.0, -1.0]}} for at in "ab"],
        "load": [*loads, {"type": "step_force", "name": "pull", "point": "bar.b", "amplitude": pull, "start": 1e-5,
                          "direction": [1.0, 0.0, 0.0]}],
        "time": {"end": 0.05, "step": 1e-5}, "start": {"state": "seat"},
    }  # fmt: skip
    scene = gb.scene(tables)
    found = gb.history(scene, 1e-5, 0.05, gb.seat(scene))
    ways = np.mean([found.displacement[at][-1, 0] for at in "ab"])
    assert ways == pytest.approx((pull / mass - MU * GRAVITY) * 0.05**2 / 2, rel=2e-3)


@pytest.mark.parametrize(("region", "motions", "words"), [
    ({"type": "disc", "clearance": 1e-4}, 3, '2 directions of the points, or a "half-plane" with a normal of 3'),
    ({"type": "half-plane", "clearance": 0.0, "normal": [0.0, 1.0]}, 3, '"half-plane" with a normal of 3 numbers'),
    ({"type": "slot", "clearance": 1e-4}, 2, '1 direction of the points, or a "disc", a "polygon", or a "half-plane"'),
])  # fmt: skip
def test_regions_of_other_motions_are_refused_with_those_that_fit(
    region: dict[str, object], motions: int, words: str
) -> None:
    body = {"name": "pin", "model": {"type": "mass", "mass": 1.0, "motions": motions}}
    if motions == 3:
        body["place"] = {"origin": [0.0, 0.0, 0.0]}
    law = {"type": "kelvin-voigt", "stiffness": 1e6}
    push = {"type": "constant_force", "name": "push", "point": "pin.at", "amplitude": 1.0, "direction": [1.0]}
    tables = {"structure": [body], "pair": [{"name": "gap", "between": ["pin.at"], "region": region, "law": law}],
              "load": [push], "time": {"end": 0.1}}  # fmt: skip
    with pytest.raises(gb.CaseError) as refused:
        gb.scene(tables)
    assert words in str(refused.value)
    assert f"[1.0] at a point of {motions} motions" in str(refused.value)


@pytest.mark.parametrize("ramp", [0.0, 1e-2])
def test_a_step_is_no_part_of_the_seat(ramp: float, tmp_path: Path) -> None:
    """A mass at rest under a constant force F on its spring and its stop: a step of F at t = 0 moves it from there."""
    k, stiff, force = 1e3, 1e5, 4.0
    push = {"point": "block.at", "amplitude": force}
    tables = {
        "structure": [{"name": "block", "model": {"type": "mass", "mass": 1.0, "stiffness": k}}],
        "pair": [{"name": "stop", "between": ["block.at"], "region": {"type": "half-plane", "clearance": 0.0},
                  "law": {"type": "kelvin-voigt", "stiffness": stiff}}],
        "load": [{"type": "constant_force", "name": "rest", **push},
                 {"type": "step_force", "name": "jump", "ramp": ramp, **push}],
        "time": {"step": 1e-5, "end": 0.02}, "start": {"state": "seat"},
    }  # fmt: skip
    run = gb.run(tables, output=tmp_path / "out")
    assert run.exit_status == 0, run.message
    x, w = run.history["displacement"].to_numpy().ravel(), np.sqrt(k + stiff)
    assert x[0] == pytest.approx(force / (k + stiff), rel=1e-9)
    if ramp == 0.0:
        wanted = force / (k + stiff) * (2.0 - np.cos(w * run.history["time"].to_numpy()))
        assert np.abs(x - wanted).max() < 1e-4 * force / (k + stiff)
