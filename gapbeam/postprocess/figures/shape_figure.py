"""Picture of structures in space: undeformed, at the start, at the largest displacement, and the gaps of supports."""

from __future__ import annotations

from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d import Axes3D
from mpl_toolkits.mplot3d.art3d import Line3DCollection

from gapbeam.postprocess.figures.figure_style import BLACK, BLUE, DOUBLE, GRAY, GREEN, VERMILION, journal_style
from gapbeam.postprocess.results.bounded_files import read_json
from gapbeam.solver.scene.structure_geometry import directions_across
from gapbeam.solver.schema.record_table import SHAPES_FILE

SHARE = 0.08  # of the size of the structures: the largest displacement in the picture
PLATE = 0.025  # half the side of a wall
TICKS, MANY = 5, 100  # of the longest axis, and lines beyond which they are thinner
DOTS = 170
STYLES = {"start": (BLUE, "at the start"), "largest": (VERMILION, "at the largest displacement")}


def shapes_of(folder: Path) -> Mapping[str, Any] | None:
    """Return the contents of `shapes.json` of a run; None where it has none.

    Raises:
        ResultsError: The file cannot be read.
    """
    path = folder / SHAPES_FILE
    return read_json(path, "repeat the run") if path.is_file() else None


def draw_shapes(shapes: Mapping[str, Any]) -> Figure:
    """Draw structures in space; displacements and gaps are enlarged by one factor, which the picture states.

    Args:
        shapes: Contents of `shapes.json`.
    """
    bodies = [(np.array(one["places"]), np.array(one["lines"], dtype=int).reshape(-1, 2),
               {name: np.array(u) for name, u in one["shapes"].items()}) for one in shapes["structures"]]  # fmt: skip
    every = np.vstack([places for places, _, _ in bodies])
    size = float(np.linalg.norm(np.ptp(every, axis=0))) or 1.0
    most = max((float(np.linalg.norm(u, axis=1).max()) for _, _, found in bodies for u in found.values()), default=0.0)
    factor = _round(SHARE * size / most) if most > 0.0 else 1.0
    figure = Figure(figsize=(DOUBLE, 0.72 * DOUBLE))
    with rc_context({"grid.linewidth": 0.3, "grid.color": "#CCCCCC"}):
        axes = figure.add_subplot(projection="3d")
    assert isinstance(axes, Axes3D)
    for places, lines, found in bodies:
        _lines(axes, places, lines, GRAY, 1.0)
        for name, u in found.items():
            if name in STYLES and np.any(u):
                _lines(axes, places + factor * u, lines, STYLES[name][0], 1.4)
    for one in shapes["supports"]:
        _support(axes, one, factor, PLATE * size)
    axes.plot([], [], [], color=GRAY, label="undeformed")
    for name, (color, words) in STYLES.items():
        if any(name in found and np.any(found[name]) for _, _, found in bodies):
            axes.plot([], [], [], color=color, label=f"{words}, t = {shapes['times'][name]:.4g} s")
    if shapes["supports"]:
        axes.plot([], [], [], color=BLACK, label="walls of supports")
    axes.legend(loc="upper left", title=f"displacements and gaps times {factor:g}")
    spans = np.maximum(np.ptp(every, axis=0), 0.15 * np.ptp(every, axis=0).max())
    middle = 0.5 * (every.min(axis=0) + every.max(axis=0))
    for k, axis in enumerate("xyz"):
        getattr(axes, f"set_{axis}lim")(middle[k] - 0.55 * spans[k], middle[k] + 0.55 * spans[k])
        getattr(axes, f"set_{axis}label")(f"{axis} (m)")
        getattr(axes, f"{axis}axis").pane.set_facecolor((1.0, 1.0, 1.0, 0.0))
        getattr(axes, f"{axis}axis").set_major_locator(MaxNLocator(1 + round(TICKS * spans[k] / spans.max())))
    axes.set_box_aspect(tuple(spans), zoom=0.9)
    axes.view_init(elev=24.0, azim=-60.0)
    return figure


def shape_picture(shapes: Mapping[str, Any]) -> bytes:
    """Draw structures in space and return the PNG file."""
    with journal_style(), rc_context({"figure.constrained_layout.use": False}):
        file = BytesIO()
        draw_shapes(shapes).savefig(file, format="png", dpi=DOTS)
    return file.getvalue()


def _lines(axes: Axes3D, places: np.ndarray, lines: np.ndarray, color: str, width: float) -> None:
    if len(lines):
        thin = min(1.0, (MANY / len(lines)) ** 0.5)
        axes.add_collection3d(Line3DCollection(places[lines], colors=color, linewidths=width * thin))
    else:
        axes.plot(*places.T, ".", color=color, markersize=2.0)


def _support(axes: Axes3D, one: Mapping[str, Any], factor: float, half: float) -> None:
    """Draw the walls of a support: plates across the direction of its point, or an outline in the plane of two."""
    place, ways, walls = np.array(one["place"]), np.array(one["ways"]), np.array(one["walls"])
    if not len(walls):
        axes.plot(*place[:, None], "D", color=GREEN, markersize=4.0)
    elif len(ways) == 1:
        plate = half * np.array([[1, 1], [1, -1], [-1, -1], [-1, 1], [1, 1]]) @ directions_across(ways[0])
        for wall in walls:
            axes.plot(*(place + factor * wall[0] * ways[0] + plate).T, color=BLACK, linewidth=1.0)
    else:
        outline = place + factor * np.vstack([walls, walls[:1]]) @ ways
        axes.plot(*outline.T, color=BLACK, linewidth=1.0)
    axes.text(*(place + 1.2 * half), one["name"], fontsize=7.0)


def _round(x: float) -> float:
    """Return the largest of 1, 2, 5, 10, ... that is not above a number."""
    power = 10.0 ** np.floor(np.log10(x))
    return float(power * max(one for one in (1.0, 2.0, 5.0) if one * power <= x * (1.0 + 1e-9)))
