"""Figures of curves: bending modes beside theory, response curves, wear along supports, histograms of impacts.

Response curves are drawn through where stable and dashed where unstable, with their events marked.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from gapbeam.postprocess.display_units import shown_along, shown_by
from gapbeam.postprocess.figures.figure_style import (
    BLACK,
    BLUE,
    DOUBLE,
    GRAY,
    GREEN,
    PURPLE,
    VERMILION,
    face_style,
    journal_style,
    letter,
    panels,
)
from gapbeam.postprocess.results.bounded_files import branch_parts, stable_parts
from gapbeam.postprocess.results.columns_of_run import WearMap
from gapbeam.postprocess.signals.cycle_counts import QUANTITIES, impact_units

STYLES = {"seated": (BLACK, "-"), "closed": (VERMILION, "--"), "free": (BLUE, ":")}
COLUMNS = 2


def draw_mode_shapes(modes: Mapping[str, Any], path: Path) -> Path:
    """Draw the motion of the axis in the first bending modes, the largest 1 and upward at the tip.

    Args:
        modes: Contents of `modes.json`.
        path: Path of the picture, PNG.

    Returns:
        The path.
    """
    count = int(modes.get("count") or len(modes["free"]))  # studies of earlier releases do not say
    rows = -(-count // COLUMNS)
    unit, factor = shown_along([state["x"] for state in modes["states"]])
    with journal_style():
        figure, axes = panels(rows, COLUMNS, height=1.6, sharex=True)
        for number, panel in enumerate(axes.flat):
            if number >= count:
                panel.set_visible(False)
                continue
            panel.axhline(0.0, color=GRAY, linewidth=0.5)
            words = []
            for state in modes["states"]:
                bending = [mode for mode in state["modes"] if mode["kind"] == "bending"]
                if number >= len(bending):
                    continue
                shape = np.array(bending[number]["motion"])
                color, line = STYLES[state["name"]]
                panel.plot(
                    factor * np.array(state["x"]), shape * np.sign(shape[-1]), color=color, linestyle=line,
                    label=state["name"],
                )  # fmt: skip
                words.append(f"{bending[number]['frequency']:.4g}")
            panel.set_title(f"mode {number + 1}: {', '.join(words)} Hz", fontsize=8.0)
            panel.set_ylim(-1.15, 1.15)
        for panel in axes[-1]:
            panel.set_xlabel(f"x ({unit})")
        letter([panel for panel in axes.flat if panel.get_visible()])
        figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper right", ncols=3)
        figure.savefig(path)
    return path


COLORS = (BLACK, BLUE, GREEN, PURPLE)
MARKS = {
    "fold": "o",
    "pitchfork": "D",
    "branch point": "X",
    "period doubling": "s",
    "Neimark-Sacker": "^",
    "grazing": "|",
}
RESPONSE_CURVE_STYLES = {
    True: "-",
    False: "--",
    None: ":",
}  # of lines, by whether a response is stable; None: not known
SUFFIX = ".peak_to_peak"
ALIKE = 1.0e-6


def draw_response_curve(curve: Mapping[str, Any]) -> Figure:
    """Draw the peak to peak of every probe and the largest multiplier over the varied key.

    Args:
        curve: Contents of curve.json.
    """
    points: list[dict[str, Any]] = curve["points"]
    values = np.array([point["value"] for point in points])
    probes = [name.removesuffix(SUFFIX) for name in points[0] if name.endswith(SUFFIX)]
    figure, axes = panels(2, 1, width=DOUBLE, height=2.2, sharex=True)
    motion, multiplier = axes[:, 0]
    unit, factor = shown_by("m", (point[probe + SUFFIX] for point in points for probe in probes))
    for number, probe in enumerate(probes):
        color = COLORS[number % len(COLORS)]
        heights = factor * np.array([point[probe + SUFFIX] for point in points])
        _draw(motion, points, values, heights, color)
        _mark(motion, points, heights)
    largest = np.array([point["largest_multiplier"] for point in points])
    _draw(multiplier, points, values, largest, BLACK)
    _mark(multiplier, points, largest)
    multiplier.axhline(1.0, color=GRAY, linewidth=0.6)
    if np.ptp(largest) < ALIKE * largest.max():  # the range of round-off would be drawn otherwise
        multiplier.set_ylim(0.0, 1.1 * max(1.0, float(largest.max())))
    motion.set_ylabel(f"peak to peak ({unit})")
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
            panel.plot(x[part], y[part], RESPONSE_CURVE_STYLES[stable], color=color)


def _mark(panel: Axes, points: Sequence[Mapping[str, Any]], heights: np.ndarray) -> None:
    for point, height in zip(points, heights, strict=True):
        if point["event"]:
            panel.plot(point["value"], height, MARKS[point["event"]], color=VERMILION, markersize=4, fillstyle="none")


def _keys(points: Sequence[Mapping[str, Any]], probes: Sequence[str]) -> Iterator[Line2D]:
    for number, probe in enumerate(probes):
        yield Line2D([], [], color=COLORS[number % len(COLORS)], label=probe)
    for stable, name in ((False, "unstable"), (None, "stability not known")):
        if any(point["stable"] is stable for point in points):
            yield Line2D([], [], color=GRAY, linestyle=RESPONSE_CURVE_STYLES[stable], label=name)
    for event in dict.fromkeys(point["event"] for point in points if point["event"]):
        yield Line2D([], [], color=VERMILION, marker=MARKS[event], linestyle="", fillstyle="none", label=event)


_COLUMNS = 3
_HEIGHT = 2.4  # inches of a row


def draw_wear(maps: Mapping[str, WearMap]) -> Figure:
    """Draw the work rate per area: of planes over x together, of each face around the beam over x and angle.

    Args:
        maps: Maps by face, at least one; see `gapbeam.postprocess.results.columns_of_run.wear_of`.
    """
    planes = {face: one for face, one in maps.items() if not one.around}
    around = {face: one for face, one in maps.items() if one.around}
    count = len(around) + bool(planes)
    columns = min(count, _COLUMNS)
    rows = -(-count // columns)
    figure, grid = panels(rows, columns, width=DOUBLE, height=_HEIGHT)
    cells = [cell for row in grid for cell in row]
    along = shown_along([one.x for one in maps.values()])
    if planes:
        _draw_planes(cells[0], planes, along)
    for cell, (face, one) in zip(cells[bool(planes) :], around.items(), strict=False):
        _draw_around(figure, cell, face, one, along)
    for cell in cells[count:]:
        cell.set_axis_off()
    letter(cells[:count])
    return figure


def _draw_planes(panel: Axes, planes: Mapping[str, WearMap], along: tuple[str, float]) -> None:
    for face, one in planes.items():
        x, density = one.along(one.density)
        panel.plot(along[1] * x, density, marker=".", markersize=3.0, label=face, **face_style(face, list(planes)))
    panel.set_xlabel(f"x ({along[0]})")
    panel.set_ylabel("work rate per area (W/m$^2$)")
    panel.set_ylim(bottom=0.0)
    panel.margins(x=0.02)
    panel.legend()


def _draw_around(figure: Figure, panel: Axes, face: str, one: WearMap, along: tuple[str, float]) -> None:
    drawn = panel.scatter(along[1] * one.x, one.angle, c=one.density, s=9.0, marker="s", cmap="viridis", vmin=0.0)
    panel.set_title(face)
    panel.set_xlabel(f"x ({along[0]})")
    panel.set_ylabel("angle from straight down (deg)")
    panel.set_yticks([-180.0, -90.0, 0.0, 90.0, 180.0])
    panel.margins(x=0.1)
    figure.colorbar(drawn, ax=panel, label="work rate per area (W/m$^2$)")


_MOST_BINS = 40


def draw_impacts(impacts: Mapping[str, np.ndarray], turning: Collection[str] = ()) -> Figure:
    """Draw the share of impacts by approach speed, impulse and duration.

    Args:
        impacts: Impacts by face, (k, 5), at least one; see `gapbeam.postprocess.results.columns_of_run.impacts_of`.
        turning: Faces between rotations, drawn in units of their own on the same axes.
    """
    units = impact_units(impacts, turning)
    figure, ((*drawn,),) = panels(1, len(QUANTITIES), width=DOUBLE, height=2.4)
    for column, (panel, name) in enumerate(zip(drawn, QUANTITIES, strict=True), start=1):
        values = {face: units[face][name][1] * rows[:, column] for face, rows in impacts.items()}
        together = np.concatenate(list(values.values()))
        count = min(_MOST_BINS, max(4, round(len(together) ** 0.5)))
        edges = np.linspace(0.0, 1.0001 * float(together.max()) or 1.0, count + 1)
        for face, mine in values.items():
            share = np.histogram(mine, edges)[0] / len(mine)
            panel.stairs(100.0 * share, edges, label=face, **face_style(face, list(impacts)))
        panel.set_xlabel(f"{name} ({' or '.join(dict.fromkeys(one[name][0] for one in units.values()))})")
    drawn[0].set_ylabel("share of impacts (%)")
    letter(drawn)
    figure.legend(*drawn[0].get_legend_handles_labels(), loc="outside upper center", ncols=4)
    return figure


def draw_coefficients(found: Mapping[str, Any]) -> Figure:
    """Draw measured coefficients of a flow and their fit over the reduced velocity, real and imaginary parts.

    Args:
        found: `coefficients` of a feedback in a summary.
    """
    names = [name for name in found["measured"] if name != "reduced_velocity"]
    figure, axes = panels(len(names), 2, width=DOUBLE, height=2.2, sharex=True)
    for row, name in zip(axes, names, strict=True):
        for panel, part in zip(row, ("real", "imaginary"), strict=True):
            for kind, style in (("measured", "o"), ("fit", "-")):
                x, y = found[kind]["reduced_velocity"], found[kind][name][part]
                panel.plot(x, y, style, color=BLACK if kind == "measured" else COLORS[0], markersize=3, label=kind)
            panel.set_ylabel(f"{part} part of {name}")
            panel.margins(x=0.02)
    for panel in axes[-1]:
        panel.set_xlabel("reduced velocity U/(f D)")
    axes[0, 0].legend(title=f"misfit {100.0 * found['misfit']:.2g} % of the largest", loc="best")
    return figure
