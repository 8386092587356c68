"""Shapes of structures in space: displacements and gaps against closed forms, and their picture in reports."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import gapbeam as gb


@pytest.mark.slow(minutes=0.2)
def test_a_run_draws_its_frame_with_the_gaps_of_its_supports(tmp_path: Path) -> None:
    """A cantilever that a force bends at the start: its shape is that of beam theory; a slot and a disc are drawn."""
    steel, round_ = gb.material(2e11, 7800.0, 0.3), gb.SpaceSection(5e-5, 2e-10, 2e-10, 4e-10)
    tip = (1.0, [0.0, 0.0, 1.0])
    points = {"tip": tip, "hole": (0.5, [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])}
    arm = gb.frame([[0, 0, 0], [1, 0, 0]], round_, steel, points, clamped=[0.0], elements=8, name="arm")
    law = gb.KelvinVoigt(stiffness=1e4)
    stop = gb.Contact(arm["tip"], gb.Slot(0.03, center=2e-3), law, name="stop", offset=1e-3)
    hole = gb.Contact(arm["hole"], gb.Disc(0.04), law, name="hole")
    scene = gb.Scene(arm, contacts=[stop, hole], loads=[gb.Force(arm["tip"], 1.0, name="push")])
    outcome = gb.run(scene, step=1e-3, end=0.2, start=gb.seat(scene), output=tmp_path / "a", errors=False)
    assert outcome.exit_status == 0
    shapes = json.loads((tmp_path / "a" / "shapes.json").read_text())
    [body] = shapes["structures"]
    x, u = np.array(body["places"])[:, 0], np.array(body["shapes"]["start"])
    assert u[:, 2] == pytest.approx(x**2 * (3.0 - x) / (6.0 * 2e11 * 2e-10), rel=1e-8, abs=1e-12)
    assert np.abs(u[:, :2]).max() < 1e-12
    walls = {one["name"]: np.array(one["walls"]) for one in shapes["supports"]}
    assert np.sort(walls["stop"][:, 0]) == pytest.approx([-0.014, 0.016], rel=1e-9)
    assert np.linalg.norm(walls["hole"], axis=1) == pytest.approx(0.04, rel=1e-9)
    gb.report(tmp_path / "a", tmp_path / "a.html", pdf=False)
    assert 'src="data:image/png;base64,' in (tmp_path / "a.html").read_text()
