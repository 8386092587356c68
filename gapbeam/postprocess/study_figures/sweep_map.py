"""The map of a sweep over two keys: figures in color with contour lines, a panel for each figure."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from gapbeam.postprocess.display_units import LENGTHS, shown
from gapbeam.postprocess.figures.figure_style import BLACK, VERMILION, journal_style, panels
from gapbeam.postprocess.study_figures.sweep_branches import SweepPoint, drawn_figures

FEWEST = 3  # values of a key: fewer make no map
LINES = 6
ABREAST = 3

Array = np.ndarray


def grid_of(points: Sequence[SweepPoint]) -> tuple[tuple[str, str], Array, Array] | None:
    """Return the two keys of a grid and their ascending values, SI; None: the sweep is over no such grid.

    Args:
        points: Of the sweep. A grid has every pair of at least three numbers of each of two keys, and no other key.
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


def heights(points: Sequence[SweepPoint], name: str) -> Array:
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


def draw_map(points: Sequence[SweepPoint], path: Path, names: Sequence[str] = ()) -> Path | None:
    """Draw figures over the two keys of a sweep; None: it is over no grid, and nothing is drawn.

    Crosses mark points where a response did not pass, rings those where responses coexist.

    Args:
        points: The census.
        path: File to write; its suffix gives the format.
        names: Names of the figures; by default those of `draw_branches`.
    """
    found, names = grid_of(points), list(names) or drawn_figures(points)
    if found is None or not names:
        return None
    keys, *axes = found
    labels, scales = zip(*(shown("m") if key.endswith(LENGTHS) else ("SI", 1.0) for key in keys), strict=True)
    x, y = (scale * axis for scale, axis in zip(scales, axes, strict=True))
    abreast = min(len(names), ABREAST)
    with journal_style():
        figure, grid = panels(-(-len(names) // abreast), abreast, width=1.0 + 2.9 * abreast, height=2.6)
        for panel, name in zip(grid.flat, names, strict=False):
            unit = next(b.figures[name][2] for p in points for b in p.branches if name in b.figures)
            unit, factor = shown(unit)
            values = factor * heights(points, name)
            colors = panel.pcolormesh(x, y, values, shading="nearest", cmap="viridis")
            figure.colorbar(colors, ax=panel, label=f"{name} ({unit})")
            if np.nanmax(values) > np.nanmin(values):
                lines = panel.contour(x, y, values, levels=LINES, colors=BLACK, linewidths=0.6)
                panel.clabel(lines, fontsize="x-small", fmt="%.3g")
            _mark(panel, points, keys, scales)
            panel.set_xlabel(f"{keys[0]} ({labels[0]})")
            panel.set_ylabel(f"{keys[1]} ({labels[1]})")
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
