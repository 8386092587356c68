"""Structures in space: a figure of their shapes, and the frames of a film.

Displacements and gaps are enlarged by one factor, which the picture states.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import xarray as xr
from matplotlib import rc_context
from matplotlib.artist import Artist
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d import Axes3D
from mpl_toolkits.mplot3d.art3d import Line3DCollection

from gapbeam.postprocess.display_units import rounded_down
from gapbeam.postprocess.figures.figure_style import BLACK, BLUE, DOUBLE, GRAY, GREEN, VERMILION, journal_style
from gapbeam.postprocess.results.bounded_files import check_hdf5, read_json
from gapbeam.postprocess.results_errors import ResultsError
from gapbeam.solver.scene.structure_geometry import directions_across
from gapbeam.solver.schema.record_table import SHAPES_DATA_FILE, SHAPES_FILE

SHARE = 0.08  # of the size of the structures: the largest displacement in the picture
PLATE = 0.025  # half the side of a wall
TICKS, MANY = 5, 100  # of the longest axis, and lines beyond which they are thinner
DOTS = 170
DOTS_OF_FILM = 110
ZOOM, SQUARE = 0.85, 1.4  # of the axes, and width over height beyond which they are larger than a square
SHAPE_STYLES = {"start": (BLUE, "at the start"), "largest": (VERMILION, "at the largest displacement")}


def shapes_of(folder: Path) -> Mapping[str, Any] | None:
    """Return the contents of `shapes.json` of a run; None where it has none.

    Raises:
        ResultsError: The file cannot be read.
    """
    path = folder / SHAPES_FILE
    return read_json(path, "repeat the run") if path.is_file() else None


class ShapeDrawing:
    """Undeformed structures and the walls of their supports, to which shapes are added.

    Args:
        shapes: Contents of `shapes.json`.
        size: Width and height, inches.
        scale: Factor of displacements and gaps; None: a round one.

    Attributes:
        figure: The figure.
        factor: Factor of displacements and gaps.
        walls: Artists of each support, by its name.
    """

    def __init__(self, shapes: Mapping[str, Any], size: tuple[float, float], scale: float | None = None) -> None:
        self.bodies = [(np.array(one["places"]), np.array(one["lines"], dtype=int).reshape(-1, 2),
                        {name: np.array(u) for name, u in one["shapes"].items()})
                       for one in shapes["structures"]]  # fmt: skip
        every = np.vstack([places for places, _, _ in self.bodies])
        extent = float(np.linalg.norm(np.ptp(every, axis=0))) or 1.0
        sizes = [np.linalg.norm(u, axis=1).max() for _, _, found in self.bodies for u in found.values()]
        most = float(max(sizes, default=0.0))
        self.factor = scale or (rounded_down(SHARE * extent / most) if most > 0.0 else 1.0)
        self.figure = Figure(figsize=size)
        with rc_context({"grid.linewidth": 0.3, "grid.color": "#CCCCCC"}):
            axes = self.figure.add_subplot(projection="3d")
        assert isinstance(axes, Axes3D)
        self.axes = axes
        self.add(None, GRAY, 1.0)
        self.walls = {one["name"]: _support(axes, one, self.factor, PLATE * extent) for one in shapes["supports"]}
        axes.plot([], [], [], color=GRAY, label="undeformed")
        spans = np.maximum(np.ptp(every, axis=0), 0.15 * np.ptp(every, axis=0).max())
        middle = 0.5 * (every.min(axis=0) + every.max(axis=0))
        for k, axis in enumerate("xyz"):
            getattr(axes, f"set_{axis}lim")(middle[k] - 0.55 * spans[k], middle[k] + 0.55 * spans[k])
            getattr(axes, f"set_{axis}label")(f"{axis} (m)")
            getattr(axes, f"{axis}axis").pane.set_facecolor((1.0, 1.0, 1.0, 0.0))
            getattr(axes, f"{axis}axis").set_major_locator(MaxNLocator(1 + round(TICKS * spans[k] / spans.max())))
        axes.set_position((0.0, 0.0, 1.0, 1.0))
        axes.set_box_aspect(tuple(spans), zoom=ZOOM * max(1.0, size[0] / size[1] / SQUARE))
        axes.view_init(elev=24.0, azim=-60.0)

    def add(self, moved: Sequence[np.ndarray] | None, color: str, width: float) -> list[Artist]:
        """Draw a shape, and return its artists.

        Args:
            moved: Displacements of the nodes of each structure, (nodes, 3), m; None: undeformed.
            color: Color of its lines.
            width: Width of its lines, points.
        """
        found: list[Artist] = []
        for k, (places, lines, _) in enumerate(self.bodies):
            now = places if moved is None else places + self.factor * moved[k]
            if len(lines):
                thin = min(1.0, (MANY / len(lines)) ** 0.5)
                drawn = Line3DCollection(now[lines], colors=color, linewidths=width * thin, clip_on=False)
                found.append(self.axes.add_collection3d(drawn) or drawn)
            else:
                found += self.axes.plot(*now.T, ".", color=color, markersize=2.0, clip_on=False)
        return found

    def name(self, entries: Mapping[str, str], walls: str) -> None:
        """Write the legend.

        Args:
            entries: Color of the line for each entry.
            walls: Entry of walls, if there are any.
        """
        for words, color in entries.items():
            self.axes.plot([], [], [], color=color, label=words)
        if self.walls:
            self.axes.plot([], [], [], color=BLACK, label=walls)
        title = f"displacements and gaps times {self.factor:g}"
        self.axes.legend(
            loc="upper left", bbox_to_anchor=(0.01, 0.99), bbox_transform=self.figure.transFigure, title=title
        )


def draw_shapes(shapes: Mapping[str, Any]) -> Figure:
    """Draw structures in space undeformed, at the start and at their largest displacement.

    Args:
        shapes: Contents of `shapes.json`.
    """
    drawing, named = ShapeDrawing(shapes, (DOUBLE, 0.72 * DOUBLE)), dict[str, str]()
    for name, (color, words) in SHAPE_STYLES.items():
        moved = [found.get(name, np.zeros_like(places)) for places, _, found in drawing.bodies]
        if any(np.any(u) for u in moved):
            drawing.add(moved, color, 1.4)
            named[f"{words}, t = {shapes['times'][name]:.4g} s"] = color
    drawing.name(named, "walls of supports")
    return drawing.figure


def shape_picture(shapes: Mapping[str, Any]) -> bytes:
    """Draw structures in space and return the PNG file."""
    with journal_style(), rc_context({"figure.constrained_layout.use": False}):
        file = BytesIO()
        draw_shapes(shapes).savefig(file, format="png", dpi=DOTS)
    return file.getvalue()


def film_times(folder: Path) -> np.ndarray:
    """Return the times of the shapes that a run wrote, s; none where it wrote none.

    Raises:
        ResultsError: The file cannot be read.
    """
    return _read(folder, ["times"])[0] if (folder / SHAPES_DATA_FILE).is_file() else np.zeros(0)


def film_frames(
    folder: Path, history: xr.Dataset, chosen: Sequence[int], size: tuple[int, int], scale: float | None
) -> Iterator[np.ndarray]:
    """Yield frames of a film of structures, (height, width, 4), 8 bits; walls are orange while something touches them.

    Args:
        folder: Results folder.
        history: `Results.history`.
        chosen: Numbers of the shapes.
        size: Width and height, pixels.
        scale: Factor of displacements and gaps; None: a round one.

    Raises:
        ResultsError: A file cannot be read.
    """
    shapes = shapes_of(folder)
    assert shapes is not None
    times, *moved = _read(folder, ["times", *(f"displacement/{number}" for number in chosen)])
    with journal_style(), rc_context({"figure.constrained_layout.use": False}):
        inches = (size[0] / DOTS_OF_FILM, size[1] / DOTS_OF_FILM)
        drawing = ShapeDrawing(shapes, inches, scale)
        drawing.name({"deformed": VERMILION}, "walls of supports, orange: touched")
        drawing.figure.set_dpi(DOTS_OF_FILM)
        canvas, clock = FigureCanvasAgg(drawing.figure), drawing.figure.text(0.98, 0.96, "", ha="right", va="top")
        ends = np.cumsum([len(places) for places, _, _ in drawing.bodies])[:-1]
        for number, displacements in zip(chosen, moved, strict=True):
            shape = drawing.add(np.split(displacements, ends), VERMILION, 2.0)
            touched = _touched(history, times[max(number - 1, 0)], times[number])
            for name, artists in drawing.walls.items():
                for artist in artists:
                    artist.set_color(VERMILION if name in touched else BLACK)  # type: ignore[attr-defined]
            clock.set_text(f"t = {times[number]:.4g} s")
            canvas.draw()  # type: ignore[no-untyped-call]
            yield np.asarray(canvas.buffer_rgba()).copy()  # type: ignore[no-untyped-call]
            for artist in shape:
                artist.remove()


def _touched(history: xr.Dataset, begin: float, end: float) -> set[str]:
    """Return the names of contacts with a force between two times, or at one."""
    if "contact_force" not in history:
        return set()
    time = history["time"].values
    some = (time > begin) & (time <= end) if end > begin else time == end
    forces = history["contact_force"].values[some]
    return {str(name) for name, force in zip(history["face"].values, forces.T, strict=True) if np.any(force > 0.0)}


def _read(folder: Path, names: Iterable[str]) -> list[np.ndarray]:
    path = folder / SHAPES_DATA_FILE
    try:
        with h5py.File(path, "r", locking=False) as file:
            check_hdf5(path, file)
            return [np.asarray(file[name]) for name in names]
    except (OSError, KeyError, RuntimeError) as error:
        raise ResultsError(path, found=f"a file that cannot be read ({error})", expected="the shapes of a run",
                           remedy="repeat the run") from error  # fmt: skip


def _support(axes: Axes3D, one: Mapping[str, Any], factor: float, half: float) -> list[Artist]:
    """Draw the walls of a support: plates across the direction of its point, or an outline in the plane of two."""
    drawn = list[Artist]()
    place, ways, walls = np.array(one["place"]), np.array(one["ways"]), np.array(one["walls"])
    if not len(walls):
        drawn += axes.plot(*place[:, None], "D", color=GREEN, markersize=4.0, clip_on=False)
    elif len(ways) == 1:
        plate = half * np.array([[1, 1], [1, -1], [-1, -1], [-1, 1], [1, 1]]) @ directions_across(ways[0])
        for wall in walls:
            drawn += axes.plot(
                *(place + factor * wall[0] * ways[0] + plate).T, color=BLACK, linewidth=1.0, clip_on=False
            )
    else:
        outline = place + factor * np.vstack([walls, walls[:1]]) @ ways
        drawn += axes.plot(*outline.T, color=BLACK, linewidth=1.0, clip_on=False)
    axes.text(*(place + 1.2 * half), one["name"], fontsize=7.0)
    return drawn
