"""Figures with a line for each column of a record: shock response spectra, and cycles beyond a range."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from gapbeam.postprocess.display_units import shown
from gapbeam.postprocess.figures.figure_style import COLORS, panels
from gapbeam.postprocess.signals.cycle_counts import CycleCounts
from gapbeam.postprocess.signals.shock_spectrum import ShockSpectrum

_STYLES = ("-", "--", ":", "-.")


def draw_shock_spectrum(found: ShockSpectrum) -> Figure:
    """Draw the largest responses over natural frequency, both logarithmic."""
    unit, factor = shown(found.unit)
    figure, ((panel,),) = panels(1, 1, height=3.0)
    for number, ((kind, label), heights) in enumerate(found.responses.items()):
        values = np.maximum(factor * heights, 1e-300)
        panel.loglog(found.frequency, values, label=f"{label} {kind}".strip(), **_line(number))
    panel.set_xlabel("natural frequency (Hz)")
    panel.set_ylabel(f"largest response to {found.record.replace('_', ' ')} ({unit})")
    panel.set_xlim(found.frequency[0], found.frequency[-1])
    figure.legend(*panel.get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


def draw_cycles(found: CycleCounts) -> Figure:
    """Draw the number of cycles with at least a range over that range."""
    unit, factor = shown(found.unit)
    figure, ((panel,),) = panels(1, 1, height=3.0)
    for number, (label, (ranges, _, counts)) in enumerate(found.cycles.items()):
        order = np.argsort(-ranges)
        panel.step(np.cumsum(counts[order]), factor * ranges[order], where="pre", label=label, **_line(number))
    panel.set_xscale("log")
    panel.set_xlabel("cycles with at least this range")
    panel.set_ylabel(f"range of {found.record.replace('_', ' ')} ({unit})")
    figure.legend(*panel.get_legend_handles_labels(), loc="outside upper center", ncols=4)
    return figure


def _line(number: int) -> dict[str, object]:
    style = _STYLES[number // len(COLORS) % len(_STYLES)]
    return {"color": COLORS[number % len(COLORS)], "linestyle": style, "linewidth": 0.9}
