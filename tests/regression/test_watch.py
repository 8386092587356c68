"""A run that is watched from another process: true figures, its verdict at the end, and no harm to it."""

from __future__ import annotations

import json
import os
import subprocess
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gapbeam
from gapbeam.commands.drawing import frame, line
from gapbeam.postprocess.results.run_watch import look_at
from gapbeam.postprocess.results_errors import ResultsError
from gapbeam.solver.run.output import progress as progress_file
from tests.shared.command import DEMO, RATTLE, alone, called_anew
from tests.shared.processes import appears, beside, ended

pytestmark = alone

BRIEF = (*RATTLE, "time.end=0.02", "output.errors=none")
NOW = {
    "time": 0.25, "end": 1.0, "seconds_left": 90.0, "steps_per_second": 100.0, "steps": 2500, "closed": ["base"],
    "contact_share": {"base": 0.5, "gland": 0.125}, "peak_contact_force": {"base": 321.0, "gland": 12.5},
    "largest_penetration": 1e-6,
    "energy": {"kinetic": 1.0, "strain": 0.5, "contact": 0.25, "relative_residual": 1e-12},
}  # fmt: skip


def left_by_a_run(folder: Path, process: int, progress: dict[str, Any], host: str | None = None) -> Path:
    """Make a folder as a run leaves it while it goes on."""
    folder.mkdir()
    holder = {"host": host or os.uname().nodename, "pid": process}
    (folder / "run.lock").write_text(json.dumps(holder))
    (folder / "summary.json").write_text(json.dumps({"title": "a case", "status": "running", "format": 1}))
    (folder / "progress.json").write_text(json.dumps({"written": time.time(), **progress}))
    (folder / "run.log").write_text(
        "2026-01-01 00:00:00,000 WARNING first doubt\n2026-01-01 00:00:01,000 WARNING second doubt\n"
        "2026-01-01 00:00:02,000 INFO period 1.0 of 4.0\n"
    )
    return folder


def shown(folder: Path) -> str:
    """Return a frame as it is printed, on one line."""
    done = called_anew("watch", folder, "--once")
    return " ".join(done.stdout.split())


def dead() -> int:
    """Return the number of a process that is no more."""
    done = subprocess.Popen(["true"])
    done.wait()
    return done.pid


def test_a_running_run(tmp_path: Path) -> None:
    """Every figure of the progress, and the last warning."""
    words = shown(left_by_a_run(tmp_path / "out", os.getpid(), NOW))
    for part in (
        "a case", "t = 0.25 of 1 s, 25 %, 2500 steps", "time left 1 min 30 s at the mean of 100 steps/s so far",
        "base 50 %, gland 12.5 % of the time; now base", "base 321 N, gland 12.5 N; penetration 1 um",
        "energy 1.75 J now; not accounted for 1e-12", "last warning second doubt",
    ):  # fmt: skip
        assert part in words
    assert "no news" not in words


def test_a_run_that_was_killed(tmp_path: Path) -> None:
    """Its process is gone, though summary and lock say that it runs: status 4, and how to go on."""
    folder = left_by_a_run(tmp_path / "out", dead(), NOW)
    done = called_anew("watch", folder)
    assert done.returncode == 4
    assert "its process is gone at t = 0.25 s of 1 s; gapbeam run --resume continues" in " ".join(done.stdout.split())


def test_a_run_elsewhere_that_is_silent(tmp_path: Path) -> None:
    """Nobody here can ask for its process: it counts as running, and the age of its news is said."""
    seen = look_at(left_by_a_run(tmp_path / "out", 1, NOW | {"written": time.time() - 300.0}, "another"))
    assert (seen.state, seen.elsewhere) == ("running", "another")
    assert "no news for 5 min 0 s" in line(seen)


def test_a_run_without_progress(tmp_path: Path) -> None:
    folder = left_by_a_run(tmp_path / "out", os.getpid(), NOW)
    (folder / "progress.json").unlink()
    assert look_at(folder).state == "starting"
    assert "setting up, or searching: no march yet last line period 1.0 of 4.0" in shown(folder)
    (folder / "progress.json").write_text('{"writ')  # nothing that a run writes
    assert look_at(folder).state == "starting"


def test_no_run_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ResultsError, match="no such folder"):
        look_at(tmp_path / "none")
    done = called_anew("watch", tmp_path)
    assert done.returncode == 2
    assert "the results folder of a run" in " ".join(done.stderr.split())


