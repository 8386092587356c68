"""The motion from the line that follows supports: against the run in the frame of the base, and a slow motion."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import gapbeam
from gapbeam.solver.diagnostics.history_rows import support_line
from gapbeam.solver.supports.support import Array
from tests.verification.test_moving_supports import LENGTH, WEIGHT, motion, recorded, tables


def history_of(folder: Path, loads: list[dict[str, Any]], **more: Any) -> xr.Dataset:
    """Run a case with probes in the middle and at the end of the beam; return its history."""
    probes = [{"name": "middle", "point": 0.5 * LENGTH}, {"name": "end", "point": LENGTH}]
    case = tables(loads, **{"probe": probes, "output": {"errors": "none"}, **more})
    assert gapbeam.run(case, (), folder).exit_status == 0
    return gapbeam.open_results(folder).history


@pytest.mark.slow(minutes=0.1)
def test_supports_that_move_alike_are_the_frame_of_a_base(tmp_path: Path) -> None:
    """W = a t^2 / 2 at all supports: the motion from them equals the run in the frame with the acceleration a.

    A midpoint rule integrates w exactly. Accelerations differ by round-off of the velocities over a step.
    """
    acceleration = 30.0
    times: Array = np.linspace(0.0, 0.02, 9, dtype=np.float64)
    place = recorded(tmp_path / "w.csv", 0.5 * acceleration * times**2, times)
    shake = recorded(tmp_path / "a.csv", np.full_like(times, acceleration), times)
    push = {
        "type": "harmonic_force", "name": "push", "point": LENGTH, "amplitude": 60.0, "frequency": 200.0,
    }  # fmt: skip
    walls = [
        {"type": "recorded_support_motion", "name": one, "support": one, "file": place} for one in ("left", "right")
    ]
    keys: dict[str, Any] = {
        "damping": {"mass": 0.0, "stiffness": 1.0e-6},
        "contact": {"stiffness": 1.0e11, "damping": 1.0e6},
        "time": {"end": 0.02, "step": 1.0e-4},
    }
    moved = history_of(tmp_path / "moved", [WEIGHT, push, *walls], **keys)
    base = history_of(tmp_path / "base", [WEIGHT, push, {"type": "recorded_motion", "file": shake}], **keys)
    assert "displacement_from_supports" not in base
    assert np.max(base["contact_force"].values) > 0.0
    assert np.max(moved["displacement"].values) > 0.4 * acceleration * times[-1] ** 2  # w is in it
    for record in ("displacement", "velocity", "acceleration"):
        expected = base["acceleration_relative" if record == "acceleration" else record].values
        apart = np.abs(moved[f"{record}_from_supports"].values - expected)
        assert np.max(apart) < 1.0e-9 * np.max(np.abs(expected)), record


def test_a_slow_motion_leaves_what_edges_carry(tmp_path: Path) -> None:
    """One of two supports sinks by 2 mm in 2 s: the beam leans on the edges of both, 10 mm behind their middles.

    It stays on the line through the middles but for slope times 10 mm, everywhere.
    """
    sunk, slope = 2.0e-3, 2.0e-3 / 0.38
    sinks = motion("sinks", "right", 0.5 * sunk, frequency=0.25)
    history = history_of(tmp_path / "run", [WEIGHT, sinks], time={"end": 2.0, "step": 1.0e-3})
    found, whole = history["displacement_from_supports"], history["displacement"]
    assert found.attrs["units"] == "m"
    assert np.ptp(whole.sel(probe="end", component="y").values) == pytest.approx(sunk, rel=5e-3)
    left = (found[-1] - found[0]).sel(component="y").values
    np.testing.assert_allclose(left, 0.01 * slope, atol=5.0e-3 * sunk)


def test_the_line_by_hand() -> None:
    """Lever rule between two supports; the mean slope of three; a joint is at rest; a closure moves nothing."""
    both = gapbeam.read_case(tables([motion("one", "left", 1e-3), motion("two", "right", 1e-3)]))
    expected = np.array([[1.0, 0.0], [0.5, 0.5], [0.0, 1.0], [-0.01 / 0.38, 0.39 / 0.38]]).T
    np.testing.assert_allclose(support_line(both, [0.01, 0.2, 0.39, 0.4])[..., -1], expected, atol=1e-14)
    assert not np.any(support_line(both, [0.2])[..., :-1])
    closure = {"type": "clearance_change", "support": "left", "times": [0.0, 0.1], "changes": [0.0, -1e-4]}
    assert not np.any(support_line(gapbeam.read_case(tables([closure])), [0.2]))
    three = tables([motion("one", "right", 1e-3)])
    three["support"] = [*three["support"], {"name": "mid", "from": 0.19, "to": 0.21, "clearance": 1e-3}]
    # least squares through (0.01, 0), (0.2, 0), (0.39, 1): mean 1/3, slope 1 / (2 * 0.19)
    line = support_line(gapbeam.read_case(three), [0.2, 0.4])[0, :, -1]
    np.testing.assert_allclose(line, [1.0 / 3.0, 1.0 / 3.0 + 0.2 / 0.38], rtol=1e-12)
    held = {
        **tables([motion("one", "slot", 1e-3)]),
        "support": [{**tables([])["support"][1], "name": "slot"}],
        "joint": [{"name": "pin", "type": "pinned", "point": 0.0}],
    }
    np.testing.assert_allclose(support_line(gapbeam.read_case(held), [0.195])[0, :, -1], [0.5], rtol=1e-12)
