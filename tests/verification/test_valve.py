"""The shipped valve: its weight on the two ends of the guide, and its motion along the spring, by hand."""

from __future__ import annotations

from math import pi
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import gapbeam
from tests.shared.command import PROJECT

KEYS = (
    "mesh.support_size=0.015",
    "mesh.size=0.03",
    "mesh.cells_through_thickness=2",
    "model.shapes=4",
    "model.modes=8",
    "time.end=0.012",
    "time.step=2e-5",
    "output.errors=none",
)
GRAVITY = 9.80665  # m/s^2
STEM = 7900.0 * pi * 0.003**2 * 0.110  # kg
HEAD = 0.060  # kg
FROM, TO = 0.035, 0.080  # m


@pytest.fixture(scope="module")
def history(tmp_path_factory: pytest.TempPathFactory) -> object:
    """The first periods on a coarse mesh."""
    folder: Path = tmp_path_factory.mktemp("valve") / "run"
    assert gapbeam.run(PROJECT / "cases" / "valve.toml", KEYS, folder).exit_status == 0
    return gapbeam.open_results(folder).history


@pytest.mark.slow(minutes=0.2)
def test_the_valve_stands_on_the_ends_of_its_guide(history: object) -> None:
    """Head and stem tip over the end of the guide: that end carries more than the weight, the other presses down."""
    forces, resultants = history["contact_force"], history["contact_resultant"]  # type: ignore[index]
    weight = (STEM + HEAD) * GRAVITY
    assert resultants[0, 0].values == pytest.approx([0.0, weight], rel=0.01, abs=1e-3 * weight)
    down = GRAVITY * (HEAD * (0.110 - TO) + STEM * (0.055 - TO)) / (TO - FROM)
    assert float(forces[0, 0]) == pytest.approx(weight + 2.0 * down, rel=0.03)


@pytest.mark.slow(minutes=0.1)
def test_the_valve_moves_along_its_spring(history: object) -> None:
    """Without friction the axial motion is that of a mass on spring and damper, in the frame of the engine."""
    mass, omega = STEM + HEAD, 2.0 * pi * 60.0
    low, high = 2.0 * pi * 500.0, 2.0 * pi * 4000.0
    damping = 8.0 + 2.0 * 0.01 * low * high / (low + high) * STEM  # of the spring, and c_M of the stem
    axial = 60.0 * 0.05 / float(np.linalg.norm([0.05, 1.0, 0.3]))

    def rates(time: float, state: np.ndarray) -> list[float]:
        place, speed = state
        return [speed, -axial * np.sin(omega * time) - (damping * speed + (3.0e4 + 1.0) * place) / mass]

    time = history["time"].values  # type: ignore[index]
    wanted = solve_ivp(rates, (0.0, time[-1]), [0.0, 0.0], "DOP853", time, rtol=1e-10, atol=1e-14).y[0]
    found = history["displacement"].sel(probe="rocker_end", component="x").values  # type: ignore[index]
    assert np.ptp(wanted) > 8.0e-6
    assert np.abs(found - wanted).max() < 0.01 * np.ptp(wanted)
