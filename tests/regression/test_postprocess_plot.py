"""Figures and tables: all that the results allow are made and hold something; the rest is said, not drawn."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from gapbeam.postprocess.figures.motion_figures import draw_energy
from gapbeam.postprocess.plot import plot
from gapbeam.postprocess.results.results import open_results
from gapbeam.postprocess.results_errors import OptionError
from gapbeam.postprocess.signals.probe_analysis import Options, analyze, as_text
from gapbeam.postprocess.signals.signal import SignalError
from gapbeam.solver.schema.record_table import CASE_FILE
from tests.unit.test_postprocess_synthetic import write_results

FORCING = 20.0
FIGURES = {"time_history", "phase_portrait", "period_peaks", "spectrum", "contact", "energy"}


def sine_records(time: np.ndarray) -> dict[str, np.ndarray]:
    """A forced motion of period 3 in closed form; accelerations as means over the intervals."""
    step, omega = time[1] - time[0] if time.size > 1 else 1e-3, 2 * np.pi * FORCING
    velocity = lambda t: omega * (2e-3 * np.cos(omega * t) + 1e-4 * np.cos(omega * t / 3) / 3)  # noqa: E731
    return {
        "displacement": 2e-3 * np.sin(omega * time) + 1e-4 * np.sin(omega * time / 3),
        "velocity": velocity(time),
        "acceleration_absolute": (velocity(time) - velocity(time - step)) / step,
        "acceleration_relative": 0 * time,
        "contact_force": 50.0 + 40.0 * np.sin(omega * time),
        "penetration": 1e-6 * np.sin(omega * time),
        "kinetic_energy": np.cos(omega * time) ** 2,
        "energy_residual": 1e-9 * time,
    }


def blank(path: Path) -> bool:
    with Image.open(path) as picture:
        return np.asarray(picture.convert("L"), dtype=float).std() < 2.0


@pytest.fixture(scope="module")
def forced(tmp_path_factory: pytest.TempPathFactory) -> Path:
    time = np.linspace(0.0, 1.25, 12501)
    return write_results(tmp_path_factory.mktemp("run") / "forced", time, sine_records(time), probes=("middle", "tip"))


@pytest.mark.slow(minutes=0.1)
def test_every_figure_is_made_and_none_is_blank(forced: Path) -> None:
    paths = plot(forced)
    assert {path.stem for path in paths if path.suffix == ".png"} == FIGURES
    assert all(path.parent == forced / "figures" for path in paths)
    for path in paths:
        assert path.stat().st_size > 0
        if path.suffix == ".png":
            assert not blank(path), path.name


@pytest.mark.slow(minutes=0.1)
def test_figures_have_the_widths_of_a_journal(forced: Path, tmp_path: Path) -> None:
    for path in plot(forced, tmp_path):
        if path.suffix == ".png":
            with Image.open(path) as picture:
                assert picture.width / 300 * 25.4 == pytest.approx(175.0, abs=0.5)


@pytest.mark.slow(minutes=0.2)
def test_vector_formats(forced: Path, tmp_path: Path) -> None:
    paths = plot(forced, tmp_path, formats=("pdf", "svg"), probe="tip", component="x", acceleration="relative")
    assert {path.suffix for path in paths} == {".pdf", ".svg", ".txt", ".json"}
    assert (tmp_path / "contact.pdf").read_bytes().startswith(b"%PDF")


def test_unknown_options_are_refused(forced: Path, tmp_path: Path) -> None:
    with pytest.raises(OptionError, match="jpg: expected some of png, pdf, svg"):
        plot(forced, tmp_path, formats=("jpg",))
    with pytest.raises(SignalError, match="no probe named 'end'; there are middle, tip"):
        plot(forced, tmp_path, probe="end")


def test_analysis_finds_the_amplitudes_and_the_period_that_were_put_in(forced: Path) -> None:
    analysis = analyze(open_results(forced))
    assert analysis.probe == "middle"
    assert analysis.component == "y"
    assert analysis.periodicity is not None
    assert analysis.periodicity.period == 3
    assert analysis.displacement is not None
    assert analysis.displacement.spectrum is not None
    assert analysis.displacement.spectrum.periods == 24
    table = {str(row.order): row.amplitude for row in analysis.displacement.harmonics}
    assert table["1"] == pytest.approx(2e-3, abs=1e-10)
    assert table["1/3"] == pytest.approx(1e-4, abs=1e-10)
    assert table["1/2"] == pytest.approx(0.0, abs=1e-10)
    assert analysis.smoothed is not None
    omega, width = 2 * np.pi * FORCING, 2.5e-3
    gain = np.sinc(FORCING * width)  # the mean over 2.5 ms
    smoothed = {str(row.order): row.amplitude for row in analysis.smoothed.harmonics}
    assert smoothed["1"] == pytest.approx(2e-3 * omega**2 * gain, rel=1e-9)


@pytest.mark.slow(minutes=0.1)
def test_tables_and_data_say_the_same(forced: Path, tmp_path: Path) -> None:
    plot(forced, tmp_path)
    text, data = (tmp_path / "tables.txt").read_text(), json.loads((tmp_path / "figures.json").read_text())
    assert "period 3: a cycle of 3 forcing periods" in text
    assert "displacement, mm" in text
    assert data["periodicity"]["period"] == 3
    assert set(data["figures"]) == FIGURES
    first = next(row for row in data["signals"]["displacement"]["harmonics"] if row["order"] == "1")
    assert f"{1e3 * first['amplitude']:.5g}" in text
    assert data["status"] == "completed"


@pytest.mark.slow(minutes=0.1)
def test_without_forcing_there_are_no_periods(tmp_path: Path) -> None:
    time = np.linspace(0.0, 0.5, 5001)
    folder = write_results(tmp_path, time, sine_records(time), frequency=None)
    paths = plot(folder)
    assert {path.stem for path in paths if path.suffix == ".png"} == FIGURES - {"period_peaks"}
    text = (folder / "figures" / "tables.txt").read_text()
    assert "the forcing has no period" in text
    assert "Periodicity" not in text


def test_without_probes_contact_and_energy_are_drawn(tmp_path: Path) -> None:
    time = np.linspace(0.0, 0.5, 501)
    folder = write_results(tmp_path, time, sine_records(time), probes=())
    paths = plot(folder)
    assert {path.stem for path in paths if path.suffix == ".png"} == {"contact", "energy"}
    assert "recorded no probe" in (folder / "figures" / "tables.txt").read_text()


def test_one_record_only(tmp_path: Path) -> None:
    folder = write_results(tmp_path, np.zeros(1), sine_records(np.zeros(1)))
    paths = plot(folder)
    assert {path.stem for path in paths if path.suffix == ".png"} == {"contact", "energy"}
    assert "one record only" in (folder / "figures" / "tables.txt").read_text()


@pytest.mark.parametrize("loss", [0.0, 2.0, None])
def test_friction_is_in_the_energy_figure_where_there_is_any(tmp_path: Path, loss: float | None) -> None:
    time = np.linspace(0.0, 0.5, 501)
    records = sine_records(time) | {"friction_dissipation": (loss or 0.0) * time}
    history = open_results(write_results(tmp_path, time, records)).history
    if loss is None:  # a run before there was friction
        history = history.drop_vars("friction_dissipation")
    ledger = draw_energy(history, FORCING).axes[2]
    drawn = {str(line.get_label()): line.get_ydata() for line in ledger.get_lines()}
    assert {"structural damping", "contact damping", "scheme"} <= set(drawn)
    assert ("friction" in drawn) == bool(loss)
    if loss:
        assert np.asarray(drawn["friction"]) == pytest.approx(loss * time)


@pytest.mark.parametrize(
    "count", [2, *(pytest.param(one, marks=pytest.mark.slow(minutes=0.1)) for one in (3, 7, 60, 501))]
)
def test_short_records_are_drawn_as_far_as_they_go(tmp_path: Path, count: int) -> None:
    time = np.arange(count) * 1e-4
    folder = write_results(tmp_path, time, sine_records(time))
    paths = plot(folder)
    assert {"time_history", "contact", "energy"} <= {path.stem for path in paths}
    assert "Warnings" in (folder / "figures" / "tables.txt").read_text()


@pytest.mark.parametrize("name", ["displacement", "acceleration_absolute", "contact_force", "kinetic_energy"])
def test_values_that_are_not_finite_are_refused_by_name(tmp_path: Path, name: str) -> None:
    time = np.linspace(0.0, 0.5, 501)
    records = sine_records(time)
    records[name] = np.where(np.arange(501) == 300, np.nan, records[name])
    with pytest.raises(SignalError, match=f"{name.split('_', maxsplit=1)[0]}.*not finite"):
        plot(write_results(tmp_path, time, records))


def test_aliasing_and_short_spans_are_among_the_warnings(tmp_path: Path) -> None:
    time = np.linspace(0.0, 0.5, 501)
    records = sine_records(time)
    records["displacement"] = records["displacement"] + 1e-3 * np.cos(np.pi * np.arange(501))
    analysis = analyze(open_results(write_results(tmp_path, time, records)), Options(periods=4, rate=2000.0))
    text = as_text(analysis)
    assert "near half the sampling rate" in text
    assert "fall between lines" in text
    assert "not smoothed: acceleration: recorded at 1000 Hz" in text


def test_a_3d_run_is_analyzed_in_its_bending_direction(tmp_path: Path) -> None:
    time = np.linspace(0.0, 0.5, 501)
    folder = write_results(tmp_path, time, sine_records(time), dimension=3)
    analysis = analyze(open_results(folder))
    assert analysis.component == "z"
    assert analysis.displacement is not None
    assert analysis.displacement.peaks.maximum > 1e-3


@pytest.mark.slow(minutes=0.1)
def test_periodic_responses_are_analyzed_as_they_repeat(tmp_path: Path) -> None:
    """One computed period of three forcing periods is a cycle of 3, with nothing undecided or transient."""
    time = np.linspace(0.0, 3.0 / FORCING, 1501)
    folder = write_results(tmp_path / "orbit", time, sine_records(time))
    with (folder / CASE_FILE).open("a", encoding="utf-8") as case:
        case.write('[analysis]\ntype = "periodic"\n')
    plot(folder)
    words = json.loads((folder / "figures" / "figures.json").read_text(encoding="utf-8"))
    assert words["periodicity"]["period"] == 3
    assert words["periodicity"]["transient"] == 0.0
    assert not [text for text in words["warnings"] if "transient" in text or "settled" in text or "no multiple" in text]
    amplitudes = {row["order"]: row["amplitude"] for row in words["signals"]["displacement"]["harmonics"]}
    assert amplitudes["1"] == pytest.approx(2e-3, rel=1e-6)
    assert amplitudes["1/3"] == pytest.approx(1e-4, rel=1e-6)
    text = (folder / "figures" / "tables.txt").read_text(encoding="utf-8")
    assert "undecided" not in text
    assert "shown as it repeats" in text
