"""`gapbeam report`: what it shows of runs and studies, what it says of those that failed, what it refuses."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pypdf import PdfReader

from gapbeam.commands.drawing import report
from gapbeam.postprocess.report.blocks import Block, Report, ReportSection, TableBlock, Verdict, number, percent
from gapbeam.postprocess.report.charts import Chart, envelope, thinning_words
from gapbeam.postprocess.report.html_page import html_of
from gapbeam.postprocess.report.pdf_page import BrowserError
from gapbeam.postprocess.results_errors import ResultsError
from gapbeam.solver.schema.record_table import CURVE_FILE, HISTORY_FILE, SUMMARY_FILE
from tests.regression.test_postprocess_plot import FORCING, sine_records
from tests.shared.command import alone, called_in_turn
from tests.shared.reports import report_on
from tests.unit.test_postprocess_synthetic import write_results


def blocks_of(blocks: Sequence[Block]) -> Iterator[Block]:
    """Yield every block of sections and of those in them."""
    for block in blocks:
        if isinstance(block, ReportSection):
            yield from blocks_of(block.blocks)
        else:
            yield block


def tables(made: Report) -> dict[str, TableBlock]:
    """Return the tables of a report by caption."""
    return {block.caption: block for block in blocks_of(made.sections) if isinstance(block, TableBlock)}


def charts(made: Report) -> list[Chart]:
    """Return the charts of a report."""
    return [block for block in blocks_of(made.sections) if isinstance(block, Chart)]


def verdicts(made: Report) -> list[tuple[str, str]]:
    """Return level and text of the verdicts of a report."""
    return [(block.level, block.text) for block in blocks_of(made.sections) if isinstance(block, Verdict)]


def described(folder: Path, **summary: Any) -> Path:
    """Change the summary of results."""
    path = folder / SUMMARY_FILE
    path.write_text(json.dumps(json.loads(path.read_text(encoding="utf-8")) | summary), encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def forced(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the results of a motion of period 3 in closed form, at two probes."""
    time = np.linspace(0.0, 1.25, 12501)
    folder = tmp_path_factory.mktemp("run") / "forced"
    return write_results(folder, time, sine_records(time), probes=("middle", "tip"))


def test_run_shows_what_its_records_hold(forced: Path) -> None:
    """Peaks, harmonics and the cycle of a motion that is known: 2 mm at 20 Hz and 0.1 mm at a third of it."""
    made = report_on([forced], "gapbeam report forced")
    harmonics = {row[0]: row for row in tables(made)["Amplitudes of the harmonics at the probe tip"].rows}
    assert harmonics["1"][1:3] == pytest.approx((FORCING, 2.0), rel=1e-6)
    assert harmonics["1/3"][1:3] == pytest.approx((FORCING / 3, 0.1), rel=1e-6)
    peaks = {row[:2]: row for row in tables(made)["Peaks of the whole record, and of a forcing period"].rows}
    assert peaks["tip", "displacement (mm)"][4] == pytest.approx(2.05, rel=1e-3)
    faces = {row[0]: row for row in tables(made)["The faces over the whole record, at the recorded instants"].rows}
    assert faces["base"][1:3] == pytest.approx((90.0, 50.0), rel=1e-3)
    shown = verdicts(made)
    assert ("passed", "The run completed.") in shown
    assert any(level == "passed" and text.startswith("tip: period 3") for level, text in shown)
    assert all(chart.command == "gapbeam report forced" for chart in charts(made))
    assert {chart.choices for chart in map(_frozen, charts(made)) if chart.choices} == {("middle", "tip")}


def _frozen(chart: Chart) -> Chart:
    return Chart(chart.caption, chart.x, chart.y, chart.curves, choices=tuple(chart.choices))


def test_curves_hold_the_extremes_of_the_record(forced: Path) -> None:
    """A curve of few points still reaches the peaks of all the values, and says that it is one of few."""
    time = np.linspace(0.0, 1.25, 12501)
    values = 2.0 * np.sin(2 * np.pi * FORCING * time) + 0.1 * np.sin(2 * np.pi * FORCING * time / 3)
    chart = next(chart for chart in charts(report_on([forced], "c")) if chart.caption.startswith("Displacement"))
    curve = next(curve for curve in chart.curves if curve.choice == "tip")
    assert len(curve.x) <= 1600
    assert (np.max(curve.y), np.min(curve.y)) == pytest.approx((values.max(), values.min()), rel=1e-12)
    assert "Of every 16 values the smallest and the largest are drawn" in chart.caption


