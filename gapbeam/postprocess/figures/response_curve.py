"""A curve of periodic responses over a parameter: stable parts drawn through, unstable ones dashed, events marked."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from gapbeam.postprocess.figures.figure_style import BLACK, BLUE, DOUBLE, GRAY, GREEN, PURPLE, VERMILION, panels
from gapbeam.postprocess.results.curve_parts import branch_parts, stable_parts

COLORS = (BLACK, BLUE, GREEN, PURPLE)
MARKS = {
    "fold": "o",
    "pitchfork": "D",
    "branch point": "X",
    "period doubling": "s",
    "Neimark-Sacker": "^",
    "grazing": "|",
}
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
    probes = [name.removesuffix(SUFFIX) for name in points[0] if name.endswith(SUFFIX)]
    figure, axes = panels(2, 1, width=DOUBLE, height=2.2, sharex=True)
    motion, multiplier = axes[:, 0]
    for number, probe in enumerate(probes):
        color = COLORS[number % len(COLORS)]
        heights = 1.0e3 * np.array([point[probe + SUFFIX] for point in points])
        _draw(motion, points, values, heights, color)
        _mark(motion, points, heights)
    largest = np.array([point["largest_multiplier"] for point in points])
    _draw(multiplier, points, values, largest, BLACK)
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
    panel: Axes, points: Sequence[Mapping[str, Any]], values: np.ndarray, heights: np.ndarray, color: str
) -> None:
    for _, branch in branch_parts(points):
        x, y = values[branch], heights[branch]
        for stable, part in stable_parts(points[branch]):
            panel.plot(x[part], y[part], STYLES[stable], color=color)


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
