"""`gapbeam report --from --to`: statistics, spectra, peaks and impacts of a span of time, and what it refuses."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest

import gapbeam
from gapbeam.commands.study_choice import report_kinds
from gapbeam.postprocess.report.charts import Chart
from gapbeam.postprocess.report.folder_report import span_report
from gapbeam.postprocess.report.moving_scene import MovingScene
from gapbeam.postprocess.results.columns_of_run import impacts_of
from gapbeam.postprocess.results.run_watch import span_of
from gapbeam.postprocess.results_errors import OptionError
from gapbeam.studies.write_report import statistics_of_span, wear_of_span, write_report
from tests.regression.test_random_statistics_run import CASE, KEYS
from tests.regression.test_report_command import blocks_of, tables
from tests.shared.command import called_in_turn
from tests.unit.test_postprocess_synthetic import write_results

SLOW, FAST, CHANGE = 20.0, 50.0, 1.0  # Hz, Hz, s


@pytest.fixture(scope="module")
def changing(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return results of 2 mm at 20 Hz up to 1 s, and of 1 mm at 50 Hz from then on."""
    time = np.linspace(0.0, 2.0, 4001)
    moved = np.where(
        time < CHANGE, 2.0e-3 * np.sin(2.0 * np.pi * SLOW * time), 1.0e-3 * np.sin(2.0 * np.pi * FAST * time)
    )
    folder = tmp_path_factory.mktemp("span") / "run"
    return write_results(folder, time, {"displacement": moved, "impulse": 3.0 * time}, frequency=None)


@pytest.mark.parametrize(
    ("begin", "end", "frequency", "height"),
    [(None, 0.9995, SLOW, 2.0), (1.0, None, FAST, 1.0), (1.25, 1.75, FAST, 1.0)],
)
def test_spectra_and_peaks_are_those_of_the_span(
    changing: Path, begin: float | None, end: float | None, frequency: float, height: float
) -> None:
    """A motion whose frequency changes at 1 s shows one frequency, and one height, before and behind."""
    made = span_report(span_of(changing, begin, end), None, "c")
    chart = next(
        one
        for one in blocks_of(made.sections)
        if isinstance(one, Chart) and one.caption.startswith("Amplitudes of the d")
    )
    curve = chart.curves[0]
    assert curve.x[int(np.argmax(curve.y))] == pytest.approx(frequency, abs=2.0)
    peaks = {row[1]: row for row in tables(made)["Peaks of the whole record, and of a forcing period"].rows}
    assert peaks["displacement (mm)"][4] == pytest.approx(height, rel=0.02)
    first, last = 0.0 if begin is None else begin, 2.0 if end is None else end
    faces = tables(made)["The faces over the whole record, at the recorded instants"].rows
    assert [row[-1] for row in faces] == pytest.approx([3.0 * (last - first)] * 2, rel=1e-6)


def test_statistics_and_impacts_are_those_of_the_span(tmp_path: Path) -> None:
    """Rates and shares follow from the differences of the records, and impacts from the list."""
    outcome = gapbeam.run(CASE, KEYS, tmp_path / "run")
    assert outcome.exit_status == 0, outcome.message
    run = span_of(tmp_path / "run", 0.1, 0.25)
    statistics = statistics_of_span(run)
    assert statistics is not None
    assert statistics["seconds"] == pytest.approx(0.15)
    found = {one["name"]: one["value"] for one in statistics["figures"]}
    with h5py.File(tmp_path / "run" / "history.h5") as file:
        history = {name: file[name][:] for name in ("time", "contact_time", "impulse", "closings", "displacement")}
    inside = (history["time"] >= 0.1 + statistics["burn_in"] - 1.0e-9) & (history["time"] <= 0.25 + 1.0e-9)
    rest = {name: values[inside] for name, values in history.items()}
    span = rest["time"][-1] - rest["time"][0]
    for variable, figure in (("contact_time", "contact_share"), ("impulse", "mean_force"), ("closings", "impact_rate")):
        for face, name in enumerate(("base", "gland")):
            change = (rest[variable][-1, face] - rest[variable][0, face]) / span
            assert found[f"face.{name}.{figure}"] == pytest.approx(change, rel=0.03), figure
    assert found["probe.tip.rms"] == pytest.approx(np.std(rest["displacement"][1:, -1, 1]), rel=0.02)
    assert not any(name.endswith(("rms_force", "approach_speed")) for name in found)
    titles = [section.title for section in span_report(run, statistics, "c").sections]
    assert titles[:3] == ["Summary", "Statistics", "Motion"]
    assert {"Impacts", "Energy"} <= set(titles)
    assert not {"Margins", "Computation", "Wear"} & set(titles)
    every = impacts_of(tmp_path / "run")
    for face, rows in run.impacts.items():
        assert len(rows) == np.sum((every[face][:, 0] >= 0.1) & (every[face][:, 0] <= 0.25 + 1.0e-9))


