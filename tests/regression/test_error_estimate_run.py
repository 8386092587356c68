"""The error estimate of a run as a user has it: summary, last line, switches, ranks."""

from __future__ import annotations

import os
import signal
import time
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest

import gapbeam
from gapbeam.postprocess.report.sections.verdict_section import errors_table
from gapbeam.postprocess.results.results import records_in
from gapbeam.studies.error_estimate.companion_marches import companion_motions
from gapbeam.studies.error_estimate.companions import COARSER, HALF_STEP, Companion
from gapbeam.studies.error_estimate.force_peaks import Span, force_peaks
from gapbeam.studies.error_estimate.motion_record import MotionRecord
from gapbeam.studies.trials import response
from tests.shared.command import DEMO, RATTLE, alone, called, on_ranks, settings
from tests.shared.interrupted import stopped_after

QUIET = ("model.type=reduced", "load.shaker.amplitude=2.0", "time.end=0.4", "output.fields_interval=0.1")


@pytest.fixture
def estimated(monkeypatch: pytest.MonkeyPatch) -> None:
    """Estimate errors, which the tests switch off."""
    monkeypatch.setenv("GAPBEAM_ERRORS", "companions")


@alone
@pytest.mark.usefixtures("estimated")
def test_a_run_ends_with_its_errors(tmp_path: Path) -> None:
    """Figures with errors in the summary and in the closing table; `--error none` and the variable switch them off."""
    done = called("run", DEMO, *settings(*QUIET), "--output", tmp_path / "on")
    assert done.returncode == 0, done.stderr
    summary = gapbeam.open_results(tmp_path / "on").summary
    errors = summary["errors"]
    assert errors["status"] == "estimated"
    assert set(errors["companions"]) == {"twice the step", "stiffer contact", "coarser mesh", "finest"}
    steps = sum(one["steps"] for one in errors["companions"].values())
    assert steps <= 2 * summary["convergence"]["steps"], "whatever the machine did meanwhile"
    assert errors["up_to"] == pytest.approx(0.4)
    figures = {(one["span"], one["name"]): one for one in errors["figures"]}
    tip = figures["second half", "tip peak-to-peak displacement"]
    assert 0.0 < tip["relative_error"] < 0.2
    history = gapbeam.open_results(tmp_path / "on").history
    settled = history["displacement"].sel(probe="tip", component="y").values[2000:]
    assert tip["value"] == pytest.approx(float(np.ptp(settled)), rel=0.05)
    assert "figure, second half, not settled" in done.stdout
    assert "test peak-to-peak displacement" in done.stdout
    assert {row["figure"]: row["verdict"] for row in summary["closing"]["rows"]}[tip["name"]] == "good"
    assert "+-" in done.stdout
    peaks = errors["force_peaks"]["second half"]["base"]
    assert set(peaks) == {"largest recorded force", "largest mean force", "contact_duration"}
    assert peaks["largest recorded force"] >= peaks["largest mean force"] > 0.0
    table = errors_table(summary)
    assert table is not None
    assert ("tip peak-to-peak displacement", "second half") in [row[:2] for row in table.rows]
    assert errors_table({"errors": {"status": "not estimated"}}) is None
    off = called("run", DEMO, *settings(*QUIET), "--output", tmp_path / "off", "--error", "none")
    assert off.returncode == 0
    assert "errors" not in gapbeam.open_results(tmp_path / "off").summary
    assert "+-" not in off.stdout


def test_only_a_wall_time_of_the_user_ends_companions() -> None:
    """The reach of an estimate is the same on any machine; a limit of the user stops all of them at the same time."""
    changes = {"model.type": "reduced", "contact.stiffness": 1.0e13, "output.history_interval": 1.0e-4}
    case = gapbeam.read_case(DEMO)
    companions = [Companion(HALF_STEP, changes | {"time.step": 5.0e-5}, 2.0), Companion(COARSER, changes)]
    motions = list(companion_motions(case, companions, 0.6, 1.0e-4, longest=1.0e-9))
    assert motions[0].motion is not None
    assert motions[1].motion is not None
    assert 8.0e-4 < motions[0].motion.end < 0.6
    assert motions[1].motion.end == pytest.approx(motions[0].motion.end)
    late = list(companion_motions(case, companions, 0.6, 0.1, longest=1.0e-9))
    assert [one.motion for one in late] == [None, None]
    assert "too slow" in late[0].failure


