"""A curve of periodic responses over a parameter: stable parts drawn through, unstable ones dashed, events marked."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from gapbeam.postprocess.figures.figure_style import BLACK, BLUE, DOUBLE, GRAY, GREEN, PURPLE, VERMILION, panels

COLORS = (BLACK, BLUE, GREEN, PURPLE)
MARKS = {"fold": "o", "period doubling": "s", "Neimark-Sacker": "^"}
STYLES = {True: "-", False: "--", None: ":"}  # of lines, by whether a response is stable; None: not known
SUFFIX = ".peak_to_peak"
ALIKE = 1.0e-6


def draw_response_curve(curve: Mapping[str, Any]) -> Figure:
    """Draw the peak to peak of every probe and the largest multiplier over what varies.

    Args:
        curve: Contents of curve.json.
    """
    points: list[dict[str, Any]] = curve["points"]
    values = np.array([point["value"] for point in points])
    stable = np.array([STYLES[point["stable"]] for point in points])
    branch = np.array([point.get("branch", 1) for point in points])
    probes = [name.removesuffix(SUFFIX) for name in points[0] if name.endswith(SUFFIX)]
    figure, axes = panels(2, 1, width=DOUBLE, height=2.2, sharex=True)
    motion, multiplier = axes[:, 0]
    for number, probe in enumerate(probes):
        color = COLORS[number % len(COLORS)]
        heights = 1.0e3 * np.array([point[probe + SUFFIX] for point in points])
        _draw(motion, values, heights, stable, branch, color)
        _mark(motion, points, heights)
    largest = np.array([point["largest_multiplier"] for point in points])
    _draw(multiplier, values, largest, stable, branch, BLACK)
    _mark(multiplier, points, largest)
    multiplier.axhline(1.0, color=GRAY, linewidth=0.6)
    if np.ptp(largest) < ALIKE * largest.max():  # the range of round-off would be drawn otherwise
        multiplier.set_ylim(0.0, 1.1 * max(1.0, float(largest.max())))
    motion.set_ylabel("peak to peak (mm)")
    multiplier.set_ylabel("largest |multiplier|")
    multiplier.set_xlabel(f"{curve['key']} ({curve['unit']})")
    motion.margins(x=0.02)
    motion.legend(handles=list(_keys(points, probes)), loc="best")
    return figure


def _draw(
    panel: Axes, values: np.ndarray, heights: np.ndarray, stable: np.ndarray, branch: np.ndarray, color: str
) -> None:
    for part in _runs(stable, branch):
        style = str(stable[part.start])
        goes_on = part.stop < len(values) and branch[part.stop] == branch[part.start]
        end = part.stop + 1 if goes_on else part.stop  # up to where the next part of the branch begins
        panel.plot(values[part.start : end], heights[part.start : end], style, color=color)


def _runs(stable: np.ndarray, branch: np.ndarray) -> Iterator[slice]:
    """Yield the parts of one stability and one branch."""
    changes = (stable[1:] != stable[:-1]) | (np.diff(branch) != 0)
    edges = [0, *(np.flatnonzero(changes) + 1), len(stable)]
    yield from (slice(start, stop) for start, stop in pairwise(edges))


def _mark(panel: Axes, points: Sequence[Mapping[str, Any]], heights: np.ndarray) -> None:
    for point, height in zip(points, heights, strict=True):
        if point["event"]:
            panel.plot(point["value"], height, MARKS[point["event"]], color=VERMILION, markersize=4, fillstyle="none")


def _keys(points: Sequence[Mapping[str, Any]], probes: Sequence[str]) -> Iterator[Line2D]:
    for number, probe in enumerate(probes):
        yield Line2D([], [], color=COLORS[number % len(COLORS)], label=probe)
    for stable, name in ((False, "unstable"), (None, "stability not known")):
        if any(point["stable"] is stable for point in points):
            yield Line2D([], [], color=GRAY, linestyle=STYLES[stable], label=name)
    for event in dict.fromkeys(point["event"] for point in points if point["event"]):
        yield Line2D([], [], color=VERMILION, marker=MARKS[event], linestyle="", fillstyle="none", label=event)
