"""Figure: amplitude spectra of the acceleration, as recorded and smoothed, with the harmonics marked."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from gapbeam.postprocess.display_units import shown
from gapbeam.postprocess.figures.figure_style import BLACK, BLUE, GRAY, letter, panels
from gapbeam.postprocess.signals.probe_analysis import Analysis, SignalAnalysis

_DECADES = 4.0
_SHORT = {"1/2": "½", "1/3": "⅓"}


def draw_amplitude_spectrum(analysis: Analysis, highest: int = 10) -> Figure:
    """Draw amplitude over frequency: displacement left, acceleration right, on logarithmic axes of amplitude.

    Args:
        analysis: With at least one spectrum.
        highest: Highest harmonic shown; without forcing the whole band is.
    """
    left, right = analysis.displacement, analysis.acceleration
    shown_panels = [one for one in (left, right) if one is not None and one.spectrum is not None]
    figure, axes = panels(1, len(shown_panels), height=2.5)
    frequency = analysis.forcing_frequency
    for panel, one in zip(axes[0], shown_panels, strict=True):
        smoothed = analysis.smoothed if one is right else None
        smoothed = smoothed if smoothed is not None and smoothed.spectrum is not None else None
        _lines(panel, one, BLACK if smoothed is None else GRAY, "as recorded")
        _marks(panel, one, BLACK if smoothed is None else GRAY, filled=True)
        if smoothed is not None:
            _lines(panel, smoothed, BLACK, "moving average")
            _marks(panel, smoothed, BLACK, filled=False)
            figure.legend(*panel.get_legend_handles_labels(), loc="outside upper right", ncols=2)
        unit, _ = shown(one.signal.unit)
        panel.set_xlabel("frequency (Hz)")
        panel.set_ylabel(f"amplitude of {one.signal.name} ({unit})")
        _limits(panel, [part for part in (one, smoothed) if part is not None], frequency, highest)
        if frequency is not None:
            _orders(panel, one, frequency, highest)
    letter(list(axes.flat), pad=11.0)
    return figure


def _lines(panel: Axes, one: SignalAnalysis, color: str, label: str) -> None:
    lines = one.spectrum
    assert lines is not None
    _, factor = shown(one.signal.unit)
    panel.semilogy(
        lines.frequency[1:],
        np.maximum(factor * lines.amplitude[1:], 1e-300),
        color=color,
        lw=0.8,
        label=label,
    )


def _marks(panel: Axes, one: SignalAnalysis, color: str, filled: bool) -> None:
    _, factor = shown(one.signal.unit)
    for row in one.harmonics:
        whole = row.order.denominator == 1
        if not whole and not filled:
            continue
        panel.plot(
            row.frequency,
            factor * row.amplitude,
            marker="o" if whole else "D",
            ms=3.2 if whole else 3.6,
            color=color if whole else BLUE,
            mfc=color if filled and whole else "white",
            mew=0.8,
            zorder=5,
        )


def _limits(panel: Axes, parts: list[SignalAnalysis], frequency: float | None, highest: int) -> None:
    tops, floors = [], []
    limit = np.inf if frequency is None else (highest + 0.5) * frequency
    for one in parts:
        lines = one.spectrum
        assert lines is not None
        amplitude = shown(one.signal.unit)[1] * lines.amplitude[1:][lines.frequency[1:] <= limit]
        tops.append(float(amplitude.max()))
        floors.append(float(np.median(amplitude)))
        floors += [shown(one.signal.unit)[1] * row.amplitude for row in one.harmonics]
    top = max(tops) or 1.0
    floor = max(min([value for value in floors if value > 0.0] or [top]), 10.0**-_DECADES * top)
    panel.set_ylim(0.3 * min(floor, 1e-2 * top), 2.5 * top)
    spectrum = parts[0].spectrum
    assert spectrum is not None
    panel.set_xlim(0.0, min(limit, float(spectrum.frequency[-1])))
    panel.yaxis.set_major_locator(LogLocator(10.0, numticks=9))
    panel.yaxis.set_minor_locator(LogLocator(10.0, subs=tuple(range(2, 10)), numticks=9))
    panel.yaxis.set_minor_formatter(NullFormatter())


def _orders(panel: Axes, one: SignalAnalysis, frequency: float, highest: int) -> None:
    """Number the harmonics along the top."""
    for order in range(1, highest + 1):
        if order * frequency <= panel.get_xlim()[1]:
            panel.axvline(order * frequency, color=GRAY, lw=0.4, ls=":", zorder=0)
    for row in one.harmonics:
        panel.text(
            row.frequency, 1.01, _SHORT.get(str(row.order), str(row.order)),
            transform=panel.get_xaxis_transform(), fontsize=7, va="bottom",
            ha="right" if str(row.order) == "1/3" else "center",
        )  # fmt: skip
