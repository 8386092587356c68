"""Friction of points in space: against the slip, at most mu N, by laws of Coulomb and closed forms."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import gapbeam as gb
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