def test_a_study_is_refused(tmp_path: Path) -> None:
    """A folder that is held for a minute without a summary; a run that has just begun has none, either."""
    folder = left_by_a_run(tmp_path / "out", os.getpid(), {})
    for name in ("summary.json", "progress.json", "run.log"):
        (folder / name).unlink()
    assert look_at(folder).state == "starting"
    os.utime(folder / "run.lock", (time.time() - 60.0,) * 2)
    with pytest.raises(ResultsError, match="a study shows its progress itself"):
        look_at(folder)


def test_what_a_run_reports_is_true(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Times in contact and peaks are those of the history up to then; time left is what remains at the mean speed."""
    reports = list[dict[str, Any]]()
    monkeypatch.setattr(progress_file, "INTERVAL", 0.0)
    monkeypatch.setattr(progress_file, "write_beside", lambda _path, text: reports.append(json.loads(text)))
    outcome = gapbeam.run(DEMO, BRIEF, tmp_path / "out")
    assert outcome.exit_status == 0
    assert not (tmp_path / "out" / "progress.json").exists()
    history = gapbeam.open_results(tmp_path / "out").history
    assert len(reports) > 3
    for one in reports[1:]:
        record = history.sel(time=one["time"], method="nearest")
        assert float(record["time"]) == pytest.approx(one["time"])
        for face, share in one["contact_share"].items():
            assert share * one["time"] == pytest.approx(float(record["contact_time"].sel(face=face)))
        for face, force in one["peak_contact_force"].items():
            recorded = history["contact_force"].sel(face=face, time=slice(0.0, one["time"] + 1e-9))
            assert force >= 0.9 * float(np.max(recorded))  # records are ends of steps, peaks those within them
        assert one["energy"]["kinetic"] == pytest.approx(float(record["kinetic_energy"]))
    assert reports[-1]["time"] == pytest.approx(reports[-1]["end"])
    assert reports[-1]["seconds_left"] == pytest.approx(0.0, abs=1e-9)
    assert reports[-1]["peak_contact_force"] == outcome.summary["peak_contact_force"]


def test_a_full_disk_does_not_end_a_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(_path: Path, _text: str) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(progress_file, "write_beside", full)
    assert gapbeam.run(DEMO, BRIEF, tmp_path / "out").exit_status == 0


@pytest.mark.slow(minutes=0.4)
def test_watching_ends_with_the_verdict(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A run beside a watcher that looks five times a second: the run is done, and the watcher says so."""
    monkeypatch.setattr(progress_file, "INTERVAL", 0.05)
    folder = tmp_path / "out"
    process = beside(
        lambda: gapbeam.run(DEMO, (*RATTLE, "time.end=0.4", "output.errors=none"), folder).exit_status,
        tmp_path / "words",
    )
    appears(folder / "progress.json")
    done = called_anew("watch", folder, "--interval", "0.2")
    assert ended(process) == 0, (tmp_path / "words").read_text()
    assert done.returncode == 0, done.stderr
    words = " ".join(done.stdout.split())
    assert "steps/s so far" in words
    assert "state completed, exit status 0 verdict 4000 steps" in words
    assert "being estimated, or switched off" in words
    again = called_anew("watch", folder)
    assert (again.returncode, "verdict 4000 steps" in " ".join(again.stdout.split())) == (0, True)


def test_a_run_that_failed_gives_its_status(tmp_path: Path) -> None:
    """Energy created by Newmark's scheme: the status and the reason of the run."""
    keys = (
        *RATTLE,
        "time.end=0.1",
        "time.scheme=newmark",
        "gates.impact_growth=0.0",
        "gates.total_growth=1e-9",
        "output.errors=none",
    )
    outcome = gapbeam.run(DEMO, keys, tmp_path / "out")
    assert outcome.exit_status == 3
    done = called_anew("watch", tmp_path / "out")
    assert done.returncode == 3
    assert "failed, exit status 3, energy created" in " ".join(done.stdout.split())


def test_frames_show_no_control_characters(tmp_path: Path) -> None:
    from io import StringIO

    from rich.console import Console

    folder = left_by_a_run(tmp_path / "out", os.getpid(), NOW)
    with (folder / "run.log").open("a") as log:
        log.write("2026-01-01 00:00:03,000 WARNING \x1b[31mred\n")
    text = StringIO()
    Console(file=text, width=100).print(frame(look_at(folder)))
    assert "\x1b" not in text.getvalue()
    assert "\\x1b[31mred" in text.getvalue()
