"""A load is added by one file and the choice of loads, and is there for everything that asks loads."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from gapbeam.solver.loads import load_choice
from tests.regression.test_made_up_schemes import CASE as SHAKEN
from tests.shared.command import PROJECT, alone, process_environment

PULSE = """\
[[load]]
type = "half_sine_force"
point = 0.15
amplitude = 60.0
duration = 4.0e-3
start = 1.0e-3
"""
RECORD = """\
[[load]]
type = "recorded_force"
name = "pulse"
point = 0.15
file = "pulse.csv"
start = -1.0e-3
beyond = "zero"
"""
FORCE = SHAKEN[SHAKEN.index('[[load]]\ntype = "harmonic_force"') : SHAKEN.index("[[probe]]")]
IMPORT = "from gapbeam.solver.loads.load_table import Gravity, LoadTable\n"


def listed() -> str:
    """Return the choice of loads with the made-up one: one line, and one more name in the union."""
    text = Path(load_choice.__file__).read_text(encoding="utf-8")
    text = text.replace(IMPORT, IMPORT + "from gapbeam.solver.loads.made_up_load import HalfSineForce\n", 1)
    return text.replace("    | ClearanceChange,", "    | ClearanceChange\n    | HalfSineForce,", 1)


@pytest.mark.slow(minutes=0.3)
@alone
def test_a_made_up_load_is_checked_run_judged_swept_and_reported(tmp_path: Path) -> None:
    """Two files: a pulse, whose motions are those under a record of the same pulse."""
    room = tmp_path / "overlay" / "gapbeam" / "solver" / "loads"
    room.mkdir(parents=True)
    shutil.copy(PROJECT / "tests" / "programs" / "made_up_load.py", room)
    (room / "load_choice.py").write_text(listed(), encoding="utf-8")
    files = [path for path in (tmp_path / "overlay").rglob("*") if path.is_file()]
    assert len(files) == 2
    (tmp_path / "case.toml").write_text(SHAKEN.replace(FORCE, PULSE), encoding="utf-8")
    (tmp_path / "recorded.toml").write_text(SHAKEN.replace(FORCE, RECORD), encoding="utf-8")
    times = np.linspace(0.0, 4.0e-3, 401)
    np.savetxt(tmp_path / "pulse.csv", np.column_stack([times, 60.0 * np.sin(np.pi * times / 4.0e-3)]), delimiter=",")
    done = subprocess.run(
        [sys.executable, "-m", "tests.programs.use_made_up_load", tmp_path / "overlay", tmp_path / "case.toml",
         tmp_path, tmp_path / "recorded.toml"],
        cwd=PROJECT, env=process_environment(), capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    reported = json.loads(done.stdout.splitlines()[-1])
    assert reported["schema"]
    assert (reported["cheap"], reported["place"]) == (True, False)
    assert max(reported["apart"]) < 1.0e-7
    for one, other in (("beam", "recorded"), ("full", "full recorded")):
        assert reported[one]["status"] == reported[other]["status"] == 0
        tip, expected = np.array(reported[one]["tip"]), np.array(reported[other]["tip"])
        assert np.max(np.abs(tip - expected)) < 1.0e-3 * np.ptp(expected)
        assert np.ptp(expected) > 1.0e-4
    assert reported["beam"]["loop"] == "compiled"
    status, words = reported["check"]
    assert (status, "375 Hz" in words, "steps in the pulse" in words) == (0, True, True), words
    status, words = reported["coarse"]
    assert (status, "4 steps in the pulse pulse, and 10 show it" in words) == (0, True), words
    for name, expected_words in {
        "late": ("start", "less than the end of the run, 0.04 s"),
        "misspelled": ("`durration`", "did you mean `duration`?"),
        "outside": ("x = 0.6 m, outside the beam",),
        "periodic": ('with the half sine force "pulse"', "a load that never repeats"),
    }.items():
        status, words = reported[name]
        assert status == 2, words
        assert all(word in words for word in expected_words), words
    status, words = reported["gate"]
    assert (status, "energy" in words) == (3, True), words
    status, words = reported["sweep"]
    assert (status, "2 of 2 responses passed" in words) == (0, True), words
    status, words = reported["report"]
    assert status == 0, words
    page = (tmp_path / "beam" / "report.html").read_text(encoding="utf-8")
    assert "half_sine_force" in page
    assert "pulse" in page
