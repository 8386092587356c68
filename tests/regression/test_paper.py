"""The paper computed again: its data, the experiment with what was identified, and the page a reader opens."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import sync_playwright

from gapbeam.postprocess.report.blocks import Chart, Report, ReportSection, TableBlock, Verdict
from gapbeam.postprocess.report.html_page import write_html
from gapbeam.postprocess.report.pdf_page import OPTIONS, find_browser
from gapbeam.solver.errors import RunError
from gapbeam.solver.record_table import STANDARD_GRAVITY as G
from gapbeam.studies.identification.identification_file import read_identification
from gapbeam.studies.paper.clearance_series import ClearanceResponse, motions
from gapbeam.studies.paper.experiment_figures import (
    extremes,
    figure_seventeen,
    harmonics,
    millimeters,
    rises,
    spectra,
    table_four,
    waveforms,
)
from gapbeam.studies.paper.identified_values import CASE, _started, copied, placed
from gapbeam.studies.paper.printed_figures import printed
from tests.shared.command import alone, called
from tests.shared.processes import LONGEST

pytestmark = alone
COMMAND = "gapbeam paper"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the case of the experiment and its identifications."""
    path = tmp_path_factory.mktemp("section-4")
    copied(path)
    return path


@pytest.fixture(scope="module")
def moved(folder: Path) -> list[ClearanceResponse]:
    """Return the experiment at its seven clearances, with the values in its case."""
    return motions(folder / CASE, [1e-3 * value for value in printed()["experiment"]["clearance_mm"]], {})


def test_pads_less_the_beam_are_the_clearances():
    experiment = printed()["experiment"]
    pads = np.array(experiment["pad_thickness_mm"]) - 1e3 * printed()["beam"]["thickness"]
    assert pads == pytest.approx(experiment["clearance_mm"], abs=1e-9)
    ranges = np.array(experiment["highest_g"]) - np.array(experiment["lowest_g"])
    assert ranges == pytest.approx(experiment["peak_to_peak_g"], abs=1.1e-3)


@pytest.mark.slow(minutes=0.3)
def test_the_case_of_the_experiment_gives_table_4(moved: list[ClearanceResponse]):
    """Within 15 % rms, growing monotonically with the sharpest relative rise at the smallest clearance."""
    here = np.array([motion.peak_to_peak(motion.smoothed()) for motion in moved])
    measured = np.array(printed()["experiment"]["peak_to_peak_g"])
    assert float(np.sqrt(np.mean(np.log10(here / measured) ** 2))) < 0.06
    assert np.all(np.diff(here) > 0.0)
    assert rises(moved).level == "passed"
    assert [motion.word for motion in moved] == ["period 1"] * 7


def test_rises_that_are_none_are_reported(moved: list[ClearanceResponse]):
    verdict = rises([*moved[:3], moved[5], moved[4], moved[3], moved[6]])
    assert verdict.level == "error"
    assert "does **not** grow" in verdict.text


def test_harmonics_grow_with_the_clearance(moved: list[ClearanceResponse]):
    """40 and 60 Hz of the smoothed signal, from the smallest play to the largest, as in Fig. 16."""
    table, chart, verdict = harmonics(moved, COMMAND)
    assert isinstance(table, TableBlock)
    assert isinstance(chart, Chart)
    assert isinstance(verdict, Verdict)
    rows = np.array([row[1:] for row in table.rows], dtype=float)
    assert np.all(np.diff(rows[1:, 1]) > 0.0)
    assert rows[-1, 2] > 3.0 * rows[1, 2]
    assert verdict.level == "passed"


def test_smoothed_sine_keeps_its_amplitude_as_the_average_says(moved: list[ClearanceResponse]):
    """The first harmonic of the smoothed signal is that of the raw one times sin(pi f 2.5 ms) / (pi f 2.5 ms)."""
    motion = moved[3]
    raw = np.abs(motion.windows.harmonics(motion.raw, 1)).mean() / G
    assert motion.harmonics()[0] == pytest.approx(raw * np.sinc(20.0 * 2.5e-3), rel=2e-3)


def test_a_run_that_fails_ends_the_section(folder: Path):
    """There is no figure of a march whose contact solve may not iterate."""
    settings = {"load.exciter.amplitude": 100.0, "time.max_iterations": 1, "time.max_halvings": 0}
    with pytest.raises(RunError, match=r"clearance 0\.000243 m: "):
        motions(folder / CASE, [0.243e-3], settings)


