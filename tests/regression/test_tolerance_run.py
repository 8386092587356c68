"""`gapbeam run --tolerance` as a user has it: a promise or its doubts, in summary, last line and exit status."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from mpi4py import MPI

import gapbeam
from gapbeam.postprocess.display_units import in_percent
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.studies.tradeoff.level_errors import Grounds, Judged, window_differences
from gapbeam.studies.tradeoff.level_measurement import Level, LevelJob, MeasuredLevel, measure
from gapbeam.studies.tradeoff.run_tradeoff import Taken, with_promise
from tests.shared.command import DEMO, alone, called, settings
from tests.unit.test_tolerance import write_stored

END = 0.05
QUIET = (f"time.end={END}", "load.shaker.amplitude=2.0", "output.fields_interval=0.05")
RESONANCE = """
title = "Resonance of a clamped beam"
beam = { length = 0.510, thickness = 0.012, width = 0.020 }
material = { young_modulus = 2.1e11, poisson_ratio = 0.3, density = 7919.0 }
damping = { frequencies = [40.0, 300.0], ratios = [3e-4, 3e-4] }
support = { length = 0.050, clearance = -0.006e-3 }
mesh = { size = 0.020, support_size = 6.25e-3, cells_through_thickness = 2 }
contact.stiffness = 1.8e15
model.type = "reduced"
load = [
    { type = "gravity" },
    { type = "harmonic_force", name = "shaker", point = 0.15, amplitude = 0.05, frequency = 45.85 },
]
probe = [{ name = "tip", point = 0.510 }]
time = { end = 30.0, step = 4e-4 }
"""


@pytest.mark.slow(minutes=0.1)
@alone
def test_a_run_keeps_the_doubts_of_its_tolerance(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A reference uncertain by 5.8 %: 2 % is not promised, status 5 and results; 10 % is promised, status 0."""
    folder = tmp_path / "study"
    monkeypatch.setattr("gapbeam.studies.tradeoff.run_tradeoff.tradeoff_folder", lambda _: folder)
    level = Judged(Level("beam, 24 elements", {"model": {"type": "beam", "elements": 24}}), MeasuredLevel(),
                   {"displacement": 0.01}, None, 1.0, END)  # fmt: skip
    write_stored(folder, read_case(DEMO, QUIET), [level], Grounds(END, {"displacement": 0.058}))
    doubt = "a tolerance of 2 % is not promised for this run: the reference itself is uncertain by 5.8 % (displacement)"
    words = ["run", DEMO, *settings(*QUIET), "--error", "none", "--output", tmp_path / "out", "--tolerance", "2%"]
    for more in ([], ["--resume"]):
        done = called(*words, *more)
        assert done.returncode == 5, done.stderr
        assert done.stderr.count(doubt) >= 1
        assert "done: " in done.stderr
        summary = gapbeam.open_results(tmp_path / "out").summary
        assert summary["status"] == "completed"
        assert summary["exit_status"] == 5
        assert summary["reason"] == "tolerance not promised"
        assert summary["warnings"].count(doubt) == summary["message"].count(doubt) == 1
        assert summary["tolerance"]["promised"] is False
    assert gapbeam.open_results(tmp_path / "out").history.sizes["time"] > 10
    words[-3:] = [tmp_path / "sure", "--tolerance", "10%"]
    done = called(*words)
    assert done.returncode == 0, done.stderr
    assert "within the tolerance of 10 %: 1 % off the reference of the trade-off" in done.stdout
    summary = gapbeam.open_results(tmp_path / "sure").summary
    assert summary["tolerance"]["promised"] is True
    assert summary["reason"] is None
    assert not any("tolerance" in warning for warning in summary["warnings"])


@alone
def test_a_run_compares_its_own_estimate_with_its_tolerance(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A promised tolerance of 0.01 % that the run's own estimate does not reach: status 0, and a warning."""
    level = Judged(Level("beam, 24 elements", {}), MeasuredLevel(), {"displacement": 1e-6}, None, 1.0, END)
    monkeypatch.setenv("GAPBEAM_ERRORS", "companions")
    outcome = gapbeam.run(DEMO, (*QUIET, "model={type='beam', elements=24}"), output=tmp_path / "out")
    assert outcome.exit_status == 0
    taken = Taken(level.level.name, {}, 1e-4, dict(level.errors), {}, END, ())
    kept = with_promise(outcome, taken, MPI.COMM_WORLD)
    own = kept.summary["tolerance"]["estimate_of_the_run"]
    assert own["displacement"] > 1e-4
    assert kept.exit_status == 0
    (warning,) = [line for line in kept.summary["warnings"] if "error estimate of the run itself is larger" in line]
    assert f"displacement {in_percent(own['displacement'])}" in warning
    again = with_promise(replace(kept, summary=gapbeam.open_results(tmp_path / "out").summary), taken, MPI.COMM_WORLD)
    assert again.summary["warnings"].count(warning) == 1


@pytest.mark.slow(minutes=0.1)
def test_a_resonance_leaves_a_tolerance_that_its_first_periods_keep(tmp_path: Path) -> None:
    """Generalized-alpha: within 2 % of a quarter of the step in the first 8 periods, and far beyond it after 6 s."""
    case = tmp_path / "resonance.toml"
    case.write_text(RESONANCE, encoding="utf-8")
    fixed = {"output.history_interval": 4e-4, "output.fields_interval": None}
    scheme = {"time.scheme": {"type": "generalized-alpha", "rho_inf": 0.5}}
    level, fine = measure(
        [LevelJob(case, fixed | scheme, 8, span=6.0), LevelJob(case, fixed | {"time.step": 1e-4}, 8, span=6.0)]
    )
    assert level.verdict == fine.verdict == "passed"
    assert len(level.windows["tip peak-to-peak displacement"]) == 1 + int(6.0 * 45.85) // 12
    begin, end = level.figures(8)["tip peak-to-peak displacement"], fine.figures(8)["tip peak-to-peak displacement"]
    assert abs(begin / end - 1.0) < 0.02
    assert window_differences(level.windows, fine.windows)["displacement"] > 0.05
