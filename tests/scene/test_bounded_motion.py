"""Motions that forces drive and no contact limits: their growth over a run, in words and in the exit status."""

from __future__ import annotations

from math import exp, log, pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gapbeam as gb

NAME = "bounded motion"


def driven(rate: float, scale: float, clearance: float | None = None) -> gb.Scene:
    """Return a mass on a spring that a force along its velocity drives: x'' - 2 rate x' + (2 pi scale)^2 x = 0."""
    block = gb.mass(2.0, stiffness=2.0 * (2.0 * pi * scale) ** 2, name="block")
    drive = gb.Feedback(block["at"], block["at"], [], [], [], [[0.0, 4.0 * rate]], name="drive")
    law = gb.KelvinVoigt(stiffness=200.0 * (2.0 * pi * scale) ** 2)
    gaps = [] if clearance is None else [gb.Contact(block["at"], gb.Slot(2.0 * clearance), law, name="stop")]
    return gb.Scene(block, contacts=gaps, feedbacks=[drive])


def run(folder: Path, scene: gb.Scene, scale: float, periods: float, **asked: Any) -> Any:
    """Run from a displacement of 1e-6 m at 100 steps in a period of 1 / scale s."""
    start = scene.state({"block": 1e-6})
    return gb.run(scene, step=0.01 / scale, end=periods / scale, start=start, output=folder, errors=False, **asked)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e4])
@pytest.mark.parametrize(
    ("factor", "status", "verdict"), [(5.0, 0, "holds"), (1e3, 0, "warning"), (1e18, 4, "failure")]
)
def test_growth_is_that_of_the_eigenvalue(
    scale: float, factor: float, status: int, verdict: str, tmp_path: Path
) -> None:
    """ln(factor) over the digits of a number, at any frequency; the motion grows as much."""
    rate = log(factor) / 20.0 * scale
    outcome = run(tmp_path / "run", driven(rate, scale), scale, 20.0)
    assert outcome.exit_status == status
    [found] = [one for one in outcome.summary["assumptions"] if one["name"] == NAME]
    assert found["closest"] == pytest.approx(log(factor) / log(1.0 / np.finfo(float).eps), rel=1e-9)
    assert found["verdict"] == verdict
    peak = np.abs(outcome.history["displacement"].values).max()
    assert peak == pytest.approx(1e-6 * exp(rate * 20.0 / scale), rel=0.2)
    assert any(NAME in one for one in outcome.summary["warnings"]) is (verdict == "warning")
    if verdict == "failure":
        assert "no contact limits it" in outcome.message


def test_contact_bounds_a_motion_and_gates_accept_its_growth(tmp_path: Path) -> None:
    """A limit cycle between stops, what loses energy, and what the user accepts end with status 0."""
    rate = log(1e18) / 20.0
    cycle = run(tmp_path / "cycle", driven(rate, 1.0, 1e-3), 1.0, 20.0)
    calm = run(tmp_path / "calm", driven(-rate, 1.0), 1.0, 20.0)
    for one in (cycle, calm):
        assert one.exit_status == 0
        assert NAME not in [found["name"] for found in one.summary["assumptions"]]
    asked = run(tmp_path / "asked", driven(rate, 1.0), 1.0, 20.0, gates={"failures": {"bounded_motion": "never"}})
    assert asked.exit_status == 0
    assert any(NAME in one for one in asked.summary["warnings"])
