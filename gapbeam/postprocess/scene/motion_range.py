"""Range of the motion of a beam over all times, and windows of cameras: the whole beam at all times, or the support."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from gapbeam.postprocess.display_units import rounded_down
from gapbeam.postprocess.results.field_reader import Fields, Frame
from gapbeam.postprocess.scene.support_surface import Span, SupportBoxes


@dataclass(frozen=True)
class MotionRange:
    """Extremes over all times.

    Attributes:
        times: (k,), s.
        tip: Mean displacement of the free end in the bending direction, (k,), m.
        lowest: Smallest displacement in the bending direction of any point, at most 0, m.
        highest: Largest, at least 0, m.
        largest_near: Largest absolute displacement in the bending direction of the points near the support,
            m.
        largest_pressure: Pa.
        strongest: Number of the frame with the largest contact pressure.
        slide: Largest mean displacement along the beam, m.
        largest_stress: Largest size of each stress that the run wrote, by name, Pa.
    """

    times: np.ndarray
    tip: np.ndarray
    lowest: float
    highest: float
    largest_near: float
    largest_pressure: float
    strongest: int
    slide: float = 0.0
    largest_stress: Mapping[str, float] = field(default_factory=dict)


def slide_of(frame: Frame) -> float:
    """Return the mean displacement along the beam, m: drawn as large as it is, or the beam would leave its supports."""
    return float(frame.displacement[:, 0].mean())


def shown_displacement(frame: Frame, scale: float) -> np.ndarray:
    """Return displacements that are drawn times a scale, m, (n, 3): the mean along the beam as large as it is."""
    return np.asarray(frame.displacement - [(1.0 - 1.0 / scale) * slide_of(frame), 0.0, 0.0])


def motion_of(fields: Fields, near: tuple[float, float]) -> MotionRange:
    """Go through all frames once.

    Args:
        fields: Fields of at least one frame.
        near: Limits of x within which points count as near the support, m.
    """
    x, bending = fields.points[:, 0], fields.dimension - 1
    end, close = x > x.max() - 1e-6 * np.ptp(x), (x >= near[0]) & (x <= near[1])
    rows, stress = [], dict[str, float]()
    for frame in fields:
        moved = frame.displacement[:, bending]
        for name, values in frame.stress.items():
            stress[name] = max(stress.get(name, 0.0), float(np.abs(values).max()))
        rows.append(
            (
                frame.time,
                moved[end].mean(),
                moved.min(),
                moved.max(),
                np.abs(moved[close]).max(),
                frame.contact_pressure.max(),
                abs(slide_of(frame)),
            )
        )
    times, tip, low, high, near_support, pressure, slide = np.array(rows, dtype=float).T
    return MotionRange(
        times=times,
        tip=tip,
        lowest=min(0.0, float(low.min())),
        highest=max(0.0, float(high.max())),
        largest_near=float(near_support.max()),
        largest_pressure=float(pressure.max()),
        strongest=int(np.argmax(pressure)),
        slide=float(slide.max()),
        largest_stress=stress,
    )


ROUND = (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0)
GAP_SHOWN = 0.45
_MOTION_SHOWN = 1.2


@dataclass(frozen=True)
class Window:
    """Window of the camera, in drawn coordinates (m).

    Attributes:
        x: Smallest and largest x.
        height: Smallest and largest coordinate in the bending direction.
    """

    x: Span
    height: Span

    @property
    def center(self) -> tuple[float, float]:
        """Middle of x and height."""
        return 0.5 * (self.x[0] + self.x[1]), 0.5 * (self.height[0] + self.height[1])


def scale_of_whole(motion: MotionRange, support: SupportBoxes, size: tuple[int, int]) -> float:
    """Choose a round factor with which the motion of the beam fills a picture; 1 where nothing moves.

    Args:
        motion: Motion of all times.
        support: Beam and support.
        size: Size of the picture in pixels.
    """
    height = (support.end - support.start) * size[1] / size[0] - 2.0 * support.thickness
    moved = motion.highest - motion.lowest
    return rounded_down(max(height, 2.0 * support.thickness) / moved, ROUND) if moved > 0.0 else 1.0


def scale_of_support(motion: MotionRange, support: SupportBoxes) -> float:
    """Choose a round factor that shows the clearance at nearly half the thickness; 1 where nothing moves.

    Smaller where the beam in the support would be drawn farther than 1.2 times its thickness away.

    Args:
        motion: Motion of all times.
        support: Beam and support.
    """
    limits, thickness = [], max((block.thickness for block in support.near_blocks()), default=support.thickness)
    if support.clearance:
        limits.append(GAP_SHOWN * thickness / abs(support.clearance))
    if motion.largest_near > 0.0:
        limits.append(_MOTION_SHOWN * thickness / motion.largest_near)
    return rounded_down(min(limits), ROUND) if limits else 1.0


def window_of_whole(
    motion: MotionRange,
    support: SupportBoxes,
    scale: float,
    size: tuple[int, int],
    carried: Sequence[tuple[float, float]] = (),
) -> Window:
    """The whole beam at all times, with the aspect of its picture.

    Args:
        motion: Motion of all times.
        support: Beam and support.
        scale: Factor of displacements.
        size: Size of the picture in pixels.
        carried: x and height of masses on the undeformed beam, which may be beside it, m.
    """
    low, high = support.heights(support.blocks, scale)
    bottom = min([support.bottom, *(height for _, height in carried)])
    top = max([support.top, *(height for _, height in carried)])
    low, high = min(bottom + scale * motion.lowest, low), max(top + scale * motion.highest, high)
    first, last = min([support.start, *(x for x, _ in carried)]), max([support.end, *(x for x, _ in carried)])
    return _fitted((first, last), (low, high), size, 0.04)


def window_of_support(support: SupportBoxes, scale: float, size: tuple[int, int]) -> Window:
    """The support and a little of the beam beyond it."""
    first, last = support.shown_near
    if first == support.near[0]:
        first -= 0.04 * (support.near[1] - support.near[0])
    return _fitted((first, last), support.heights(support.near_blocks(), scale), size, 0.05)


def _fitted(x: Span, height: Span, size: tuple[int, int], room_height: float) -> Window:
    """Widen one of the two spans so that both are drawn to the same scale."""
    aspect = size[0] / size[1]
    width = max((x[1] - x[0]) * (1 + 2 * 0.02), (height[1] - height[0]) * (1 + 2 * room_height) * aspect)
    middle_x, middle_height = 0.5 * (x[0] + x[1]), 0.5 * (height[0] + height[1])
    return Window(
        (middle_x - 0.5 * width, middle_x + 0.5 * width),
        (middle_height - 0.5 * width / aspect, middle_height + 0.5 * width / aspect),
    )


_BESIDE = 1.0e-6  # of the length of the beam: points so near to each other along it are of one cross-section


@dataclass(frozen=True)
class CarryingSection:
    """A rigid motion u = a + w x (X - c) by least squares.

    Attributes:
        points: Numbers of the mesh points of the section, (p,).
        center: c, their mean place, m, (3,).
        fit: Map from their displacements, (3 p,), to a and w, (6, 3 p).
    """

    points: np.ndarray
    center: np.ndarray
    fit: np.ndarray

    def of(self, displacement: np.ndarray, place: np.ndarray) -> np.ndarray:
        """Return the displacement of a place that the section carries, m, (3,).

        Args:
            displacement: Displacement of all points of the mesh, m, (n, 3).
            place: X, m, (3,).
        """
        motion = self.fit @ displacement[self.points].reshape(-1)
        return np.asarray(motion[:3] + np.cross(motion[3:], place - self.center))


def carrying_section(points: np.ndarray, x: float) -> CarryingSection:
    """Return the motion of the cross-section of mesh points that is nearest to x.

    The points of a line show no twist: it is 0.

    Args:
        points: Points of the mesh, m, (n, 3).
        x: Place along the beam, m.
    """
    away = np.abs(points[:, 0] - x)
    nearest = points[np.argmin(away), 0]
    (chosen,) = (np.abs(points[:, 0] - nearest) <= _BESIDE * np.ptp(points[:, 0])).nonzero()
    center = points[chosen].mean(axis=0)
    rows = []
    for a, b, c in points[chosen] - center:
        turn = np.array([[0.0, c, -b], [-c, 0.0, a], [b, -a, 0.0]])  # w x r
        rows.append(np.hstack([np.eye(3), turn]))
    return CarryingSection(chosen, center, np.linalg.pinv(np.vstack(rows)))


_TOP = 179.99  # degrees


def unrolled(numbers: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return points around a beam with x, m, and the angle from its lowest line, degrees; those at the top twice.

    Args:
        numbers: Numbers of the points around the beam, (p,).
        points: Points of the mesh, (n, 3), m.

    Returns:
        Numbers, x and angle of each, positive toward +y; the points at the top are at 180 degrees and again at -180.
    """
    x, y, z = points[numbers].T
    angles = np.degrees(np.arctan2(y, -(z - 0.5 * (z.max() + z.min()))))
    top = np.flatnonzero(np.abs(angles) > _TOP)
    angles[top] = 180.0
    return np.r_[numbers, numbers[top]], np.r_[x, x[top]], np.r_[angles, np.full(len(top), -180.0)]