@pytest.mark.parametrize(("size", "most"), [(5, 10), (10, 10), (11, 10), (12345, 100), (1000, 2)])
def test_envelope_is_a_part_of_the_record(size: int, most: int) -> None:
    """Every point of it is one of the record, in order, and none of the extremes is lost."""
    x, y = np.arange(size, dtype=float), np.random.default_rng(size).normal(size=size)
    a, b = envelope(x, y, most)
    assert a.size <= most
    assert np.all(np.diff(a) > 0.0)
    assert np.array_equal(b, y[a.astype(int)])
    assert (b.max(), b.min()) == (y.max(), y.min())
    assert (thinning_words(size, most) == "") == (size <= most)


def test_failed_and_energy_creating_runs_are_red_and_first(forced: Path, tmp_path: Path) -> None:
    """A failure, an accepted growth of energy and a run without an end are reported before anything else."""
    time = np.linspace(0.0, 0.5, 501)
    failed = described(
        write_results(tmp_path / "failed", time, status="failed"), message="at t = 0.2 s energy is not finite"
    )
    limits = {"impact_growth": 0.0025, "impact_loss": 0.008, "total_growth": 0.05}
    created = described(
        write_results(tmp_path / "created", time),
        energy={"relative_growth": 0.31, "created": 0.5},
        gates={"limits": limits, "impacts": 3, "violations": 2},
        warnings=["2 of 3 impacts changed the energy"],
    )
    running = write_results(tmp_path / "running", time, status="running")
    for folder, level, words in (
        (failed, "error", "**The run failed.** at t = 0.2 s energy is not finite"),
        (created, "error", "0.500 J, 31 % of the energy exchanged"),
        (running, "warning", "still going on, or was killed"),
    ):
        made = report_on([folder], "c")
        first = made.sections[0].blocks[0]
        assert isinstance(first, Verdict)
        assert first.level == level
        assert words in first.text
    assert ("warning", "2 of 3 impacts changed the energy") in verdicts(report_on([created], "c"))
    together = report_on([forced, failed, created], "c")
    assert [one[0] for one in verdicts(together)[:2]] == ["error", "error"]
    page = html_of(together)
    assert page.index('class="verdict error"') < page.index("<table")


def test_values_that_are_not_finite_do_not_stop_a_report(tmp_path: Path) -> None:
    """What cannot be drawn is reported where it would stand; the rest is there."""
    time = np.linspace(0.0, 0.5, 501)
    records = sine_records(time)
    records["displacement"][300:] = np.nan
    made = report_on([write_results(tmp_path / "nan", time, records)], "c")
    assert any(level == "error" and "are not finite" in text for level, text in verdicts(made))
    assert [section.title for section in made.sections][:4] == ["Summary", "Motion", "Contact", "Energy"]
    seat = write_results(tmp_path / "seat", np.zeros(1), sine_records(np.zeros(1)))
    assert any("one record only: no motion to analyze" in text for _, text in verdicts(report_on([seat], "c")))
    bare = write_results(tmp_path / "bare", time, sine_records(time), probes=(), frequency=None)
    assert any("no motion of a probe" in text for _, text in verdicts(report_on([bare], "c")))
    html_of(report_on([seat, bare], "c"))
    (tmp_path / "nan" / HISTORY_FILE).unlink()
    assert ("warning", f"There is no `{HISTORY_FILE}`.") in verdicts(report_on([tmp_path / "nan"], "c"))


