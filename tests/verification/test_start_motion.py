"""Runs that start with a rigid motion: free flight, energy and falls by hand."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gapbeam
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.system.semi_discrete import State
from tests.shared.case_texts import assert_says
from tests.shared.command import called

LENGTH, THICKNESS, WIDTH, DENSITY, GRAVITY = 0.5, 0.01, 0.02, 7850.0, 9.81
MASS = DENSITY * LENGTH * THICKNESS * WIDTH
INERTIA = MASS * (LENGTH**2 + THICKNESS**2) / 12.0
MODELS: dict[str, dict[str, Any]] = {
    "beam": {"type": "beam", "elements": 24},
    "reduced": {"type": "reduced"},
    "rigid": {"type": "rigid"},
    "full": {"type": "full"},
}
MOTION = {"lift": 1.0e-4, "tilt": 2.0e-4, "velocity": 0.02, "spin": -0.05}


def tables(model: str, motion: dict[str, float], **more: Any) -> dict[str, Any]:
    """Return a steel beam in a slot in its middle, without weight."""
    return {
        "beam": {"length": LENGTH, "thickness": THICKNESS, "width": WIDTH},
        "material": {"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": DENSITY},
        "support": [{"name": "slot", "from": 0.24, "to": 0.26, "clearance": 2.0e-3}],
        "mesh": {"size": 0.02, "support_size": 5.0e-3, "cells_through_thickness": 2},
        "model": MODELS[model],
        "probe": [{"name": "end", "point": 0.0}, {"name": "tip", "point": LENGTH}],
        "load": [],
        "analysis": {"type": "transient", "start": "undeformed", "motion": motion},
        "time": {"end": 5.0e-3, "step": 1.0e-4},
        **more,
    }


def heights(simulation: Simulation, state: State, part: str = "u") -> np.ndarray:
    """Return the displacement or velocity of both ends along the bending direction."""
    operators = simulation.model.system.operators
    return np.array([row.evaluate(getattr(state, part)[0], operators)[-1] for row in simulation.model.probes.values()])


@pytest.mark.parametrize("model", MODELS)
def test_free_flight_keeps_its_velocity_and_energy(model: str) -> None:
    """Without loads and contact a body moves on; its energy is m v^2 / 2 + J w^2 / 2."""
    simulation = gapbeam.model(gapbeam.read_case(tables(model, MOTION)))
    start = simulation.start(simulation.seat_or_failure())
    arms = np.array([-0.5, 0.5]) * LENGTH
    lifts, speeds = (MOTION[a] + arms * MOTION[b] for a, b in (("lift", "tilt"), ("velocity", "spin")))
    np.testing.assert_allclose(heights(simulation, start), lifts, rtol=1e-9)
    np.testing.assert_allclose(heights(simulation, start, "v"), speeds, rtol=1e-9)
    energy = 0.5 * float(start.v[0] @ start.v[1])
    assert energy == pytest.approx(0.5 * MASS * MOTION["velocity"] ** 2 + 0.5 * INERTIA * MOTION["spin"] ** 2, rel=1e-9)
    *_, last = simulation.march(start)
    moved = lifts + speeds * last.new.time
    np.testing.assert_allclose(heights(simulation, last.new), moved, rtol=1e-5)  # the restraint holds a little


def test_a_beam_falls_on_its_base(tmp_path: Path) -> None:
    """Lifted by h, a rigid beam touches the base after sqrt(2 h / g), with the speed sqrt(2 g h)."""
    lift = 4.0e-4
    case = tables("rigid", {"lift": lift}, time={"end": 0.02, "step": 1.0e-5})
    case |= {"support": {"length": 0.4, "clearance": 1.0e-3}, "load": [{"type": "gravity", "acceleration": GRAVITY}]}
    assert gapbeam.run(case, output=tmp_path / "run").exit_status == 0
    history = gapbeam.open_results(tmp_path / "run").history
    force = history["contact_force"].sel(face="base").values
    touch = float(history["time"].values[np.argmax(force > 0.0)])
    assert touch == pytest.approx(np.sqrt(2.0 * lift / GRAVITY), abs=3e-5)
    fastest = float(history["velocity"].sel(probe="tip", component="y").values[: np.argmax(force > 0.0)].min())
    assert fastest == pytest.approx(-np.sqrt(2.0 * GRAVITY * lift), rel=3e-3)


def test_a_beam_turns_about_its_pin() -> None:
    """A rotation about a pinned joint is allowed, and the pin stays where it is."""
    joint = [{"name": "pin", "type": "pinned", "point": 0.1}]
    case = gapbeam.read_case(tables("beam", {"spin": 0.1, "point": 0.1}, joint=joint))
    simulation = gapbeam.model(case)
    start = simulation.start(simulation.seat_or_failure())
    np.testing.assert_allclose(heights(simulation, start, "v"), [-0.01, 0.04], rtol=1e-6)


BAD = {
    "moves a pin": (
        {"velocity": 0.1},
        [{"name": "pin", "type": "pinned", "point": 0.1}],
        ["moves the section", "pin holds"],
    ),
    "turns a clamp": (
        {"spin": 0.1, "point": 0.0},
        [{"name": "root", "type": "clamped", "point": 0.0}],
        ["rotates the section at x = 0 m", "root holds"],
    ),
}


@pytest.mark.parametrize(("motion", "joint", "words"), BAD.values(), ids=list(BAD))
def test_motions_that_joints_do_not_allow(motion: dict[str, float], joint: list[Any], words: list[str]) -> None:
    """They are refused before anything runs."""
    with pytest.raises(gapbeam.CaseError) as caught:
        gapbeam.read_case(tables("beam", motion, joint=joint))
    assert_says(str(caught.value), words)


def test_a_start_within_a_face_is_refused(tmp_path: Path) -> None:
    """A lift through the upper plane: status 2, with the face and the depth, and no march."""
    path = tmp_path / "case.toml"
    path.write_text(
        'beam = { length = 0.5, thickness = 0.01, width = 0.02 }\ntime = { end = 1e-3, step = 1e-4 }\nmodel = "rigid"\n'
        "material = { young_modulus = 2.1e11, poisson_ratio = 0.3, density = 7850.0 }\n"
        "support = { length = 0.05, clearance = 1e-3 }\n"
        'analysis = { type = "transient", motion = { lift = 3e-3 } }\nload = [{ type = "gravity" }]\n',
        encoding="utf-8",
    )
    done = called("run", path, "--output", tmp_path / "run")
    assert done.returncode == 2, done.stderr
    assert_says(done.stderr, ["into gland", "expected a start between the faces"])
