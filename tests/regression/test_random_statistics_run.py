"""Statistics of runs under noise: from the records, the same step by step, after a stop, and as the end of a run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from mpi4py import MPI

import gapbeam
import gapbeam.solver.march.simulation
from gapbeam.postprocess.report.blocks import TableBlock, Words
from gapbeam.postprocess.report.sections.statistics_section import statistics_section
from gapbeam.solver.case.computed_defaults import overhang_frequency
from gapbeam.solver.diagnostics.statistics.batch_interval import interval_of_mean
from gapbeam.solver.diagnostics.statistics.run_statistics import SUMMED, RunStatistics
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.run.run_case import run_case
from gapbeam.solver.run.stop_rule import StopRule, decay_time
from tests.shared.command import CASE_FOLDER, DEMO, called, settings
from tests.shared.interrupted import differing, run_in_parts

CASE = CASE_FOLDER / "random-vibration.toml"
KEYS = (
    "model.elements=12",
    "time.step=1e-4",
    "time.end=0.3",
    "output.history_interval=2e-4",
    "output.fields_interval=0.02",
    "output.errors=none",
)
RMS = "probe.tip.rms"


def figures_of(summary: dict[str, Any]) -> dict[str, dict[str, Any]]:
    return {one["name"]: one for one in summary["statistics"]["figures"]}


def test_figures_are_those_of_the_records(tmp_path: Path) -> None:
    """Contact share, mean force, impact rate and rms follow from the history; intervals from its block means."""
    outcome = gapbeam.run(CASE, KEYS, tmp_path / "run")
    assert outcome.exit_status == 0, outcome.message
    found, statistics = figures_of(outcome.summary), outcome.summary["statistics"]
    names = ("time", "contact_time", "impulse", "closings", "displacement", "penetration")
    with h5py.File(tmp_path / "run" / "history.h5") as file:
        history = {name: file[name][:] for name in names}
    assert statistics["seconds"] == pytest.approx(0.3)
    first = np.searchsorted(history["time"], statistics["burn_in"] - 1e-9)
    rest = {name: values[first:] for name, values in history.items()}
    span = rest["time"][-1] - rest["time"][0]
    for face, name in enumerate(("base", "gland")):
        for variable, figure in (
            ("contact_time", "contact_share"),
            ("impulse", "mean_force"),
            ("closings", "impact_rate"),
        ):
            change = rest[variable][-1, face] - rest[variable][0, face]
            assert found[f"face.{name}.{figure}"]["value"] == pytest.approx(change / span, rel=0.02), figure
        pressed = np.mean(rest["penetration"][:, face] > 0.0)
        assert found[f"face.{name}.contact_share"]["value"] == pytest.approx(pressed, rel=0.05)
    place = rest["displacement"][1:, -1, 1]
    assert found[RMS]["value"] == pytest.approx(np.std(place), rel=0.02)
    again = interval_of_mean((place - place.mean()) ** 2, positive=True).root()
    assert found[RMS]["high"] == pytest.approx(again.high, rel=0.02)
    section = statistics_section(outcome.summary)
    assert section is not None
    words, table = section.blocks
    assert isinstance(words, Words)
    assert isinstance(table, TableBlock)
    assert [row[0] for row in table.rows] == list(found)
    assert [row[1] for row in table.rows] == [one["value"] for one in found.values()]
    assert set(statistics["missed_impacts"]) == {"base", "gland"}
    assert statistics_section({}) is None
    assert found["probe.tip.low"]["value"] == pytest.approx(np.quantile(place, 0.05), abs=0.05 * np.ptp(place))


def test_both_marches_count_alike(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Before chaos parts them, contact times and closings of both marches are the same numbers."""
    case = gapbeam.read_case(CASE, [*KEYS, "time.end=0.05"])
    run_case(case, tmp_path / "compiled", MPI.COMM_SELF)
    monkeypatch.setattr(gapbeam.solver.march.simulation, "why_not_compiled", lambda _plan: "asked for by a test")
    run_case(case, tmp_path / "steps", MPI.COMM_SELF)
    with h5py.File(tmp_path / "compiled" / "history.h5") as one, h5py.File(tmp_path / "steps" / "history.h5") as other:
        assert one["closings"][-1].sum() >= 2
        assert np.array_equal(one["closings"][:], other["closings"][:])
        assert one["contact_time"][:] == pytest.approx(other["contact_time"][:], abs=1e-12)