def test_periodic_response_is_shown_as_it_repeats(tmp_path: Path) -> None:
    """One computed period of 2 mm: a settled cycle of one forcing period, its harmonics, its multipliers."""
    time = np.linspace(0.0, 1.0 / FORCING, 501)
    phase = 2.0 * np.pi * FORCING * time
    records = {"displacement": 2e-3 * np.sin(phase), "velocity": 4e-3 * np.pi * FORCING * np.cos(phase)}
    multipliers = [{"real": 0.6, "imaginary": 0.5}, {"real": -1.2, "imaginary": 0.0}]
    found = {"stable": False, "stability": "period doubling", "largest_multiplier": 1.2, "multipliers": multipliers}
    folder = described(write_results(tmp_path / "orbit", time, records), periodic=found)
    with (folder / "case.toml").open("a", encoding="utf-8") as case:
        case.write('[analysis]\ntype = "periodic"\n')
    made = report_on([folder], "c")
    shown = verdicts(made)
    assert any(text.startswith("tip: period 1") for _, text in shown)
    assert ("warning", "The periodic response is unstable: period doubling.") in shown
    assert not any("too few" in text for _, text in shown)
    harmonics = {row[0]: row for row in tables(made)["Amplitudes of the harmonics at the probe tip"].rows}
    assert harmonics["1"][2] == pytest.approx(2.0, rel=1e-6)
    plane = next(chart for chart in charts(made) if chart.equal)
    assert list(plane.curves[0].x) == [0.6, -1.2]
    assert np.hypot(plane.curves[1].x, plane.curves[1].y) == pytest.approx(1.0)


def test_runs_side_by_side(forced: Path, tmp_path: Path) -> None:
    """A motion twice as large: 50 % between the figures, waveforms over each other, the keys that differ."""
    time = np.linspace(0.0, 1.25, 12501)
    twice = {name: 2.0 * values for name, values in sine_records(time).items()}
    other = write_results(tmp_path / "twice", time, twice, probes=("middle", "tip"), clearance=2e-4)
    made = report_on([forced, other], "c")
    assert tables(made)["Keys in which the cases differ"].rows == [("support.clearance", "0.000107", "0.0002")]
    figures = next(table for caption, table in tables(made).items() if caption.startswith("Figures over"))
    row = next(row for row in figures.rows if row[0] == "tip peak-to-peak displacement (mm)")
    assert row[3] == pytest.approx(50.0, rel=1e-6)
    wave = next(chart for chart in charts(made) if chart.caption.startswith("Tip displacement"))
    heights = {curve.name: np.ptp(curve.y) for curve in wave.curves if curve.choice == "twice"}
    assert heights["the other"] == pytest.approx(2.0 * heights["forced"], rel=1e-9)


def point(clearance: str, start: str, amplitude: float, **changes: Any) -> dict[str, Any]:
    """Return the record of one response of a sweep."""
    figure = {"unit": "m", "mean": amplitude, "scatter": 0.0}
    return {
        "values": {"support.clearance": clearance}, "direction": "", "start": start, "verdict": "passed",
        "units": {"support.clearance": "m"}, "exit_status": 0, "message": "", "notes": [], "response": "period 1",
        "figures": {"tip displacement": figure, "tip harmonic 1": figure, "tip harmonic 2": figure | {"mean": 1e-4}},
    } | changes  # fmt: skip


def test_sweep_shows_every_response_of_every_point(tmp_path: Path) -> None:
    """Coexisting responses are marks of their own that say who reached them; what failed is red."""
    records = [
        point("1e-4", "seat", 1e-3), point("1e-4", "kick 1", 2e-3, response="period 3"), point("2e-4", "seat", 3e-3),
        point("2e-4", "kick 1", 0.0, verdict="energy created", message="at t = 0.1 s", figures={}),
    ]  # fmt: skip
    (tmp_path / "sweep.json").write_text(json.dumps(records), encoding="utf-8")
    made = report_on([tmp_path], "c")
    assert verdicts(made)[0] == (
        "error", "**1 of 4 responses did not pass: energy created.** First of them: at t = 0.1 s",
    )  # fmt: skip
    chart = charts(made)[0]
    assert [chart.x, chart.y] == ["support.clearance (mm)", "tip displacement (mm)"]
    curves = {curve.name: (list(curve.x), list(curve.y)) for curve in chart.curves}
    assert curves["period 1"] == (pytest.approx([0.1, 0.2]), pytest.approx([1.0, 3.0]))
    assert curves["period 3"] == (pytest.approx([0.1]), pytest.approx([2.0]))
    assert "period 3, reached 1 times: kick 1" in next(c for c in chart.curves if c.name == "period 3").texts[0]
    census = tables(made)["Every response of every point, peak to peak over its windows"]
    assert [row[1] for row in census.rows] == ["period 1", "period 3", "period 1", "energy created"]
    harmonics = next(chart for chart in charts(made) if chart.caption.startswith("Harmonics"))
    assert list(harmonics.choices) == ["1e-4", "2e-4"]


