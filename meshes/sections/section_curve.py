"""The curves that bound the patches of a cross-section: straight lines and arcs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Place = tuple[float, float]
Side = Literal["inside", "below", "above"]


@dataclass(frozen=True)
class SectionCurve:
    """A line, or an arc of less than half a turn about the axis of the beam, from one point to another.

    Attributes:
        start: y and z of the first point, m.
        end: Those of the last one, m.
        cells: Number of cells along it.
        arc: Whether it is an arc about y = z = 0.
        side: Whether supports below or above the beam can touch it; "inside": neither of them.
    """

    start: Place
    end: Place
    cells: int
    arc: bool = False
    side: Side = "inside"

    def at(self, share: Array) -> tuple[Array, Array]:
        """Return the places at shares of the way, (k, 2), and their derivatives by the share, (k, 2)."""
        start, end = np.array(self.start), np.array(self.end)
        if not self.arc:
            return start + share[:, None] * (end - start), np.tile(end - start, (len(share), 1))
        first = math.atan2(start[1], start[0])
        turn = math.remainder(math.atan2(end[1], end[0]) - first, 2.0 * math.pi)
        radius, angles = math.hypot(*self.start), first + share * turn
        along = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        return radius * along, radius * turn * np.stack([-along[:, 1], along[:, 0]], axis=1)
