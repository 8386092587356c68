"""The pictures of an identification: measured against computed figures, and the misfit over each unknown."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.lines import Line2D
from matplotlib.ticker import LogFormatterSciNotation, LogLocator, NullFormatter

from gapbeam.postprocess.display_units import shown_by
from gapbeam.postprocess.figures.figure_style import BLACK, BLUE, GRAY, GREEN, VERMILION, journal_style, letter, panels
from gapbeam.postprocess.report.study_json import read_object
from gapbeam.postprocess.results.bounded_files import read_plain

DATA, CLOUD = "identification.json", "evaluations.csv"
PICTURES = ("identified-figures.png", "identified-misfit.png")
LARGEST_CLOUD = 32 * 2**20  # bytes: some 300 000 evaluations
MOST_COLUMNS = 3
MANY = 50.0  # times the least value: long numbers then stand at whole decades only
HIGHEST = 1e3  # sums of squares over the best one that are drawn


def read_identification_data(folder: Path) -> dict[str, Any]:
    """Return the data of an identification.

    Raises:
        ResultsError: The folder has no data of an identification, or the file cannot be read.
    """
    return read_object(folder / DATA, ("measurements", "unknowns", "notes"))


def read_cloud(folder: Path) -> tuple[list[str], np.ndarray]:
    """Return names of the unknowns, and values and sum of squares of all evaluations that passed, (k, n + 1).

    Raises:
        ResultsError: No plain file of reasonable size.
    """
    content = read_plain(folder / CLOUD, "a table of evaluations", "repeat the identification", LARGEST_CLOUD)
    head, *rows = list(csv.reader(io.StringIO(content.decode("utf-8"), newline="")))
    found = np.array([[float(cell) for cell in row[:-1]] for row in rows]).reshape(-1, len(head) - 1)
    return head[:-2], found[np.isfinite(found[:, -1])]


def draw_identification(folder: Path) -> list[Path]:
    """Draw the pictures of an identification into its folder.

    Args:
        folder: Folder of the identification.

    Returns:
        The files.

    Raises:
        ResultsError: No identification there.
    """
    data = read_identification_data(folder)
    paths = [folder / name for name in PICTURES]
    _draw_figures(data, paths[0])
    _draw_misfit(data, *read_cloud(folder), paths[1])
    return paths


def abscissa(rows: Sequence[Mapping[str, Any]]) -> tuple[str, np.ndarray]:
    """Return the abscissa of measurements, with its unit as shown: the one key that they set, or a number."""
    keys = {key for row in rows for key in row["set"]}
    if len(keys) == 1:
        key = next(iter(keys))
        values = [row["set"].get(key) for row in rows]
        if all(isinstance(value, int | float) and not isinstance(value, bool) for value in values):
            unit, factor = shown_by(next(row["set_units"][key] for row in rows), values)
            return f"{key} ({unit})" if unit else key, factor * np.array(values, dtype=float)
    return "measurement", np.arange(1, len(rows) + 1, dtype=float)


def measured_unit(rows: Sequence[Mapping[str, Any]]) -> tuple[str, float]:
    """Return the unit in which a figure is shown, by its largest measured or computed value, and the factor to it."""
    return shown_by(rows[0]["unit"], (row[key] for row in rows for key in ("measured", "computed")))


def _draw_figures(data: Mapping[str, Any], path: Path) -> None:
    rows = data["measurements"]
    names = list(dict.fromkeys(row["figure"] for row in rows))
    columns = min(2, len(names))
    entries = {
        "fit": Line2D([], [], color=BLACK, marker="o", linestyle="", markersize=4.5, label="measured, fitted"),
        "predict": Line2D([], [], color=BLACK, marker="o", mfc="none", linestyle="", markersize=4.5,
                          label="measured, held out"),
        "computed": Line2D([], [], color=VERMILION, marker="D", linestyle="-", lw=0.8, markersize=3.5,
                           label="computed ± scatter"),
        "other": Line2D([], [], color=GREEN, marker="x", linestyle="", markersize=4.0, label="from other starts"),
    }  # fmt: skip
    used = {row["use"] for row in rows} | {"computed"} | {"other" for row in rows if row["other_responses"]}
    kept = [entry for name, entry in entries.items() if name in used]
    with journal_style():
        figure, axes = panels(-(-len(names) // columns), columns, width=max(4.6, 3.4 * columns), height=2.6)
        for panel, name in zip(axes.flat, names, strict=False):
            mine = [row for row in rows if row["figure"] == name]
            _figure_panel(panel, mine, data["residual"] == "log10")
            panel.set_title(mine[0]["meaning"], fontsize=8.0)
        for panel in list(axes.flat)[len(names) :]:
            panel.set_axis_off()
        figure.legend(handles=kept, loc="outside upper center", ncols=2)
        figure.savefig(path)


def _figure_panel(panel: Axes, rows: Sequence[Mapping[str, Any]], logarithmic: bool) -> None:
    label, places = abscissa(rows)
    unit, factor = measured_unit(rows)
    order = np.argsort(places, kind="stable")
    computed = np.array([np.nan if row["computed"] is None else factor * row["computed"] for row in rows])
    scatter = np.array([factor * (row["scatter"] or 0.0) for row in rows])
    panel.errorbar(places[order], computed[order], scatter[order], fmt="D-", color=VERMILION, lw=0.8, ms=3.5,
                   capsize=2.0, zorder=2)  # fmt: skip
    for place, row in zip(places, rows, strict=True):
        face = BLACK if row["use"] == "fit" else "none"
        panel.plot(place, factor * row["measured"], "o", mfc=face, mec=BLACK, ms=5.0, zorder=3)
        for other in row["other_responses"]:
            panel.plot(place, factor * other, "x", color=GREEN, ms=4.0, zorder=1)
    if logarithmic and min(row["measured"] for row in rows) > 0.0:
        panel.set_yscale("log")
        _plain_ticks(panel.yaxis)
    panel.margins(0.08, 0.1)
    panel.set_xlabel(label)
    panel.set_ylabel(unit)


def _plain_ticks(axis: Axis) -> None:
    """Label a logarithmic axis at 1, 2 and 5 of each decade, in plain numbers where they are short."""
    low, high = axis.get_view_interval()
    plain = low > 1e-3 and high < 1e4
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if plain or high < MANY * low else (1.0,)))
    axis.set_minor_formatter(NullFormatter())
    if plain:
        axis.set_major_formatter("{x:g}")
    else:
        axis.set_major_formatter(LogFormatterSciNotation(labelOnlyBase=False, minor_thresholds=(np.inf, np.inf)))


def _draw_misfit(data: Mapping[str, Any], names: Sequence[str], cloud: np.ndarray, path: Path) -> None:
    columns = min(MOST_COLUMNS, len(names))
    least = max(float(cloud[:, -1].min()), np.finfo(float).tiny)
    bound = data["bound_of_misfit"]
    with journal_style():
        figure, axes = panels(-(-len(names) // columns), columns, width=2.4 * columns + 0.4, height=2.2)
        for number, (panel, one) in enumerate(zip(axes.flat, data["unknowns"], strict=False)):
            low, high = one["interval"]
            panel.axvspan(low, high, color=BLUE, alpha=0.15, lw=0)
            panel.plot(cloud[:, number], cloud[:, -1], ".", color=GRAY, ms=3.0, mew=0.0)
            near = cloud[:, -1] <= bound
            panel.plot(cloud[near, number], cloud[near, -1], ".", color=BLACK, ms=3.5, mew=0.0)
            panel.axhline(bound, color=VERMILION, lw=0.8, ls="--")
            panel.axvline(one["value"], color=BLUE, lw=0.8)
            panel.set_xlim(one["lower"], one["upper"])
            panel.set_yscale("log")
            if one["scale"] == "log":
                panel.set_xscale("log")
                _plain_ticks(panel.xaxis)
            panel.set_ylim(0.5 * least, max(2.0 * bound, min(HIGHEST * bound, 2.0 * float(cloud[:, -1].max()))))
            panel.set_xlabel(f"{one['key']} ({one['unit']})" if one["unit"] else one["key"])
            panel.set_title(one["word"])
        for panel in axes[:, 0]:
            panel.set_ylabel("sum of squares")
        for panel in list(axes.flat)[len(names) :]:
            panel.set_axis_off()
        letter(list(axes.flat)[: len(names)])
        figure.savefig(path)