def test_studies(tmp_path: Path) -> None:
    """Stability, trade-off, comparison and a curve of periodic responses, each with its figures; all in one report."""
    trial = {"contact.stiffness": "1e10", "time.scheme": "newmark", "verdict": "passed", "residual": 1e-12}
    trial |= {"relative_penetration": 0.1, "iterations": 2.0}
    trials = [trial | {"time.step": step, "created": made} for step, made in (("1e-5", 1e-6), ("1e-4", 1e-2))]
    trials[1]["verdict"] = "energy created"
    one = {"verdict": "passed", "seconds_of_the_case": 2.0, "errors": {"displacement": 0.01}, "memory": 1e9}
    levels = [one | {"name": "beam, 24 elements"}, one | {"name": "full 2D", "seconds_of_the_case": 50.0}]
    row = {"name": "tip displacement", "unit": "m", "a": 1e-3, "b": 2e-3, "difference": 0.5, "decides": True}
    span = {"periodicity": "period 1", "windows": 2, "forcing_periods_in_a_window": 12, "start": 0.0, "end": 1.0}
    place = {"stable": True, "kind": "stable", "event": "", "largest_multiplier": 0.5, "tip.peak_to_peak": 1e-3}
    places = [
        place | {"value": 20.0},
        place | {"value": 21.0, "stable": False, "event": "fold"},
        place | {"value": 20.5, "stable": False},
        place | {"value": 20.2, "stable": None, "kind": "not known"},
        place | {"value": 20.0, "stable": None, "kind": "not known"},
    ]
    files: dict[str, Any] = {
        "stability.json": trials,
        "tradeoff.json": {
            "tolerance": 0.02, "chosen": "beam, 24 elements", "verdict": "the cheapest fidelity level", "rungs": levels,
            "promised": True, "reference": one | {"name": "full 3D"}, "uncertainty": {"displacement": 0.001},
        },
        "comparison.json": {
            "a": "A", "b": "B", "agree": False, "verdict": "differ by 50 %", "tolerance": 0.01, "figures": [row],
            "runs": {"a": span, "b": span}, "waveforms": [], "costs": [], "notes": [],
        },
        SUMMARY_FILE: {"format": 1, "title": "curve", "status": "completed"},
    }  # fmt: skip
    for name, content in files.items():
        (tmp_path / name.split(".")[0]).mkdir()
        (tmp_path / name.split(".")[0] / name).write_text(json.dumps(content), encoding="utf-8")
    curve = {"key": "load.shaker.frequency", "unit": "Hz", "points": places}
    (tmp_path / "summary" / CURVE_FILE).write_text(json.dumps(curve), encoding="utf-8")
    (tmp_path / "summary" / "case.toml").write_text("[support]\nclearance = 1e-4\n", encoding="utf-8")
    folders = [tmp_path / name.split(".")[0] for name in files]
    made = report_on(folders, "c")
    shown = verdicts(made)
    assert ("warning", "1 of 2 trials did not pass: 1 energy created.") in shown
    assert ("passed", "The cheapest fidelity level") in shown
    assert ("warning", "Differ by 50 %") in shown
    found = {chart.y: chart for chart in charts(made)}
    assert list(found["energy created / exchanged"].curves[0].y) == [1e-6, 1e-2]
    assert [curve.name for curve in found["largest error (%)"].curves][:2] == ["beam", "full 2D"]
    stable, unstable, unknown = found["peak to peak (mm)"].curves[:3]
    for part, values in ((stable, [20.0, 21.0]), (unstable, [21.0, 20.5, 20.2]), (unknown, [20.2, 20.0])):
        assert np.array_equal(part.x, [*values, np.nan], equal_nan=True)
        assert np.array_equal(part.y, [*(1.0 for _ in values), np.nan], equal_nan=True)
    assert unknown.name.endswith("stability not known")
    assert tables(made)["Events along the curve"].rows[0][:2] == ("fold", 21.0)
    page = html_of(made)
    assert page.count('id="part-') == sum(1 for _ in _sections(made.sections))


