"""What is shown of scenes of any size, watch parts and ships alike: three digits of lengths, times that differ."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from gapbeam.postprocess.display_units import size_words
from gapbeam.postprocess.results.columns_of_run import distinct
from gapbeam.postprocess.results.results import open_results
from gapbeam.postprocess.signals.probe_analysis import analyze, as_text
from gapbeam.solver.run.output.progress import ProgressLine
from gapbeam.studies.error_estimate.closing_table import closing_table, with_unit
from gapbeam.studies.error_estimate.figure_errors import FigureError
from tests.unit.test_postprocess_synthetic import write_results

METERS = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "nm": 1e-9}
CHANCE = np.random.default_rng(20260729)
SIZES = (10.0 ** CHANCE.uniform(-9.0, 2.0, 24)).tolist()


def meters(words: str) -> float:
    """Return a length that stands in words, m."""
    number, unit = words.split()[-2:]
    return float(number) * METERS[unit]


@pytest.mark.parametrize("size", SIZES)
def test_lengths_keep_their_digits_and_no_row_of_zeros(size: float) -> None:
    """With three digits and at most one zero behind the point, as the value and as its error in the unit of both."""
    for words in (with_unit(size, "m"), with_unit(-size, "m").replace("-", ""), size_words(size, 3)):
        assert meters(words) == pytest.approx(size, rel=5.01e-3)
        assert "e" not in words
        assert not re.search(r"0\.00", words)
    one = FigureError("tip peak-to-peak displacement", "m", "whole run", size, 2.2 * size, {}, 0.0)
    (row,) = closing_table([one], 1.0, True).rows
    assert meters(row.interval) == pytest.approx(2.2 * size, rel=0.05)
    assert row.interval.split()[-1] == row.value.split()[-1]


@pytest.mark.parametrize(("size", "period"), zip(SIZES[:8], 10.0 ** CHANCE.uniform(-7.0, 2.0, 8), strict=True))
def test_tables_of_a_motion_have_its_amplitude_and_times(tmp_path: Path, size: float, period: float) -> None:
    """A sin(2 pi t / T) over 9.9 periods: its extremes by value and by time, whatever A and T."""
    time = np.linspace(0.0, 9.9 * period, 9901)
    motion = size * (1.0 + 1e-3 * time / time[-1]) * np.sin(2.0 * np.pi * time / period)  # the last peak is the highest
    write_results(tmp_path / "run", time, {"displacement": motion}, frequency=1.0 / period)
    text = as_text(analyze(open_results(tmp_path / "run")))
    unit, numbers = re.findall(r"displacement, (\w+) +(.*)", text)[0]
    lowest, low_at, highest, high_at, _ = map(float, numbers.split())
    assert METERS[unit] * lowest == pytest.approx(-size, rel=2e-3)
    assert METERS[unit] * highest == pytest.approx(size, rel=2e-3)
    assert low_at == pytest.approx(9.75 * period, rel=1e-3)
    assert high_at == pytest.approx(9.25 * period, rel=1e-3)


@pytest.mark.parametrize("period", 10.0 ** CHANCE.uniform(-10.0, 3.0, 6))
def test_states_of_the_settled_part_are_as_many_at_any_period(tmp_path: Path, period: float) -> None:
    """Twenty periods of a sine: those of the last twelve, whatever T."""
    time = np.linspace(0.0, 20.0 * period, 4001)
    write_results(tmp_path / "run", time, {"displacement": np.sin(2.0 * np.pi * time / period)}, frequency=1.0 / period)
    analysis = analyze(open_results(tmp_path / "run"))
    assert analysis.section is not None
    reach = max(analysis.settled_since(), 8.0 * period)
    wanted = np.round(analysis.section.time / period) >= np.round(reach / period)
    assert analysis.settled_states().tolist() == wanted.tolist()


@pytest.mark.parametrize("size", SIZES[:8])
def test_places_differ_at_any_size(size: float) -> None:
    """Forty places, each met by three points that round-off moves."""
    places = size * np.repeat(np.linspace(1.0, 1.01, 40), 3) * (1.0 + 1e-15 * CHANCE.uniform(-1.0, 1.0, 120))
    found, owners = distinct(CHANCE.permutation(places))
    assert found == pytest.approx(size * np.linspace(1.0, 1.01, 40), rel=1e-8)
    assert np.bincount(owners).tolist() == [3] * 40


@pytest.mark.parametrize("periods", [None, 0.003, 0.2, 1.0, 9.9, 77.7])
@pytest.mark.parametrize("end", 10.0 ** CHANCE.uniform(-10.0, 4.0, 12))
def test_the_progress_of_a_run_is_seen(end: float, periods: float | None) -> None:
    """Two hundredths of a run, one after the other, differ in words; forced ones stood at period 0.0 of 0.2."""
    progress = ProgressLine(end, None if periods is None else end / periods, quiet=True)
    assert progress._place(0.37 * end) != progress._place(0.38 * end)
    assert len(progress._place(0.37 * end)) < 30
