"""The scene of one run: two views and a sheet, set up once for pictures and film."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Literal

import numpy as np

from gapbeam.postprocess.results.field_reader import Fields, Frame
from gapbeam.postprocess.results.results import Results
from gapbeam.postprocess.results.supports_of_run import supports_of, wall_motions
from gapbeam.postprocess.results_errors import ResultsError
from gapbeam.postprocess.scene.camera_window import (
    scale_of_support,
    scale_of_whole,
    window_of_support,
    window_of_whole,
)
from gapbeam.postprocess.scene.caption import caption_of
from gapbeam.postprocess.scene.carrying_section import carrying_section
from gapbeam.postprocess.scene.motion_range import MotionRange, motion_of, shown_displacement
from gapbeam.postprocess.scene.plane_view import Shot, views_of
from gapbeam.postprocess.scene.sheet import ZOOM, Sheet, pixels, whole_place
from gapbeam.postprocess.scene.support_surface import Mark, carried_by, marks_of, placed, support_of
from gapbeam.postprocess.scene.surface_color import SurfaceColor
from gapbeam.postprocess.scene.traces import loudest_face, traces_of

Scale = Literal["auto"] | float

# From the beam to the camera: nearly from the side, and for the support more from above and the free end.
_FROM_WHOLE = (0.10, -1.0, 0.28)
_FROM_SUPPORT = (0.45, -1.0, 0.38)

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
            results: Of the run.
            fields: Its fields, open, with one frame at least.
            scale: Factor of displacements and clearance in both views, or "auto": a round one for each.
            size: Of the sheet, pixels.
            frames_per_second: Of the film; 0 for no film.
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
        directions = _FROM_WHOLE, _FROM_SUPPORT
        shots = [Shot(*shot) for shot in zip(windows, sizes, factors, directions, strict=True)]
        self._views, touching = views_of(fields, support, shots, color)
        self._motion, self._traces = motion, traces_of(results, motion.times, motion.tip)
        close = {block.face: touching[block.face] for block in support.near_blocks()}
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
            remark = f"largest contact force of all fields: {forces[strongest]:.4g} N on {self._traces.faces} together"
            time, force = self._traces.peak_force()
            if forces[strongest] < _NEARLY * force:
                remark += f"; between fields {force:.4g} N at {1e3 * time:.4g} ms"
        farthest = int(np.argmax(np.abs(motion.tip)))
        tip = f"{1e3 * motion.tip[farthest]:.4g} mm".replace("-", "−")
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
        ResultsError: It did not.
    """
    if stress not in motion.largest_stress:
        raise ResultsError(
            fields.path,
            found="fields without stress",
            expected=f"{stress} in every field",
            remedy="run the case with `--set output.stress=true`",
        )