def _sections(blocks: Sequence[Block]) -> Iterator[ReportSection]:
    for block in blocks:
        if isinstance(block, ReportSection):
            yield block
            yield from _sections(block.blocks)


def test_faults_are_reported_all_at_once(forced: Path, tmp_path: Path) -> None:
    """Folders that are none, that hold nothing known, and files that are broken: where, what, and what to try."""
    (tmp_path / "empty").mkdir()
    with pytest.raises(ResultsError, match=r"none: found no such folder; .*empty: a folder with nothing; expected"):
        report_on([tmp_path / "none", forced, tmp_path / "empty"], "c")
    for text, found in (("{", "not JSON"), ("[]", "a list"), ('[{"values": {}}]', "no verdict")):
        (tmp_path / "empty" / "sweep.json").write_text(text, encoding="utf-8")
        with pytest.raises(ResultsError, match=found):
            report_on([tmp_path / "empty"], "c")


def test_a_file_is_no_folder_of_results(tmp_path: Path) -> None:
    """It is named as what it is, before the default page is looked for in it."""
    (tmp_path / "case.toml").write_text("")
    for folders in (["case.toml"], ["case.toml", "none"]):
        with pytest.raises(ResultsError, match=r"case.toml: found a file; .*expected a results folder"):
            report([tmp_path / name for name in folders])


@pytest.mark.slow(minutes=0.1)
@alone
def test_command(tmp_path: Path) -> None:
    """A page and its PDF; nothing is replaced unasked, and what cannot be done is refused with status 2."""
    time, page = np.linspace(0.0, 0.75, 751), tmp_path / "new" / "page.html"
    run = write_results(tmp_path / "run", time, sine_records(time))
    done = called_in_turn(
        ("report", run, "--output", page),
        ("report", run, "--output", page),
        ("report", run, "--output", tmp_path / "page.pdf"),
        ("report", tmp_path),
        ("report", run, "--output", run / SUMMARY_FILE / "page.html"),
    )
    assert [one.returncode for one in done] == [0, 2, 2, 2, 2], done
    assert done[0].stdout.split() == [str(page), str(page.with_suffix(".pdf"))]
    assert "period 3" in "".join(sheet.extract_text() for sheet in PdfReader(page.with_suffix(".pdf")).pages)
    for one, words in zip(
        done[1:], ("pass --overwrite", "ends in .html", "a results folder", "not a folder"), strict=True
    ):
        assert words in one.stderr


def test_without_a_browser_there_is_the_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """The page is written, the log says how to get the PDF; only who asked for the PDF gets a status."""
    time = np.linspace(0.0, 0.5, 501)
    run = write_results(tmp_path / "run", time, sine_records(time))
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("GAPBEAM_BROWSER", raising=False)
    with caplog.at_level("INFO"):
        assert report([run]) == 0
    assert "install chromium" in caplog.text
    assert (run / "report.html").stat().st_size > 4e6
    assert report([run], overwrite=True, pdf=False) == 0
    with pytest.raises(BrowserError, match="install chromium") as lacking:
        report([run], overwrite=True, pdf=True)
    assert lacking.value.exit_status == 2
    monkeypatch.setenv("GAPBEAM_BROWSER", "no-such-browser")
    with pytest.raises(BrowserError, match="no-such-browser: no such program"):
        report([run], overwrite=True, pdf=True)
    assert not (run / "report.pdf").exists()


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0, "0"), (12, "12"), (123456, "123\u202f456"), (0.0123456, "0.01235"), (-1.23456e-7, "−1.235\u00a0×\u00a010⁻⁷"),
     (99999.9, "100\u202f000"), (12345.6, "12\u202f350"), (1.0e6, "1.000\u00a0×\u00a010⁶"), (9.9999, "10.00"),
     (float("nan"), "–")],
)  # fmt: skip
def test_numbers(value: float, text: str) -> None:
    """Four digits that count, integers whole, a true minus sign, powers of ten where they are shorter."""
    assert number(value) == text


@pytest.mark.parametrize(
    ("fraction", "text"), [(0.5, "+50 %"), (-0.0042, "−0.42 %"), (0.0, "0 %"), (None, "–"), (12.3456, "+1235 %")]
)
def test_percent(fraction: float | None, text: str) -> None:
    """Signed, two digits, whole percents where they are many."""
    assert percent(fraction) == text
