"""Window of a camera: the whole beam at all times, or the support."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gapbeam.postprocess.scene.motion_range import MotionRange
from gapbeam.postprocess.scene.support_surface import SupportBoxes

Span = tuple[float, float]

_ROUND = (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0)
_GAP_SHOWN = 0.45
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
    return rounded_down(max(height, 2.0 * support.thickness) / moved) if moved > 0.0 else 1.0


def scale_of_support(motion: MotionRange, support: SupportBoxes) -> float:
    """Choose a round factor that shows the clearance at nearly half the thickness; 1 where nothing moves.

    Smaller where the beam in the support would be drawn farther than 1.2 times its thickness away.

    Args:
        motion: Motion of all times.
        support: Beam and support.
    """
    limits, thickness = [], max((block.thickness for block in support.near_blocks()), default=support.thickness)
    if support.clearance:
        limits.append(_GAP_SHOWN * thickness / abs(support.clearance))
    if motion.largest_near > 0.0:
        limits.append(_MOTION_SHOWN * thickness / motion.largest_near)
    return rounded_down(min(limits)) if limits else 1.0


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
    return _fitted((first, last), (low, high), size, 0.02, 0.04)


def window_of_support(support: SupportBoxes, scale: float, size: tuple[int, int]) -> Window:
    """The support and a little of the beam beyond it."""
    first, last = support.shown_near
    if first == support.near[0]:
        first -= 0.04 * (support.near[1] - support.near[0])
    return _fitted((first, last), support.heights(support.near_blocks(), scale), size, 0.02, 0.05)


def _fitted(x: Span, height: Span, size: tuple[int, int], room_x: float, room_height: float) -> Window:
    """Widen one of the two spans so that both are drawn to the same scale."""
    aspect = size[0] / size[1]
    width = max((x[1] - x[0]) * (1 + 2 * room_x), (height[1] - height[0]) * (1 + 2 * room_height) * aspect)
    middle_x, middle_height = 0.5 * (x[0] + x[1]), 0.5 * (height[0] + height[1])
    return Window(
        (middle_x - 0.5 * width, middle_x + 0.5 * width),
        (middle_height - 0.5 * width / aspect, middle_height + 0.5 * width / aspect),
    )


def rounded_down(limit: float) -> float:
    """The largest round number that does not exceed a limit."""
    decade = 10.0 ** np.floor(np.log10(limit))
    return float(max(step for step in _ROUND if step * decade <= limit * (1.0 + 1e-9)) * decade)