@pytest.mark.slow(minutes=0.1)
def test_a_run_ends_when_its_interval_is_narrow(tmp_path: Path) -> None:
    """It goes on beyond time.end, ends before its longest time, and to the same bits where it was stopped between."""
    asked = {"relative_error": 0.3, "of": RMS, "at_most": 6.0}
    whole = gapbeam.run(CASE, KEYS, tmp_path / "whole", **asked)
    until = whole.summary["statistics"]["until"]
    assert (whole.exit_status, until["met"]) == (0, True), whole.message
    assert 0.3 <= until["end"] < 6.0
    assert until["reached"] <= 0.3
    assert f"{RMS} is known within" in whole.message
    with h5py.File(tmp_path / "whole" / "history.h5") as file:
        assert file["time"][-1] == pytest.approx(until["end"])
    longer = [key for key in KEYS if "time.end" not in key] + ["time.end=6.0"]
    rule = StopRule(RMS, 0.3, 0.3)
    with pytest.MonkeyPatch.context() as patch:
        original = run_case
        patch.setattr("gapbeam.solver.run.run_case.run_case", lambda *words: original(*words[:5], rule))
        parts = run_in_parts(CASE, longer, tmp_path / "parts", stops=(4, 9))
    assert parts.exit_status == 0, parts.message
    assert parts.summary["statistics"] == whole.summary["statistics"]
    assert differing(tmp_path / "whole", tmp_path / "parts") == []


def test_a_run_whose_interval_stays_wide_says_so(tmp_path: Path) -> None:
    """Status 5 with its reason and the time that it would take; the results are kept."""
    asked = ("--relative-error", "1%", "--of", RMS, "--at-most", "0.4s", "--output", tmp_path / "run")
    ended = called("run", CASE, *settings(*KEYS), *asked)
    assert ended.returncode == 5, ended.stderr
    summary = gapbeam.open_results(tmp_path / "run").summary
    assert (summary["status"], summary["reason"]) == ("completed", "interval not met")
    assert summary["statistics"]["until"]["time_needed"] > 0.4
    assert "--at-most of" in ended.stderr


def test_impacts_that_steps_miss_leave_a_rate_in_doubt(tmp_path: Path) -> None:
    """Its interval is narrow, the run ends there, and neither last line nor status say that it is met."""
    coarse = (*KEYS, "time.step=2e-4")
    outcome = gapbeam.run(CASE, coarse, tmp_path / "run", relative_error=0.5, of="face.base.impact_rate", at_most=6.0)
    statistics = outcome.summary["statistics"]
    assert statistics["missed_impacts"]["base"] > 0.03
    until = statistics["until"]
    assert (until["narrow"], until["met"], until["doubt"]) == (True, False, "not resolved")
    assert until["end"] < 6.0
    assert (outcome.exit_status, outcome.summary["reason"]) == (5, "interval not met")
    assert "fell between two steps" in outcome.message
    section = statistics_section(outcome.summary)
    assert section is not None
    assert "fell between two steps" in str(section.blocks[0])


