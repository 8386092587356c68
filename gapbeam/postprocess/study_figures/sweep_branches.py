"""Responses of a sweep: their picture, and a census of which coexist at a point and how many starts reached each.

Two responses are the same if they have the same cycle, or one has not quite settled, and every amplitude is the same
within the tolerance, the scatter of both, and what the rest of their transients may change: of acceleration (2.5 ms
mean) and displacement at every probe. Responses coexist where two that have settled are not the same: what has not
settled may still become any of them, and what has no cycle has settled only where several windows show its scatter.
Responses that have statistics, random and chaotic ones, differ only where 95 % intervals of one of them are disjoint:
of the rms of a probe, or of the contact share of a face.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from gapbeam.postprocess.display_units import shown_by
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
from gapbeam.postprocess.study_figures.study_axis import (
    StudyAxis,
    axis_of,
    cell_edges,
    columns_of,
    is_logarithmic,
    named_key,
    value_words,
)
from gapbeam.solver.messages.wording import counted

Record = Mapping[str, Any]

CREEPING = "not settled"
CYCLE, WILD, RANDOM = "period ", "no cycle", "random"
AMPLITUDES = (" displacement", " smoothed acceleration")
START_KEYS = "analysis."
"""Keys of a sweep that begin so say where responses start: points that differ in them only are one point."""
DECIDING = ("rms", "lateral_rms", "contact_share")  # statistics whose intervals are compared


def start_words(record: Record) -> str:
    """Return start, direction and keys of the start of a record, except for a key that says the same as the start."""
    keys = [
        f"{key} = {value}"
        for key, value in record["values"].items()
        if key.startswith(START_KEYS) and value != record["start"]
    ]
    return " ".join(filter(None, (record["start"], record["direction"], *keys)))


@dataclass(frozen=True)
class Branch:
    """One of the responses at a point.

    Attributes:
        word: "period 1", "no cycle", "random", "not settled", ...
        members: The records that found it.
    """

    word: str
    members: tuple[Record, ...]

    @property
    def settled(self) -> bool:
        """True where the response has settled: to a cycle, or to a motion that never repeats."""
        return self.word in (WILD, RANDOM) or self.word.startswith(CYCLE)

    @property
    def count(self) -> int:
        """Number of members that reached the response."""
        return len(self.members)

    @property
    def figures(self) -> dict[str, tuple[float, float, str]]:
        """Figures by name: mean over the members, scatter (within and between them), unit."""
        found = {}
        for name, figure in self.members[0]["figures"].items():
            entries = [member["figures"][name] for member in self.members if name in member["figures"]]
            means = np.array([entry["mean"] for entry in entries])
            within = np.mean([entry["scatter"] ** 2 for entry in entries])
            found[name] = float(means.mean()), float(np.sqrt(within + means.var())), str(figure["unit"])
        return found

    @property
    def reached_from(self) -> list[str]:
        """Starts and directions that led to it."""
        return [start_words(member) for member in self.members]


@dataclass(frozen=True)
class SweepPoint:
    """Result of one point of a sweep.

    Attributes:
        values: Values of the keys, as typed.
        branches: The responses, the one that was reached most often first.
        failures: Records of what did not pass, or has no figures.
        units: SI units of the keys, as far as they are known.
    """

    values: dict[str, str]
    branches: tuple[Branch, ...]
    failures: tuple[Record, ...]
    units: Mapping[str, str] = field(default_factory=dict)

    @property
    def coexisting(self) -> int:
        """Number of different responses that have settled."""
        return sum(branch.settled for branch in self.branches)

    @property
    def unsettled(self) -> int:
        """Number of starts whose response has not settled, nor comes near to one that has."""
        return sum(branch.count for branch in self.branches if branch.word == CREEPING)


def census_words(points: Sequence[SweepPoint]) -> list[str]:
    """Return at how many points responses coexist, and how many responses cannot tell, a clause each."""
    several, unsettled = sum(point.coexisting > 1 for point in points), sum(point.unsettled for point in points)
    words = [f"several responses at {several} of {counted(len(points), 'point')}"]
    if unsettled:
        words.append(f"no steady state yet in {counted(unsettled, 'response')}: try a larger time.end")
    return words


def census(records: Sequence[Record], tolerance: float) -> list[SweepPoint]:
    """Sort the records of a sweep into points, and those of a point into responses.

    Args:
        records: Records in the order of the points.
        tolerance: Relative difference of amplitudes that are the same.
    """
    places: dict[tuple[tuple[str, str], ...], list[Record]] = {}
    for record in records:
        values = tuple((key, value) for key, value in record["values"].items() if not key.startswith(START_KEYS))
        places.setdefault(values or (("case", "as written"),), []).append(record)
    points, units = [], {key: unit for record in records for key, unit in (record.get("units") or {}).items()}
    for values, there in places.items():
        good = [record for record in there if record["verdict"] == "passed" and record.get("figures")]
        groups = _grouped([record for record in good if _kind(record, tolerance) != CREEPING], tolerance)
        creeping = list[Record]()
        for record in good:
            if _kind(record, tolerance) == CREEPING:
                near = [group for group in groups if any(_same(record, other, tolerance) for other in group)]
                (max(near, key=len) if near else creeping).append(record)
        groups += _grouped(creeping, tolerance)
        groups.sort(key=len, reverse=True)
        branches = tuple(Branch(_word(group, tolerance), tuple(group)) for group in groups)
        failures = tuple(record for record in there if record not in good)
        points.append(SweepPoint(dict(values), branches, failures, units))
    return points


def _grouped(records: Sequence[Record], tolerance: float) -> list[list[Record]]:
    """Return groups of records each of which is the same as another of its group."""
    groups: list[list[Record]] = []
    for record in records:
        joined = [group for group in groups if any(_same(record, other, tolerance) for other in group)]
        others = [group for group in groups if not any(group is one for one in joined)]
        groups = [*others, [*chain.from_iterable(joined), record]]
    return groups


def _kind(record: Record, tolerance: float) -> str:
    """Return the kind of a response: without a cycle only where it repeats in none and windows show its scatter."""
    word = str(record["response"])
    near = record.get("windows", 2) < 2 or record.get("repeats_within", np.inf) <= tolerance
    return CREEPING if word == WILD and near else word


def _word(group: Sequence[Record], tolerance: float) -> str:
    words = [_kind(record, tolerance) for record in group]
    return next((word for word in words if word != CREEPING), CREEPING)


def _same(one: Record, other: Record, tolerance: float) -> bool:
    if len({_kind(one, tolerance), _kind(other, tolerance)} - {CREEPING}) > 1:
        return False
    pairs = _intervals(one, other)
    if pairs:
        return all(a["low"] <= b["high"] and b["low"] <= a["high"] for a, b in pairs)
    compared = [name for name in one["figures"] if name.endswith(AMPLITUDES)]
    for name in compared or [name for name, figure in one["figures"].items() if figure.get("own")]:
        if name in other["figures"]:
            a, b = one["figures"][name], other["figures"][name]
            allowed = tolerance * max(abs(a["mean"]), abs(b["mean"])) + a["scatter"] + b["scatter"]
            allowed += a.get("unsettled", 0.0) + b.get("unsettled", 0.0)
            if abs(a["mean"] - b["mean"]) > allowed:
                return False
    return True


def _intervals(one: Record, other: Record) -> list[tuple[Record, Record]]:
    """Return the deciding figures of two responses that both know with an interval."""
    names = [name for name in one["figures"] if "." in name and name.rpartition(".")[2] in DECIDING]
    pairs = [(one["figures"][name], other["figures"][name]) for name in names if name in other["figures"]]
    return [(a, b) for a, b in pairs if "low" in a and "low" in b]


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


def draw_branches(points: Sequence[SweepPoint], path: Path) -> Path:
    """Draw figures of all responses over the last key of a sweep; failed points are marked at the foot.

    Marks point up or down where a state was carried, are larger the more starts led there, and are colored by period;
    error bars are the scatter over windows and starts, of statistics their 95 % interval. A panel a figure, a column a
    value of the other keys, four beside each other at most; one column where the keys vary side by side.

    Args:
        points: The census.
        path: File to write; its suffix gives the format.
    """
    values, units = [point.values for point in points], points[0].units
    along = axis_of(values, units)
    groups: dict[str, list[SweepPoint]] = {}
    for point, column_title in zip(points, columns_of(values, units), strict=True):
        groups.setdefault(column_title, []).append(point)
    drawn = {name: figure_unit(points, name) for name in drawn_figures(points)}
    words: set[str] = set()
    with journal_style():
        figure, columns = _columns(max(len(drawn), 1), len(groups))
        for column, (title, mine) in zip(columns, groups.items(), strict=True):
            for (name, (_, factor)), panel in zip(drawn.items(), column, strict=False):
                panel.set_xscale("log" if along.is_logarithmic else "linear")
                for point in mine:
                    words |= _draw_point(panel, point, name, along.place(point.values), factor)
                panel.set_xmargin(0.06)
            column[0].set_title(title.replace(", ", "\n"))
            column[-1].set_xlabel(_axis_words(points, along))
            if along.counted:
                column[-1].set_xticks(along.numbers, along.texts)
        for (name, (unit, _)), row in zip(drawn.items(), np.transpose(columns), strict=False):
            for panel in row[::ABREAST]:
                panel.set_ylabel(f"{name}\n({unit})")
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


def _axis_words(points: Sequence[SweepPoint], along: StudyAxis) -> str:
    """Return the name and unit of the axis, and the keys that vary with it, from the first point to the last."""
    if along.choices:
        return along.name
    first, last = points[0].values, points[-1].values
    beside = [key for key in first if key != along.key and first[key] != last[key]]
    ends = [(key, *(value_words(one[key], along.units.get(key, "")) for one in (first, last))) for key in beside]
    return "\n".join([along.name, *(f"with {key} = {low} to {high}" for key, low, high in ends)])


def drawn_figures(points: Sequence[SweepPoint]) -> list[str]:
    """Return the names of the figures that pictures of a sweep show.

    Those of one's own, else the 2.5 ms mean acceleration, peak to peak, of every probe, or what else there is of its
    motion; the rms where all responses have it, as random ones do.
    """
    members = [member["figures"] for point in points for branch in point.branches for member in branch.members]
    if own := list(dict.fromkeys(name for figures in members for name, one in figures.items() if one.get("own"))):
        return own
    names = list(dict.fromkeys(name for point in points for branch in point.branches for name in branch.figures))
    everywhere = [name for name in names if all(name in b.figures for point in points for b in point.branches)]
    if found := [name for name in everywhere if name.endswith(".rms")]:
        return found
    for ending in (" smoothed acceleration", " acceleration", " displacement"):
        found = [name for name in names if name.endswith(ending)]
        if found:
            return found
    return names[:1]


def figure_unit(points: Sequence[SweepPoint], name: str) -> tuple[str, float]:
    """Return the unit in which a figure of all responses is shown, by the largest, and the factor to it."""
    every = [branch.figures[name] for point in points for branch in point.branches if name in branch.figures]
    return shown_by(every[0][2] if every else "", [mean for mean, _, _ in every])


def _draw_point(panel: Axes, point: SweepPoint, name: str, x: float, factor: float) -> set[str]:
    most = max((branch.count for branch in point.branches), default=1)
    for branch in point.branches:
        if name not in branch.figures:
            continue
        mean, scatter, _ = branch.figures[name]
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


FEWEST = 3  # values of a key: fewer make no map
LINES = 6
MAPS_ABREAST = 3


def grid_of(points: Sequence[SweepPoint]) -> tuple[tuple[str, str], np.ndarray, np.ndarray] | None:
    """Return the two keys of a grid and their ascending values, SI; None: the sweep is over no such grid.

    Args:
        points: Points of the sweep. A grid has every pair of at least three numbers of each of two keys, and no other
            key.
    """
    keys = [key for key in points[0].values if len({point.values[key] for point in points}) > 1]
    if len(keys) != 2:
        return None
    try:
        numbers = np.array([[float(point.values[key]) for key in keys] for point in points])
    except ValueError:
        return None
    along, up = (np.unique(column) for column in numbers.T)
    whole = len(np.unique(numbers, axis=0)) == len(points) == len(along) * len(up)
    return ((keys[0], keys[1]), along, up) if whole and min(len(along), len(up)) >= FEWEST else None


def heights(points: Sequence[SweepPoint], name: str) -> np.ndarray:
    """Return a figure over the grid, (second key, first key), SI, of the response that most starts reached.

    Where no response has the figure the height is not a number.
    """
    found = grid_of(points)
    assert found is not None
    keys, along, up = found
    values = np.full((len(up), len(along)), np.nan)
    for point in points:
        i, j = (
            int(np.searchsorted(axis, float(point.values[key]))) for key, axis in zip(keys, (along, up), strict=True)
        )
        values[j, i] = next((b.figures[name][0] for b in point.branches if name in b.figures), np.nan)
    return values


def draw_map(points: Sequence[SweepPoint], path: Path) -> Path | None:
    """Draw figures over the two keys of a sweep; None: it is over no grid, and nothing is drawn.

    Crosses mark points where a response did not pass, rings those where responses coexist.

    Args:
        points: The census.
        path: File to write; its suffix gives the format.
    """
    found, names = grid_of(points), drawn_figures(points)
    if found is None or not names:
        return None
    keys, *axes = found
    named = (named_key(key, points[0].units, axis) for key, axis in zip(keys, axes, strict=True))
    labels, scales = zip(*named, strict=True)
    x, y = (scale * axis for scale, axis in zip(scales, axes, strict=True))
    abreast = min(len(names), MAPS_ABREAST)
    with journal_style():
        figure, grid = panels(-(-len(names) // abreast), abreast, width=1.0 + 2.9 * abreast, height=2.6)
        for panel, name in zip(grid.flat, names, strict=False):
            unit, factor = figure_unit(points, name)
            values = factor * heights(points, name)
            panel.set_xscale("log" if is_logarithmic(x) else "linear")
            panel.set_yscale("log" if is_logarithmic(y) else "linear")
            colors = panel.pcolormesh(cell_edges(x), cell_edges(y), values, shading="flat", cmap="viridis")
            figure.colorbar(colors, ax=panel, label=f"{name} ({unit})")
            if np.nanmax(values) > np.nanmin(values):
                lines = panel.contour(x, y, values, levels=LINES, colors=BLACK, linewidths=0.6)
                panel.clabel(lines, fontsize="x-small", fmt="%.3g")
            _mark(panel, points, keys, scales)
            panel.set(xlabel=labels[0], ylabel=labels[1])
        for unused in list(grid.flat)[len(names) :]:
            unused.remove()
        figure.savefig(path)
    return path


def _mark(panel: Axes, points: Sequence[SweepPoint], keys: tuple[str, str], scales: Sequence[float]) -> None:
    for point in points:
        x, y = (scale * float(point.values[key]) for key, scale in zip(keys, scales, strict=True))
        if point.failures:
            panel.scatter(x, y, 24.0, color=VERMILION, marker="x", zorder=4)
        if point.coexisting > 1:
            panel.scatter(x, y, 24.0, facecolors="none", edgecolors=BLACK, zorder=4)