@pytest.mark.parametrize("study", ["table4", "table4-all", "table4-unknowns", "table4-place"])
def test_identifications_of_table_4_are_read_and_hold_the_table(folder: Path, study: str):
    problem = read_identification(folder / f"{study}.toml", [])
    measured = [measurement.value / G for measurement in problem.measurements]
    assert measured == pytest.approx(printed()["experiment"]["peak_to_peak_g"], rel=1e-4)
    clearances = [problem.experiments[place].settings["support.clearance"] for place in problem.places]
    assert np.array(clearances) * 1e3 == pytest.approx(printed()["experiment"]["clearance_mm"], rel=1e-9)
    assert problem.file.search.tolerance == 0.06
    assert placed(folder / CASE) == 0.28


@pytest.mark.slow(minutes=0.2)
def test_a_reader_clicks_a_clearance_and_sees_its_curve(moved: list[ClearanceResponse], tmp_path: Path):
    chart = waveforms(moved, COMMAND)
    blocks = [
        table_four(moved, [0.04e-3], COMMAND), *figure_seventeen(moved, [0.04e-3], COMMAND), extremes(moved, COMMAND),
        chart, spectra(moved, COMMAND), *harmonics(moved, COMMAND),
    ]  # fmt: skip
    page_file = write_html(Report("Paper", "", [ReportSection("Four", "four", blocks)], {}), tmp_path / "report.html")
    number = 1 + [block for block in blocks if isinstance(block, Chart)].index(chart)
    words: list[str] = []
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=find_browser(), args=list(OPTIONS[1:]))
        page = browser.new_page()
        page.on("pageerror", lambda error: words.append(str(error)))
        page.goto(page_file.as_uri())
        figure = page.locator(f"#figure-{number}")
        figure.scroll_into_view_if_needed()
        page.wait_for_selector(f"#figure-{number} .plot[data-drawn]")
        for motion in (moved[1], moved[6]):
            figure.get_by_role("button", name=millimeters(motion), exact=True).click()
            shown = page.evaluate(
                f"document.querySelector('#figure-{number} .plot')._fullData"
                ".filter((trace) => trace.visible === true).map((trace) => [trace.name, Math.max(...trace.y)])"
            )
            expected = {curve.name: max(curve.y) for curve in chart.curves if curve.choice == millimeters(motion)}
            assert dict(shown) == pytest.approx(expected)
        assert figure.locator("path.js-line").first.is_visible()
        browser.close()
    assert words == []


def test_results_of_a_run_are_not_written_over(tmp_path: Path):
    (tmp_path / "summary.json").write_text("{}")
    result = called("paper", "--output", str(tmp_path))
    assert result.returncode == 2
    assert "already holds results" in result.stderr
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["summary.json"]


def figures_named(page: str) -> set[int]:
    """Return the figures of the paper that a page names: "Fig. 4", "Figs. 11 and 12", "Figs. 4 to 6"."""
    found: set[int] = set()
    for words in re.findall(r"Figs?\. (\d+(?:(?:, | and | to )\d+)*)", page):
        found |= {int(number) for number in re.findall(r"\d+", words)}
        for first, last in re.findall(r"(\d+) to (\d+)", words):
            found |= set(range(int(first), int(last) + 1))
    return found


def test_figures_are_found_however_they_are_named():
    assert figures_named("Fig. 17: a. Figs. 11 and 12, b. Figs. 4 to 6 and 9.") == {17, 11, 12, 4, 5, 6, 9}
    assert figures_named("Figure 3, Table 4, 13 Hz") == set()


@pytest.mark.slow(minutes=20)
def test_the_paper_is_computed_again(tmp_path: Path):
    """From nothing, by one command; it says itself, by its status, whether Table 4 and its trends are reproduced."""
    result = called("paper", "--output", str(tmp_path), timeout=10.0 * LONGEST)
    assert result.returncode == 0, result.stderr
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert {4, 5, 6, 11, 12, 13, 16, 17, 20} <= figures_named(page)
    data = json.loads((tmp_path / "section-4" / "table4" / "identification.json").read_text())
    assert data["rms_log10"]["fit"] < 0.06
    assert data["rms_log10"]["predict"] < 0.06
    assert (tmp_path / "report.pdf").read_bytes().startswith(b"%PDF")


def test_another_place_starts_with_the_same_moments_about_the_edge(folder: Path):
    text = (folder / "table4-place.toml").read_text()
    known = {"contact.stiffness": 5e10, "load.exciter.amplitude": 2.3, "load.exciter.mass": 0.46}
    (folder / "moved.toml").write_text(_started(text, known, 0.28, 0.165))
    starts = {one.key: one.start for one in read_identification(folder / "moved.toml", []).file.unknown}
    assert starts == pytest.approx({**known, "load.exciter.amplitude": 4.6, "load.exciter.mass": 1.84})
