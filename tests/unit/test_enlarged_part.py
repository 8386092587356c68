"""The part of a record that figures enlarge."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from gapbeam.postprocess.plot import plot
from gapbeam.postprocess.results.results import open_results
from gapbeam.postprocess.signals.signal import enlarged_span
from tests.unit.test_postprocess_synthetic import write_results

TIME = np.linspace(0.0, 2.0, 4001)


def ringing(start: float) -> np.ndarray:
    """A shock at a time, ringing down after it."""
    late = np.clip(TIME - start, 0.0, None)
    return -0.3 + np.exp(-20.0 * late) * np.sin(400.0 * late)


@pytest.mark.parametrize("shock", [0.0, 0.2, 0.73, 1.9])
def test_a_shock_is_in_it_with_its_onset(shock: float) -> None:
    start, end = enlarged_span(TIME, ringing(shock), None, 3)
    assert end - start == pytest.approx(0.2)
    assert start <= shock <= shock + 0.08 <= end + 1e-9


def test_forcing_shows_its_last_periods() -> None:
    assert enlarged_span(TIME, ringing(0.2), 20.0, 3) == pytest.approx((1.85, 2.0))
    assert enlarged_span(TIME, ringing(0.2), 1.0, 3) == pytest.approx((0.0, 2.0))


@pytest.mark.parametrize("values", [np.zeros(4001), np.full(4001, 7.0)])
def test_where_nothing_happens_it_is_the_end(values: np.ndarray) -> None:
    assert enlarged_span(TIME, values, None, 3) == pytest.approx((1.8, 2.0))


def test_figures_show_the_shock(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The right panels of time histories, contact forces and energies hold the shock, not the end of the record."""
    shown: dict[str, tuple[float, float]] = {}

    def look(figure: Figure, _folder: Path, name: str, _formats: object) -> list[Path]:
        shown[name] = figure.axes[min(1, len(figure.axes) - 1)].get_xlim()
        return []

    monkeypatch.setattr("gapbeam.postprocess.plot.save", look)
    force = np.maximum(ringing(0.73) + 0.3, 0.0)
    motion = {name: ringing(0.73) for name in ("displacement", "acceleration_absolute", "acceleration_relative")}
    folder = write_results(tmp_path, TIME, {**motion, "contact_force": force, "kinetic_energy": force}, frequency=None)
    plot(open_results(folder).folder)
    for name in ("time_history", "contact", "energy"):
        low, high = shown[name]
        assert low < 730.0 < 800.0 < high < 1000.0, name
