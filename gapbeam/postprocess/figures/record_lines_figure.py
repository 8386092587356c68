"""Figures of records: power spectral densities with their intervals, shock response spectra, cycles beyond a range."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from gapbeam.postprocess.display_units import shown
from gapbeam.postprocess.figures.figure_style import COLORS, GRAY, panels
from gapbeam.postprocess.signals.cycle_counts import CycleCounts
from gapbeam.postprocess.signals.shock_spectrum import CONFIDENCE, PowerDensity, ShockSpectrum

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


_DECADES = 9.0


def draw_power_density(found: PowerDensity) -> Figure:
    """Draw density over frequency, both logarithmic, a line for each probe, face or component.

    Args:
        found: With at least one column.
    """
    unit, factor = shown(found.unit)
    figure, ((panel,),) = panels(1, 1, height=3.0)
    top = 0.0
    for number, (label, density) in enumerate(found.densities.items()):
        values = factor * factor * density
        top = max(top, float(values.max()))
        style = _STYLES[number // len(COLORS) % len(_STYLES)]
        color = COLORS[number % len(COLORS)]
        panel.loglog(found.frequency, np.maximum(values, 1e-300), color=color, ls=style, lw=0.9, label=label)
    panel.set_ylim(max(panel.get_ylim()[0], 10.0**-_DECADES * top), 3.0 * top)
    panel.set_xlabel("frequency (Hz)")
    square = f"({unit})²" if "/" in unit else f"{unit}²" if unit != "1" else "1"
    panel.set_ylabel(f"density of {found.record.replace('_', ' ')} ({square}/Hz)")
    panel.set_xlim(found.frequency[0], found.frequency[-1])
    low, high = panel.get_ylim()
    middle, place = low * (high / low) ** 0.15, found.frequency[0] * (found.frequency[-1] / found.frequency[0]) ** 0.03
    spans = [[middle * (1.0 - found.least)], [middle * (found.most - 1.0)]]
    panel.errorbar([place], [middle], spans, color=GRAY, capsize=2.0, lw=0.9, label=f"{CONFIDENCE:.0%} of any value")
    figure.legend(*panel.get_legend_handles_labels(), loc="outside upper center", ncols=4)
    return figure
