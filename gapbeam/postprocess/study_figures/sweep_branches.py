"""The picture of a sweep: every response of every point, with its scatter, its period and how often it was reached."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from gapbeam.postprocess.display_units import LENGTHS, shown
from gapbeam.postprocess.figures.figure_style import (
    BLACK,
    BLUE,
    GRAY,
    GREEN,
    PURPLE,
    SKY,
    VERMILION,
    journal_style,
    panels,
)
from gapbeam.postprocess.study_figures.response_census import SweepPoint
from gapbeam.postprocess.study_figures.sweep_columns import columns_of, key_along

COLORS = {
    "period 1": BLACK,
    "period 2": BLUE,
    "period 3": VERMILION,
    "no cycle": GRAY,
    "not settled": SKY,
    "no period": BLACK,
    "random": BLACK,
}
OTHER = {"period 4": GREEN, "period 5": PURPLE}
SHAPES = {"up": "^", "down": "v", "": "o"}
ABREAST = 4
SMALLEST, LARGEST = 16.0, 64.0  # areas of the marks, points^2


def draw_branches(points: Sequence[SweepPoint], path: Path, quantities: Sequence[str] | None = None) -> Path:
    """Draw figures of all responses over the last key of a sweep; what failed is marked at the foot.

    Marks point up or down where a state was carried, are larger the more starts led there, and are colored by period;
    error bars are the scatter over windows and starts, of statistics their 95 % interval. A panel a figure, a column a
    value of the other keys, four beside each other at most; one column where the keys vary side by side.

    Args:
        points: The census.
        path: File to write; its suffix gives the format.
        quantities: Names of figures; by default the 2.5 ms mean acceleration, peak to peak, of every probe, or what
            else there is of its motion; the rms where all responses have it, as random ones do.
    """
    values = [point.values for point in points]
    along = key_along(values)
    groups: dict[str, list[SweepPoint]] = {}
    for point, column_title in zip(points, columns_of(values), strict=True):
        groups.setdefault(column_title, []).append(point)
    names = list(quantities) if quantities else _quantities(points)
    texts = list(dict.fromkeys(point.values[along] for point in points))
    numbers = [_number(text) for text in texts]
    axis, factor = shown("m") if along.endswith(LENGTHS) and None not in numbers else ("", 1.0)
    places = {
        text: float(place) if None in numbers else factor * float(number or 0.0)
        for place, (text, number) in enumerate(zip(texts, numbers, strict=True))
    }
    words: set[str] = set()
    with journal_style():
        figure, columns = _columns(max(len(names), 1), len(groups))
        for column, (title, mine) in zip(columns, groups.items(), strict=True):
            for name, panel in zip(names, column, strict=False):
                for point in mine:
                    words |= _draw_point(panel, point, name, places[point.values[along]])
                panel.set_xmargin(0.06)
            column[0].set_title(title.replace(", ", "\n"))
            column[-1].set_xlabel(_axis_words(points, along, axis))
            if None in numbers:
                column[-1].set_xticks(list(places.values()), list(places))
        for name, row in zip(names, np.transpose(columns), strict=False):
            unit = next(b.figures[name][2] for p in points for b in p.branches if name in b.figures)
            for panel in row[::ABREAST]:
                panel.set_ylabel(f"{name}\n({shown(unit)[0]})")
        figure.legend(handles=_legend(points, words), loc="outside upper center", ncols=4)
        figure.savefig(path)
    return path


def _columns(rows: int, count: int) -> tuple[Figure, np.ndarray]:
    """Return a figure with columns of panels, some abreast, and its panels, (count, rows); a row has one scale."""
    abreast, bands = min(count, ABREAST), -(-count // ABREAST)
    height = 2.1 + 0.6 / (rows * bands)  # room for the words below and above
    figure, axes = panels(rows * bands, abreast, width=2.6 + 2.6 * abreast, height=height, sharex=True)
    columns = np.concatenate([axes[band * rows : (band + 1) * rows].T for band in range(bands)])
    for unused in columns[count:].flat:
        unused.remove()
    columns = columns[:count]
    for row in columns.T:
        for place, panel in enumerate(row):
            panel.tick_params(labelbottom=panel is columns[place][-1], labelleft=place % ABREAST == 0)
            if place:
                panel.sharey(row[0])
    return figure, columns


def _axis_words(points: Sequence[SweepPoint], along: str, unit: str) -> str:
    """Return the name of the axis with its unit, and what varies with it: from the first point to the last."""
    name = f"{along} ({unit})" if unit else along
    if len(set(columns_of([point.values for point in points]))) > 1:
        return name
    first, last = points[0].values, points[-1].values
    beside = [f"{key} = {first[key]} to {last[key]}" for key in first if key != along and first[key] != last[key]]
    return "\n".join([name, *(f"with {words}" for words in beside)])


def _quantities(points: Sequence[SweepPoint]) -> list[str]:
    names = list(dict.fromkeys(name for point in points for branch in point.branches for name in branch.figures))
    everywhere = [name for name in names if all(name in b.figures for point in points for b in point.branches)]
    if found := [name for name in everywhere if name.endswith(".rms")]:
        return found
    for ending in (" smoothed acceleration", " acceleration", " displacement"):
        found = [name for name in names if name.endswith(ending)]
        if found:
            return found
    return names[:1]


def _draw_point(panel: Axes, point: SweepPoint, name: str, x: float) -> set[str]:
    most = max((branch.count for branch in point.branches), default=1)
    for branch in point.branches:
        if name not in branch.figures:
            continue
        mean, scatter, unit = branch.figures[name]
        factor = shown(unit)[1]
        color = _color(branch.word)
        panel.errorbar(x, factor * mean, factor * scatter, color=color, lw=0.8, capsize=2.0, zorder=2)
        size = SMALLEST + (LARGEST - SMALLEST) * (branch.count - 1) / most
        for direction in sorted({str(member["direction"]) for member in branch.members}):
            panel.scatter(x, factor * mean, size, color=color, marker=SHAPES[direction], zorder=3)
    if point.failures:
        panel.scatter(x, 0.02, 24.0, color=VERMILION, marker="x", transform=panel.get_xaxis_transform(), zorder=4)
    return {branch.word for branch in point.branches}


def _color(word: str) -> str:
    return (COLORS | OTHER).get(word, GREEN)


def _legend(points: Sequence[SweepPoint], words: set[str]) -> list[Line2D]:
    marks = [
        Line2D([], [], color=_color(word), marker="o", linestyle="", markersize=4, label=word) for word in sorted(words)
    ]
    directions = {str(m["direction"]) for p in points for b in p.branches for m in b.members} - {""}
    marks += [
        Line2D([], [], color=GRAY, marker=SHAPES[way], linestyle="", markersize=4, label=f"carried {way}")
        for way in sorted(directions, reverse=True)
    ]
    if any(point.failures for point in points):
        marks.append(Line2D([], [], color=VERMILION, marker="x", linestyle="", markersize=4, label="did not pass"))
    return marks


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if np.isfinite(value) else None
