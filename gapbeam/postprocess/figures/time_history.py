"""Figure: displacement and acceleration over the whole record, and an enlarged part of it."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gapbeam.postprocess.display_units import shown
from gapbeam.postprocess.figures.figure_style import BLACK, GRAY, letter, limits_around, panels
from gapbeam.postprocess.signals.enlarged_part import enlarged_span
from gapbeam.postprocess.signals.probe_analysis import Analysis
from gapbeam.postprocess.signals.signal import Signal

_NARROW = 0.02


def draw_time_history(analysis: Analysis, zoom: int = 3) -> Figure:
    """Draw displacement and acceleration, raw and smoothed; left the whole record, right a part of it.

    Args:
        analysis: With a displacement.
        zoom: Forcing periods on the right; without forcing the tenth of the record where most happens.
    """
    rows = [signal for signal in (analysis.displacement, analysis.acceleration) if signal is not None]
    figure, axes = panels(len(rows), 2, height=1.75, sharey="row", sharex="col", width_ratios=[1.5, 1.0])
    frequency = analysis.forcing_frequency
    motion = rows[-1].signal
    span = enlarged_span(motion.time, motion.values, frequency, zoom)
    for row, (whole, end) in zip(rows, axes, strict=True):
        if frequency is not None:  # each record to its own end
            span = enlarged_span(row.signal.time, row.signal.values, frequency, zoom)
        signal, last = row.signal, row.signal.between(*span)
        unit, factor = shown(signal.unit)
        smoothed = analysis.smoothed.signal if analysis.smoothed and row is analysis.acceleration else None
        for panel, part in ((whole, signal), (end, last)):
            if smoothed is None:
                panel.plot(1e3 * part.time if panel is end else part.time, factor * part.values, color=BLACK, lw=0.7)
            else:
                _both(panel, part, smoothed, factor, 1e3 if panel is end else 1.0, thin=panel is whole)
        limits_around(whole, factor * signal.values)
        whole.axvspan(last.time[0], last.time[-1], color=GRAY, alpha=0.25, lw=0)
        whole.set_ylabel(f"{signal.name} ({unit})")
        if smoothed is not None:
            end.legend(loc="lower right", bbox_to_anchor=(1.0, 0.98), ncols=2, borderaxespad=0.0, columnspacing=1.2)
        if frequency is not None:
            _period_grid(end, last, frequency)
    axes[-1][0].set_xlabel("time (s)")
    axes[-1][1].set_xlabel("time (ms)")
    for panel in (axes[-1][0], axes[-1][1]):
        panel.locator_params(axis="x", nbins=7)
    letter(list(axes.flat))
    return figure


def _both(panel: Axes, raw: Signal, smoothed: Signal, factor: float, scale: float, thin: bool) -> None:
    panel.plot(scale * raw.time, factor * raw.values, color=GRAY, lw=0.5, label="as recorded")
    keep = (smoothed.time >= raw.time[0]) & (smoothed.time <= raw.time[-1])
    panel.plot(
        scale * smoothed.time[keep],
        factor * smoothed.values[keep],
        color=BLACK,
        lw=0.6 if thin else 1.1,
        label="moving average",
    )


def _period_grid(panel: Axes, part: Signal, frequency: float) -> None:
    first = np.ceil(part.time[0] * frequency - _NARROW)
    for j in np.arange(first, np.floor(part.time[-1] * frequency + _NARROW) + 1):
        panel.axvline(1e3 * j / frequency, color=GRAY, lw=0.5, ls=":", zorder=0)