def test_a_companion_that_fails_is_left_out() -> None:
    """A refused mesh took the errors of the step with it; the others stand, and the reason is said."""
    changes = {"model.type": "reduced", "contact.stiffness": 1.0e13, "output.history_interval": 1.0e-4}
    wrong = Companion(COARSER, changes | {"mesh.size": -1.0})
    motions = list(companion_motions(gapbeam.read_case(DEMO), [wrong, Companion(HALF_STEP, changes)], 0.01, 1.0e-4))
    assert motions[0].motion is None
    assert motions[0].name == "coarser mesh"
    assert "mesh.size: found: -1.0" in motions[0].failure
    assert motions[1].motion is not None


@alone
def test_switches_that_are_none_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Exit status 2, what was found and what is expected."""
    done = called("run", DEMO, "--error", "perhaps", "--output", tmp_path / "out")
    assert done.returncode == 2
    assert "perhaps" in done.stderr
    assert "companions" in done.stderr
    monkeypatch.setenv("GAPBEAM_ERRORS", "perhaps")
    done = called("run", DEMO, *settings("time.end=0.01"), "--output", tmp_path / "out")
    assert done.returncode == 2
    assert 'GAPBEAM_ERRORS is "perhaps"; expected "companions" or "thorough" or "none"' in done.stderr
    assert not (tmp_path / "out").exists()


@alone
@pytest.mark.slow(minutes=2)
@pytest.mark.usefixtures("estimated")
def test_ranks_have_the_same_errors(tmp_path: Path) -> None:
    """The first rank estimates, the others wait."""
    found = []
    for count in (1, 2):
        folder = tmp_path / str(count)
        assert on_ranks(count, "run", DEMO, *settings(*QUIET), "--output", folder).returncode == 0
        found.append([one["error"] for one in gapbeam.open_results(folder).summary["errors"]["figures"]])
    assert found[0] == pytest.approx(found[1], rel=1e-4)


@alone
@pytest.mark.usefixtures("estimated")
@pytest.mark.parametrize(("number", "status"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
def test_a_signal_during_the_estimate_is_answered(
    number: int, status: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """In a companion, which is no failure of that: a message, the status of the signal, and a resume that estimates."""
    keys = (*RATTLE, "model.type=rigid", "time.end=0.02")
    marched = response._march

    def interrupted(*_: object, **__: object) -> None:
        os.kill(os.getpid(), number)
        time.sleep(60.0)

    monkeypatch.setattr(response, "_march", interrupted)
    outcome = gapbeam.run(DEMO, keys, tmp_path / "out")
    assert outcome.exit_status == status
    assert "while the errors of the run were estimated; its results are whole" in caplog.text
    assert outcome.summary["status"] == "completed"
    monkeypatch.setattr(response, "_march", marched)
    assert gapbeam.run(DEMO, keys, tmp_path / "out", resume=True).summary["errors"]["status"] == "estimated"


@alone
@pytest.mark.usefixtures("estimated")
@pytest.mark.parametrize(
    ("limit", "status"),
    [("", 143), ("gates.failures.penetration_beside_the_clearance=0.05", 4)],
    ids=["signal", "gate"],
)
def test_a_run_that_ends_early_has_the_same_peaks(
    limit: str, status: int, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """By a signal or by a limit: largest records and means over contacts, those of the whole run up to there."""
    keys = (*RATTLE, "model.type=rigid", "time.end=0.06", "output.fields_interval=1e-3")
    assert gapbeam.run(DEMO, keys, tmp_path / "whole").exit_status == 0
    whole = MotionRecord.of_records(*records_in(tmp_path / "whole"))
    with caplog.at_level("INFO", logger="gapbeam"), nullcontext() if limit else stopped_after(30):
        early = gapbeam.run(DEMO, (*keys, limit) if limit else keys, tmp_path / "early")
    assert early.exit_status == status, early.message
    end = float(gapbeam.open_results(tmp_path / "early").history["time"][-1])
    assert end < 0.059
    found = gapbeam.open_results(tmp_path / "early").summary["errors"]
    assert (found["status"], "ended early" in found["reason"]) == ("not estimated", True)
    [(name, peaks)] = found["force_peaks"].items()
    assert name == "first part"
    assert peaks == force_peaks(whole, [Span("first part", 0.0, end, 1)])["first part"]
    assert "without errors: base" in caplog.text
