"""Figure: largest and smallest value in every forcing period."""

from __future__ import annotations

from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from gapbeam.postprocess.display_units import shown
from gapbeam.postprocess.figures.figure_style import BLACK, GRAY, VERMILION, letter, panels
from gapbeam.postprocess.signals.probe_analysis import Analysis


def draw_period_peaks(analysis: Analysis) -> Figure:
    """Draw extremes per forcing period of displacement, acceleration and smoothed acceleration.

    Args:
        analysis: With at least one signal that lasts a forcing period.
    """
    names = ("displacement", "acceleration", "smoothed acceleration")
    rows = [(name, analysis.signals[name]) for name in names if name in analysis.signals]
    rows = [(name, one) for name, one in rows if one.per_period is not None]
    figure, axes = panels(1, len(rows), height=2.1, sharex=True)
    for panel, (name, one) in zip(axes[0], rows, strict=True):
        unit, factor = shown(one.signal.unit)
        table = one.per_period
        assert table is not None
        panel.plot(table.period, factor * table.maximum, "o-", color=BLACK, ms=2.6, lw=0.6, label="maximum")
        panel.plot(
            table.period,
            factor * table.minimum,
            "s--",
            color=VERMILION,
            ms=2.6,
            lw=0.6,
            mfc="white",
            label="minimum",
        )
        panel.axhline(0.0, color=GRAY, lw=0.5, zorder=0)
        panel.set_xlabel("forcing period")
        panel.set_ylabel(f"{name} ({unit})")
        panel.margins(x=0.03, y=0.12)
        panel.xaxis.set_major_locator(MaxNLocator(6, integer=True))
    figure.legend(*axes[0][0].get_legend_handles_labels(), loc="outside upper right", ncols=2)
    letter(list(axes.flat))
    return figure