def test_a_scheme_that_takes_energy_is_warned_of(tmp_path: Path) -> None:
    """By check, among the assumptions, in the statistics and by a run that is to end by an interval."""
    case = gapbeam.read_case(CASE, [*KEYS, "time.scheme=implicit-midpoint", "contact.damping=0"])
    assert any("implicit-midpoint under random loads" in text for text in gapbeam.check(case).warnings)
    summary = gapbeam.run(case, (), tmp_path / "run").summary
    assert summary["statistics"]["scheme_bias"]["energy"] < -0.02
    (finding,) = [one for one in summary["assumptions"] if one["name"].startswith("energy under noise")]
    assert finding["verdict"] == "warning"
    assert any("mean squares of the motion are off by about as much" in text for text in summary["warnings"])
    assert any("implicit-midpoint under random loads" in text for text in summary["warnings"])
    usual = gapbeam.run(CASE, KEYS, tmp_path / "usual").summary
    assert usual["statistics"]["scheme_bias"]["energy"] == 0.0
    assert not any("under random loads" in text or "under noise" in text for text in usual["warnings"])


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ({"relative_error": 0.1, "of": "probe.tip.rsm"}, "did you mean probe.tip.rms?"),
        ({"relative_error": 0.1, "of": "probe.tip.mean"}, "a mean may be 0"),
        ({"relative_error": -0.1, "of": RMS}, "expected more than 0"),
        ({"relative_error": float("nan"), "of": RMS}, "expected more than 0"),
        ({"relative_error": 0.1}, "`of=` is missing"),
        ({"of": RMS}, "`relative_error=` is missing"),
        ({"at_most": 3.0}, "`relative_error=` is missing"),
        ({"relative_error": 0.1, "of": RMS, "at_most": 0.1}, "expected at least time.end, 0.3 s"),
    ],
)
def test_options_that_do_not_fit_are_refused(words: dict[str, Any], expected: str, tmp_path: Path) -> None:
    with pytest.raises(UserError) as refusal:
        gapbeam.run(CASE, KEYS, tmp_path / "run", **words)
    assert expected in str(refusal.value)
    assert not (tmp_path / "run").exists()


def test_a_case_without_noise_has_no_statistics(tmp_path: Path) -> None:
    """Periodic loads, and searches for periodic responses: refused with the reason."""
    for case in (DEMO, (CASE_FOLDER / "periodic.toml")):
        with pytest.raises(UserError, match="no load of this case is random"):
            gapbeam.run(case, (), tmp_path / "run", relative_error=0.1, of=RMS)


def test_a_record_short_beside_the_damping_is_too_short() -> None:
    """0.12 s of a tube that rings for 36 ms say nothing about its rms, however narrow the interval looks."""
    rng = np.random.default_rng(5)
    count, interval = 4000, 1.0e-3
    place = np.zeros((count, 1, 3))
    place[:, 0, -1] = rng.standard_normal(count)
    rows = {name: np.zeros((count, 1)) for name in SUMMED}
    rows |= {"time": interval * np.arange(count), "displacement": place, "acceleration_absolute": place}
    for decay, verdict, met in (
        (0.0, "good", True),
        (0.05, "good", True),
        (0.15, "too short", True),
        (0.3, "too short", False),
    ):
        statistics = RunStatistics(("face",), ("tip",), False, interval, decay)
        statistics.see(rows)
        (rms,) = [one for one in statistics.figures() if one.name == RMS]
        assert (rms.verdict, statistics.met(RMS, 0.1)) == (verdict, met), decay


def test_the_decay_is_that_of_the_damping() -> None:
    """1 / (2 zeta w) of the first bending frequency."""
    case = gapbeam.read_case(CASE)
    frequency = overhang_frequency(case)
    damped = gapbeam.read_case(
        CASE, {"damping": {"frequencies": [frequency, 10.0 * frequency], "ratios": [0.02, 0.02]}}
    )
    assert decay_time(damped) == pytest.approx(1.0 / (2.0 * 0.02 * 2.0 * np.pi * frequency), rel=1e-9)
    assert decay_time(gapbeam.read_case(CASE, {"damping": {"mass": 0.0, "stiffness": 0.0}})) == 0.0