def test_scene_energy_and_wear_are_those_of_the_span(tmp_path: Path) -> None:
    """Fields of the span only; a balance that closes; the work of its records, in parts, with its intervals."""
    worn = (*KEYS, "wear.coefficient=2e-14", "wear.area=1e-5")
    outcome = gapbeam.run(CASE, worn, tmp_path / "run")
    assert outcome.exit_status == 0, outcome.message
    run = span_of(tmp_path / "run", 0.1, 0.25)
    statistics = statistics_of_span(run)
    assert statistics is not None
    made = span_report(run, statistics, "c", wear_of_span(run, statistics))
    (scene,) = [one for one in blocks_of(made.sections) if isinstance(one, MovingScene)]
    assert scene.times == pytest.approx(np.arange(0.10, 0.251, 0.02), abs=1e-9)
    history = run.history
    balance = tables(made)["Energy from t = 0.1 s on: the last line is the sum of those above"].rows
    entries = {str(row[0]): float(row[1]) for row in balance}
    stored = entries.pop("stored more than at the start of the span")
    assert sum(entries.values()) == pytest.approx(stored, abs=1e-9 * max(map(abs, entries.values())) + 1e-12)
    damping = history["structural_dissipation"].values
    assert entries["lost to structural damping"] == pytest.approx(-1e3 * (damping[-1] - damping[0]), rel=1e-9)
    parts = {row[0]: row for row in tables(made)["By which motion"].rows}
    rates = {(row[0], row[1]): row for row in tables(made)["How fast the faces wear"].rows}
    for face in ("base", "gland"):
        work = history["sliding_work"].sel(worn_face=face).values
        assert parts[face][1] == pytest.approx(work[-1] - work[0], rel=1e-9)
        later = np.searchsorted(history["time"].values, 0.1 + statistics["burn_in"] - 1e-9)
        mean = (work[-1] - work[later]) / (0.15 - statistics["burn_in"])
        assert rates[face, "work rate"][2] == pytest.approx(mean, rel=0.03), "behind the burn-in"
        assert rates[face, "depth rate"][2] == pytest.approx(2e-9 * rates[face, "work rate"][2], rel=1e-9)
        assert " to " in str(rates[face, "work rate"][4])
    brief = span_report(span_of(tmp_path / "run", 0.1, 0.115), None, "c")
    assert any("fewer than three fields" in str(one) for one in blocks_of(brief.sections))


def test_spans_that_are_none_are_refused(changing: Path, tmp_path: Path) -> None:
    """Reversed, without records, with one only, of two runs, of a folder without a history: what was expected."""
    for folders, begin, end, words in (
        ([changing], 1.5, 0.5, r"from 1\.5 to 0\.5 s; expected an end behind the begin; try from 0\.5 to 1\.5 s"),
        ([changing], 3.0, None, "no record from 3 s to the end; the run has records from 0 to 2 s"),
        ([changing], 1.0, 1.0, "one record only, at 1 s"),
        ([changing, changing], 0.0, 1.0, "a span of time of 2 folders; expected one run"),
        ([tmp_path], 0.0, 1.0, r"holds no history\.h5; expected the folder of a run"),
    ):
        with pytest.raises(OptionError, match=words):
            write_report(folders, report_kinds(), tmp_path / "page.html", False, begin=begin, end=end)
    assert not (tmp_path / "page.html").exists()


@pytest.mark.slow(minutes=0.2)
def test_the_command(changing: Path, tmp_path: Path) -> None:
    """A page that names its span and the command that makes it; a reversed one is refused with status 2."""
    page, other = tmp_path / "page.html", tmp_path / "other.html"
    made, refused = called_in_turn(
        ("report", changing, "--from", "0.5", "--to", "1.5", "--no-pdf", "--output", page),
        ("report", changing, "--from", "1.5", "--to", "0.5", "--no-pdf", "--output", other),
    )
    assert made.returncode == 0, made.stderr
    text = page.read_text(encoding="utf-8")
    assert "from t = 0.5 to 1.5 s" in text
    assert "--from 0.5 --to 1.5" in text
    assert refused.returncode == 2
    assert "expected an end behind the begin" in refused.stderr
