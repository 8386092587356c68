"""Folder of a study of uncertain values: tables, a picture, and the record that reports read."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import StrMethodFormatter

from gapbeam.postprocess.figures.figure_style import BLACK, COLORS, GRAY, journal_style, panels
from gapbeam.postprocess.report.sections.uncertain_section import UNCERTAIN_FILE, UNCERTAIN_PICTURE
from gapbeam.solver.run.output.results_folder import finite, write_beside
from gapbeam.solver.system.operators import Array
from gapbeam.studies.study_folder import study_written
from gapbeam.studies.uncertain.uncertain_result import Uncertain

MOST_PANELS = 4


def write_uncertain(found: Uncertain, folder: Path) -> list[Path]:
    """Write tables and picture, and return their paths.

    Raises:
        NotWritten: The disk takes no file.
    """
    tables = {
        "probabilities": found.probability_rows(), "distributions": found.distribution_rows(),
        "sobol-indices": found.index_rows(), "convergence": found.convergence_rows(),
    }  # fmt: skip
    columns = {**found.values, "response": found.response, **found.figures}
    paths = []
    for name, (heads, rows) in {**tables, "members": (tuple(columns), zip(*columns.values(), strict=True))}.items():
        path = folder / f"{name}.csv"
        with study_written(path):
            write_beside(path, _csv(heads, rows))
        paths.append(path)
    record = {
        "members": len(found.response), "responses": len(found.responses), "unknown": found.unknown,
        "complete": found.is_complete, "headline": found.headline(),
        **{name: {"heads": heads, "rows": rows} for name, (heads, rows) in tables.items()},
    }  # fmt: skip
    picture, note = folder / UNCERTAIN_PICTURE, folder / UNCERTAIN_FILE
    with study_written(picture):
        draw_distributions(found).savefig(picture)
    with study_written(note):
        write_beside(note, json.dumps([finite(record)], indent=1) + "\n")
    return [note, *paths, picture]


def _csv(heads: Iterable[Any], rows: Iterable[Any]) -> str:
    text = io.StringIO()
    csv.writer(text).writerows([heads, *rows])
    return text.getvalue()


@journal_style()
def draw_distributions(found: Uncertain, figures: Iterable[str] = ()) -> Figure:
    """Draw the distribution of figures for each response, and the convergence of probabilities.

    Args:
        found: A study.
        figures: Names; default those with limits, or the first four.
    """
    names = list(figures) or list(found.limits) or list(found.figures)[:MOST_PANELS]
    converging = any(one.count for every in found.convergence.exceeded.values() for one in every)
    figure, grid = panels(len(names) + converging, height=1.9)
    kinds = [name for name in found.responses if any((name, one) in found.distributions for one in names)]
    for (axes,), name in zip(grid, names, strict=False):
        y = found.figures[name]
        ends = np.histogram_bin_edges(y[np.isfinite(y)], bins="auto") if np.isfinite(y).any() else np.array([0.0, 1.0])
        base: Array = np.zeros(len(ends) - 1)
        for number, kind in enumerate(kinds):
            mine = (found.response == kind) & np.isfinite(y)
            share = np.histogram(y[mine], bins=ends)[0] / len(y)
            color = GRAY if kind == "chaotic" else COLORS[number % len(COLORS)]
            axes.stairs(base + share, ends, baseline=base, fill=True, color=color, alpha=0.8, label=kind)
            base = base + share
        if name in found.limits:
            axes.axvline(found.limits[name], color=BLACK, ls="--", lw=0.8)
        axes.set_xlabel(name)
        axes.set_ylabel("share of members")
    if len(kinds) > 1:
        grid[0][0].legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    if converging:
        axes = grid[-1][0]
        for number, (name, every) in enumerate(found.convergence.exceeded.items()):
            middle = np.array([one.value for one in every])
            ends = np.array([[one.low for one in every], [one.high for one in every]])
            axes.errorbar(
                found.convergence.members, middle, np.maximum(np.abs(ends - middle), 0.0),
                color=COLORS[number % len(COLORS)], marker="o", ms=3.0, capsize=2.0, label=name,
            )  # fmt: skip
        axes.set_xscale("log", base=2)
        axes.xaxis.set_major_formatter(StrMethodFormatter("{x:.0f}"))
        axes.margins(x=0.03)
        axes.set_xlabel("members")
        axes.set_ylabel("probability")
        if len(found.convergence.exceeded) > 1:
            axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure
