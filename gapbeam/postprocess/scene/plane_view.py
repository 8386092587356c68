"""The scene of one run: two views and a sheet; a plane is drawn by Agg, without OpenGL, a solid by VTK."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, Literal, NamedTuple, Protocol, TypeVar

import numpy as np
from matplotlib.artist import Artist
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch, Polygon
from matplotlib.path import Path
from matplotlib.transforms import IdentityTransform

from gapbeam.postprocess.display_units import size_words
from gapbeam.postprocess.results.columns_of_run import supports_of, wall_motions
from gapbeam.postprocess.results.field_reader import Fields, Frame
from gapbeam.postprocess.results.results import Results
from gapbeam.postprocess.results_errors import ResultsError
from gapbeam.postprocess.scene.film import prepare_offscreen
from gapbeam.postprocess.scene.motion_range import (
    MotionRange,
    Window,
    carrying_section,
    motion_of,
    scale_of_support,
    scale_of_whole,
    shown_displacement,
    window_of_support,
    window_of_whole,
)
from gapbeam.postprocess.scene.set_up import MeshedBody, PlaneBody, plane_body
from gapbeam.postprocess.scene.sheet import ZOOM, Sheet, pixels, whole_place
from gapbeam.postprocess.scene.support_surface import (
    FaceBox,
    Mark,
    SupportBoxes,
    carried_by,
    marks_of,
    placed,
    support_of,
)
from gapbeam.postprocess.scene.surface_color import ABOVE, BEAM, BELOW, CELLS, EDGE, REST, ColoredCells, SurfaceColor
from gapbeam.postprocess.scene.traces import caption_of, loudest_face, traces_of

Drawn = TypeVar("Drawn", bound=Artist)

_DPI = 64  # a power of two: figures of whole pixels have a size without round-off
_POINTS = 72.0 / _DPI  # of a pixel
_FACE_LINE = 7.0
_PIECE = 2.0  # pixels of a face that have one color
_OVERLAP = 0.5  # pixels at both ends of each, or the ground would shine through between two
_HIDDEN = 4.0 / 256.0  # of the scale: where there is less pressure than that, a face has no color


class PlaneView:
    """A picture that the window fills exactly.

    Artists are in pixels from the lower left; what no frame changes is drawn once.
    """

    def __init__(
        self,
        body: PlaneBody,
        support: SupportBoxes,
        window: Window,
        size: tuple[int, int],
        scale: float,
        color: SurfaceColor,
        meshed: bool = False,
    ) -> None:
        """Set up the scene.

        Args:
            body: The beam.
            support: Support, drawn with its clearance times `scale`.
            window: Window of the view.
            size: Width and height of the picture in pixels.
            scale: Factor of displacements and clearance.
            color: Color of the beam.
            meshed: Whether the cells of the mesh are drawn.
        """
        self._body, self._support, self._scale, self._color = body, support, scale, color
        self._center, self._size = np.array(window.center), np.array(size)
        self._fine = size[1] / (window.height[1] - window.height[0])  # pixels of a meter
        self._line = max(1.0, size[0] / 900)
        self._figure = Figure(figsize=(size[0] / _DPI, size[1] / _DPI), dpi=_DPI, facecolor="white")
        self._canvas = FigureCanvasAgg(self._figure)
        self._add(PathPatch(self._outline(body.rest), fill=False, ec=REST, lw=self._width(0.7)))
        walls = [(piece, self._add(self._wall(piece))) for piece in support.blocks]
        self._walls = [(piece, patch) for piece, patch in walls if piece.met.moves]
        for _, patch in self._walls:
            patch.set_visible(False)
        self._canvas.draw()  # type: ignore[no-untyped-call]
        self._ground: Any = self._canvas.copy_from_bbox(self._figure.bbox)  # type: ignore[no-untyped-call]
        for _, patch in self._walls:
            patch.set_visible(True)
        self._skin = self._add(PathPatch(self._outline(body.rest), fc=BEAM, lw=0.0))
        self._stress = ColoredCells(body.cells, color) if color.everywhere else None
        self._lines = self._add(LineCollection([], colors=CELLS, linewidths=self._width(0.4))) if meshed else None
        self._edges = self._add(PathPatch(self._skin.get_path(), fill=False, ec=EDGE, lw=self._width(1.0)))
        self._faces = self._add(LineCollection([], linewidths=self._width(_FACE_LINE), capstyle="butt"))

    def picture(self, frame: Frame, motions: Mapping[str, float] | None = None) -> np.ndarray:
        """Draw one frame.

        Args:
            frame: The fields.
            motions: `wall_motion` by its name, m; None: walls are where they were at t = 0.

        Returns:
            Its pixels, (height, width, 4), 8 bits, until the next one is drawn.
        """
        renderer = self._canvas.get_renderer()  # type: ignore[no-untyped-call]
        self._canvas.restore_region(self._ground)  # type: ignore[no-untyped-call]
        for piece, patch in self._walls:
            patch.set_xy(self._corners(replace(piece, met=piece.met.moved(motions or {}))))
            patch.draw(renderer)
        places = self._body.rest + self._scale * shown_displacement(frame, self._scale)[:, :2]
        outline, values = self._outline(places), self._color.values(frame)
        self._skin.set_path(outline)
        self._edges.set_path(outline)
        self._skin.draw(renderer)
        if self._stress is not None:
            self._stress.draw(renderer, outline, self._pixels(places), values)
        if self._lines is not None:
            self._lines.set_segments(list(self._pixels(places)[self._body.lines]))
            self._lines.draw(renderer)
        self._edges.draw(renderer)
        if self._stress is None:  # faces are lines, which would hide the stress at the edges
            self._color_faces(self._pixels(places), values)
            self._faces.draw(renderer)
        return np.asarray(self._canvas.buffer_rgba())  # type: ignore[no-untyped-call]

    def hurry(self) -> None:
        """Draw on as before: smooth lines cost nothing here."""

    def fractions(self, points: np.ndarray) -> np.ndarray:
        """Return the places of points, (k, 3), m, in the picture, (k, 2): fractions of its width and height."""
        return np.asarray(self._pixels(points[:, :2]) / self._size)

    def close(self) -> None:
        """Let the picture go."""
        self._figure.clear()

    def _pixels(self, places: np.ndarray) -> np.ndarray:
        """Return the pixels of places, (..., 2), m, in the picture."""
        return np.asarray(0.5 * self._size + self._fine * (places - self._center))

    def _width(self, lines: float) -> float:
        return lines * self._line * _POINTS

    def _add(self, artist: Drawn) -> Drawn:
        """Take an artist into the figure, its places in pixels and not rounded to whole ones."""
        artist.set_transform(IdentityTransform())
        artist.set_snap(False)
        self._figure.add_artist(artist)
        return artist

    def _outline(self, places: np.ndarray) -> Path:
        """Return the outline of the beam, its points at some places, (n, 2), m."""
        corners = self._pixels(places)
        return Path.make_compound_path(*(Path(corners[[*loop, loop[0]]], closed=True) for loop in self._body.loops))

    def _wall(self, piece: FaceBox) -> Polygon:
        color = BELOW if piece.met.below else ABOVE
        return Polygon(self._corners(piece), fc=color, ec=EDGE, lw=self._width(1.0), joinstyle="miter")

    def _corners(self, piece: FaceBox) -> np.ndarray:
        """Return the corners of a face of a support, (4, 2), pixels."""
        first, last, low, high, _, _ = self._support.box(piece, self._scale)
        corners = np.array([(first, low), (last, low), (last, high), (first, high)])
        corners[:, 1] += piece.rise(corners[:, 0], self._scale)
        return self._pixels(corners)

    def _color_faces(self, corners: np.ndarray, values: np.ndarray) -> None:
        """Cut the faces into pieces of one color each; of those pressed, given all points, (n, 2), pixels."""
        pressed = self._body.faces[values[self._body.faces].max(axis=1, initial=0.0) > 0.0]
        ends, limit = corners[pressed], self._color.limits[1]
        along = ends[:, 1] - ends[:, 0]
        lengths = np.linalg.norm(along, axis=1)
        count = max(1, int(np.ceil(lengths.max(initial=0.0) / _PIECE)))
        share = np.arange(count + 1)[:, None, None] / count
        cuts = ends[:, 0] + share * along
        more = _OVERLAP * along / np.maximum(lengths, 1e-9)[:, None]
        pieces = np.stack([cuts[:-1] - more, cuts[1:] + more], axis=2).reshape(-1, 2, 2)
        middle = share[:-1, :, 0] + 0.5 / count
        found = ((1.0 - middle) * values[pressed[:, 0]] + middle * values[pressed[:, 1]]).ravel() / limit
        shown = found >= _HIDDEN
        self._faces.set_segments(list(pieces[shown]))
        self._faces.set_color(self._color.colors(found[shown]))


class PictureView(Protocol):
    """A view of the beam in its support; to be closed."""

    def picture(self, frame: Frame, motions: Mapping[str, float] | None = None) -> np.ndarray:
        """Draw one frame, (height, width, 3 or 4), 8 bits; to be used before the next one is drawn."""

    def hurry(self) -> None:
        """Draw from now on as films are drawn."""

    def fractions(self, points: np.ndarray) -> np.ndarray:
        """Return the places of points, (k, 3), m, in the picture, (k, 2): fractions of its width and height."""

    def close(self) -> None:
        """Release the figure."""


class Shot(NamedTuple):
    """Settings of one view.

    Attributes:
        window: Window of the view.
        size: Width and height of the picture in pixels.
        scale: Factor of displacements and clearance.
        direction: Direction from the target to the camera, of a solid.
    """

    window: Window
    size: tuple[int, int]
    scale: float
    direction: tuple[float, float, float]


def views_of(
    mesh: MeshedBody, support: SupportBoxes, shots: Sequence[Shot], color: SurfaceColor, meshed: bool = False
) -> tuple[list[PictureView], dict[str, np.ndarray]]:
    """Set up views of a beam.

    Args:
        mesh: The fields of a run, or a mesh.
        support: Beam and support of the same run.
        shots: One for each view.
        color: Color of the beam.
        meshed: Whether the cells of the mesh are drawn.

    Returns:
        The views, and the numbers of the mesh points on each face of the supports.

    Raises:
        RenderError: No solid can be drawn off-screen here.
    """
    if support.dimension == 2:
        plane = plane_body(mesh, support)
        return [
            PlaneView(plane, support, one.window, one.size, one.scale, color, meshed) for one in shots
        ], plane.touching
    prepare_offscreen()
    # VTK reads the choice just made when it is first loaded.
    from gapbeam.postprocess.scene.camera_view import View, body_of

    body = body_of(mesh, support)
    return [View(body, support, *one[:3], color, one.direction, meshed) for one in shots], body.touching


Scale = Literal["auto"] | float

# From the beam to the camera: nearly from the side, and for the support more from above and the free end.
FROM_WHOLE = (0.10, -1.0, 0.28)
FROM_SUPPORT = (0.45, -1.0, 0.38)

_SEEN = 5.0e-3  # of the length of the beam

_NEARLY = 0.95
"""Least share of the largest recorded force: fields with less do not show the impact."""


class Studio:
    """Draws sheets of a run; to be closed."""

    def __init__(
        self,
        results: Results,
        fields: Fields,
        scale: Scale,
        size: tuple[int, int],
        frames_per_second: float,
        stress: str | None = None,
    ) -> None:
        """Set up.

        Args:
            results: Results of the run.
            fields: Its fields, open, with one frame at least.
            scale: Factor of displacements and clearance in both views, or "auto": a round one for each.
            size: Size of the sheet, pixels.
            frames_per_second: Frames per second of the film; 0 for no film.
            stress: Field of stress that the beam is colored by; None: contact pressure on its faces.

        Raises:
            ResultsError: There is no such field.
            RenderError: No solid can be drawn off-screen here.
        """
        self._fields, self._history = fields, results.history
        supports = supports_of(results.summary, results.case)
        support = support_of(fields.points, fields.dimension, supports, loudest_face(results))
        motion = motion_of(fields, support.shown_near)
        color = SurfaceColor.of_pressure(motion.largest_pressure)
        if stress is not None:
            _check_stress(fields, motion, stress)
            color = SurfaceColor.of_stress(stress, motion.largest_stress)
        sizes = pixels(whole_place(color), size), pixels(ZOOM, size)
        factors = (
            (scale_of_whole(motion, support, sizes[0]), scale_of_support(motion, support))
            if scale == "auto"
            else (float(scale), float(scale))
        )
        marks = tuple(marks_of(results.case, support.start))
        windows = (
            window_of_whole(motion, support, factors[0], sizes[0], carried_by(marks, support.middle)),
            window_of_support(support, factors[1], sizes[1]),
        )
        directions = FROM_WHOLE, FROM_SUPPORT
        shots = [Shot(*shot) for shot in zip(windows, sizes, factors, directions, strict=True)]
        self._views, touching = views_of(fields, support, shots, color)
        self._motion, self._traces = motion, traces_of(results, motion.times, motion.tip)
        close = {block.met.face: touching[block.met.face] for block in support.near_blocks()}
        caption = caption_of(
            results.title,
            factors,
            support.clearance,
            results.forcing_frequency,
            motion.times,
            frames_per_second,
            slides=motion.slide * max(factors) > _SEEN * (support.end - support.start),
        )
        pressures = fields.points, close, motion.largest_pressure
        self._marks = partial(placed, support=support, heights=windows[0].height, fractions=self._views[0].fractions)
        self._scale, self._masses = factors[0], tuple(mark for mark in marks if mark.moves)
        self._sections = {mark.name: carrying_section(fields.points, mark.x - mark.ahead) for mark in self._masses}
        self._sheet = Sheet(size, support, pressures, self._traces, caption, windows, tuple(self._marks(marks)), color)

    def moments(self) -> dict[str, tuple[int, str]]:
        """The frames worth a picture: number and remark by name."""
        motion, forces = self._motion, self._traces.total_force(self._motion.times)
        if forces is None:
            strongest, remark = motion.strongest, "largest contact pressure of all fields"
        else:
            strongest = int(np.argmax(forces))
            size = size_words(float(forces[strongest]), unit="N")
            remark = f"largest contact force of all fields: {size} on {self._traces.faces} together"
            time, force = self._traces.peak_force()
            if forces[strongest] < _NEARLY * force:
                remark += f"; between fields {size_words(force, unit='N')} at {size_words(time, unit='s')}"
        farthest = int(np.argmax(np.abs(motion.tip)))
        tip = size_words(float(motion.tip[farthest]))
        return {
            "largest_contact_force": (strongest, remark),
            "largest_displacement": (farthest, f"largest displacement of the free end of all fields: {tip}"),
        }

    def draw(self, index: int, remark: str = "") -> np.ndarray:
        """Draw the sheet of one frame, (height, width, 4), 8 bits; it stays until the next one is drawn."""
        frame = self._fields.frame(index)
        motions = wall_motions(self._history, frame.time)
        whole, near = (view.picture(frame, motions) for view in self._views)
        if self._masses:
            self._sheet.move(self._marks(self._masses, motion=self._carried(frame)))
        return self._sheet.fill(frame, whole, near, remark)

    def _carried(self, frame: Frame) -> Callable[[Mark, np.ndarray], np.ndarray]:
        """Return the drawn places of the points of a mass in a frame."""
        shown = shown_displacement(frame, self._scale)

        def drawn(mark: Mark, points: np.ndarray) -> np.ndarray:
            section = self._sections[mark.name]
            return np.array([point + self._scale * section.of(shown, point) for point in points])

        return drawn

    def hurry(self) -> None:
        """Draw from now on as films are drawn, with less care for edges and in less time."""
        for view in self._views:
            view.hurry()

    def close(self) -> None:
        """Let the graphics memory go."""
        for view in self._views:
            view.close()


def _check_stress(fields: Fields, motion: MotionRange, stress: str) -> None:
    """Refuse to color by a stress that the run did not write.

    Raises:
        ResultsError: The run did not write this stress.
    """
    if stress not in motion.largest_stress:
        raise ResultsError(
            fields.path,
            found="fields without stress",
            expected=f"{stress} in every field",
            remedy="run the case with `--set output.stress=true`",
        )
