"""Runs of a tube with rigid sections in its holes: stopped and continued, and what their summary says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import gapbeam
from tests.shared.command import CASE_FOLDER
from tests.shared.interrupted import differing, run_in_parts

TUBE = CASE_FOLDER / "tube-holes.toml"
KEYS = (
    "model.sections=rigid",
    "model.modes=12",
    "mesh.cells_through_thickness=2",
    "mesh.cells_across_width=2",
    "mesh.size=0.1",
    "mesh.support_size=0.01",
    "load.shaker.ramp=0.0",
    "load.shaker.amplitude=200.0",
    "time.end=0.03",
    "output.fields_interval=0.01",
    "output.errors=none",
)


@pytest.mark.slow(minutes=0.4)
def test_a_resumed_run_is_the_same(tmp_path: Path) -> None:
    """Stopped and continued on the same sections: no bit differs; fields spread the forces over the mesh."""
    whole = gapbeam.run(TUBE, KEYS, tmp_path / "whole")
    assert whole.exit_status == 0, whole.message
    parts = run_in_parts(TUBE, KEYS, tmp_path / "parts", (1,))
    assert parts.exit_status == 0, parts.message
    assert differing(tmp_path / "whole", tmp_path / "parts") == []
    assert whole.summary["loop"] == "compiled"
    basis = whole.summary["model"]["basis"]
    assert basis["contact_shapes"] == 2 * 2 * 4
    assert 0.0 < basis["section_flexibility"] < 1e-7
    with gapbeam.open_results(tmp_path / "whole").fields() as fields:
        last = list(fields)[-1]
    assert np.min(last.contact_pressure) >= 0.0


@pytest.mark.slow(minutes=0.1)
def test_another_clearance_needs_no_new_sections(tmp_path: Path) -> None:
    """What a sweep changes without a new mesh: gaps follow, and so does the force that the walls take."""
    wide = gapbeam.run(TUBE, (*KEYS, "support.left.clearance=0.2e-3", "time.end=0.005"), tmp_path / "wide")
    assert wide.exit_status == 0, wide.message
    sunk = gapbeam.open_results(tmp_path / "wide").history["displacement"].sel(probe="left_orbit").values
    assert sunk[0, -1] == pytest.approx(-0.2e-3, rel=0.05)
