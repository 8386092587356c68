"""A comparison as plain data, as tables on the terminal, and as a picture."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table

from gapbeam.postprocess.display_units import finite_or_none, in_percent, shown, shown_by
from gapbeam.postprocess.figures.figure_style import BLACK, VERMILION, journal_style, limits_around, panels
from gapbeam.postprocess.run_comparison import RunComparison, is_raw
from gapbeam.postprocess.signals.steady_figures import HARMONICS
from gapbeam.solver.messages.wording import counted

SHOWN_SIGNALS = 4


def as_data(comparison: RunComparison) -> dict[str, Any]:
    """The comparison in SI units as plain numbers, lists and strings that JSON can hold."""
    return {
        "a": str(comparison.a.folder),
        "b": str(comparison.b.folder),
        "agree": comparison.agree,
        "verdict": comparison.verdict,
        "way": comparison.way,
        "tolerance": comparison.tolerance,
        "runs": {
            name: {
                "period": one.cycle.period,
                "periodicity": one.cycle.verdict,
                "windows": one.windows,
                "forcing_periods_in_a_window": one.periods,
                "start": one.start,
                "end": one.end,
            }
            for name, one in zip("ab", comparison.steady, strict=True)
        },
        "figures": [
            {
                "name": row.name,
                "unit": row.unit,
                "a": row.a,
                "b": row.b,
                "scatter": list(row.scatter),
                "difference": finite_or_none(row.difference),
                "two_standard_errors": finite_or_none(row.allowed),
                "decides": row.decides,
            }
            for row in comparison.rows
        ],
        "waveforms": [
            {"name": one.name, "rms": one.rms, "largest": one.largest, "range": one.range, "unit": one.unit}
            for one in comparison.overlays
        ],
        "phase_differences": {probe: [float(x) for x in angles] for probe, angles in comparison.phases.items()},
        "costs": [{"name": name, "a": a, "b": b} for name, a, b in comparison.costs],
        "notes": list(comparison.notes),
    }


def as_tables(comparison: RunComparison) -> list[Table]:
    """The comparison as tables in mm, g and N."""
    figures = Table("", "A", "B", "difference", title="Figures over the windows", title_justify="left", box=None)
    for row in comparison.rows:
        unit, factor = shown(row.unit, max(abs(row.a), abs(row.b)))
        cells = [_value(factor * x, factor * s) for x, s in zip((row.a, row.b), row.scatter, strict=True)]
        figures.add_row(
            f"{row.name}, {unit}", *cells, in_percent(row.difference) + ("" if row.decides else " (reported only)")
        )
    phases = [[f"{math.degrees(angle):.2g}°" for angle in angles] for angles in comparison.phases.values()]
    for probe, angles in zip(comparison.phases, phases, strict=True):
        figures.add_row(f"{probe} phases of harmonics 1 to {HARMONICS}, A - B", "", "", " ".join(angles))
    waves = Table("", "rms", "largest", title="Waveforms, A - B over the range", title_justify="left", box=None)
    for one in comparison.overlays:
        waves.add_row(one.name, in_percent(one.rms), in_percent(one.largest))
    costs = Table("", "A", "B", title="Costs", title_justify="left", box=None)
    for name, *both in comparison.costs:
        costs.add_row(name, *("-" if x is None else f"{x:.4g}" for x in both))
    runs = Table("", "", "", title="Runs", title_justify="left", box=None, show_header=False)
    for name, results, run in zip("AB", (comparison.a, comparison.b), comparison.steady, strict=True):
        span = f"{run.windows} x {counted(run.periods, 'forcing period')}, {run.start:.4g} to {run.end:.4g} s"
        runs.add_row(name, str(results.folder), f"{run.cycle.verdict}\n{span}")
    return [runs, figures, *([waves] if comparison.overlays else []), costs]


def draw_comparison(comparison: RunComparison, path: Path) -> None:
    """Draw waveforms over each other, and their harmonics.

    Args:
        comparison: The comparison to draw.
        path: File to write; its suffix gives the format.
    """
    waves = [one for one in comparison.overlays if not is_raw(one.name)][:SHOWN_SIGNALS]
    names = [results.folder.name for results in (comparison.a, comparison.b)]
    if names[0] == names[1]:
        names = [str(results.folder) for results in (comparison.a, comparison.b)]
    with journal_style():
        figure, axes = panels(max(len(waves), 1), 2, height=1.6, width_ratios=[2.0, 1.0])
        clock, in_clock = shown_by("s", (float(np.abs(one.time).max()) for one in waves))
        for one, panel in zip(waves, axes[:, 0], strict=False):
            unit, factor = shown(one.unit, np.abs(np.concatenate([one.a, one.b])).max(initial=0.0))
            panel.plot(in_clock * one.time, factor * one.a, color=BLACK, lw=1.2, label=f"A: {names[0]}")
            panel.plot(in_clock * one.time, factor * one.b, color=VERMILION, lw=0.8, ls="--", label=f"B: {names[1]}")
            limits_around(panel, factor * np.concatenate([one.a, one.b]))
            panel.set_ylabel(f"{one.name}\n({unit})")
        axes[-1][0].set_xlabel(f"time ({clock})")
        axes[0][0].legend(loc="lower left", bbox_to_anchor=(0.0, 1.02), ncols=2, borderaxespad=0.0)
        orders = np.arange(1, HARMONICS + 1)
        for panel, probe in zip(axes[:, 1], comparison.phases, strict=False):
            heights = [np.abs(run.harmonics[probe]).mean(axis=0) for run in comparison.steady]
            unit, factor = shown_by("m", (float(some.max()) for some in heights))
            for some, place, color in zip(heights, (-0.2, 0.2), (BLACK, VERMILION), strict=True):
                panel.bar(orders + place, factor * some, 0.4, color=color)
            panel.set_yscale("log")
            panel.set_ylabel(f"{probe} harmonics\n({unit})")
        for panel in axes[len(comparison.phases) :, 1]:
            panel.set_axis_off()
        axes[min(len(comparison.phases), len(axes)) - 1, 1].set_xlabel("order")
        figure.savefig(path)


def _value(mean: float, scatter: float) -> str:
    return f"{mean:.5g}" + (f" ± {scatter:.2g}" if scatter > 5e-5 * abs(mean) else "")
