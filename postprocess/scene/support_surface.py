"""The support as it is drawn: base and gland blocks, the clearance enlarged as the displacements are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

Box = tuple[float, float, float, float, float, float]

_BLOCK_HEIGHT = 0.9
_BEHIND = 0.35


@dataclass(frozen=True)
class Support:
    """Beam and support as boxes, m.

    Attributes:
        dimension: 2 or 3; the bending direction is y or z.
        length: Of the supported part from `start`.
        clearance: Pad thickness minus beam thickness.
        start: x of the supported end.
        end: x of the free end.
        bottom: Of the beam, in the bending direction.
        top: Of the beam.
        front: Smallest y of the beam in 3D, else 0.
        back: Largest y of the beam in 3D, else 0.
    """

    dimension: int
    length: float
    clearance: float
    start: float
    end: float
    bottom: float
    top: float
    front: float
    back: float

    @property
    def thickness(self) -> float:
        """Of the beam, in the bending direction."""
        return self.top - self.bottom

    def base(self) -> Box:
        """The base block: x, y, z limits; its upper face is the lower face of the undeformed beam."""
        return self._box(self.bottom - _BLOCK_HEIGHT * self.thickness, self.bottom)

    def gland(self, scale: float) -> Box:
        """The gland block, its lower face `scale` times the clearance above the undeformed beam.

        A point of the beam displaced by u is drawn at its place + scale u: it touches this face where u is
        the clearance, neither earlier nor later.
        """
        face = self.top + scale * self.clearance
        return self._box(face, face + _BLOCK_HEIGHT * self.thickness)

    def _box(self, low: float, high: float) -> Box:
        first, last = self.start, self.start + self.length
        if self.dimension == 2:
            return (first, last, low, high, 0.0, 0.0)
        return (first, last, self.front, self.back + _BEHIND * (self.back - self.front), low, high)


def support_of(points: np.ndarray, dimension: int, case: Mapping[str, Any]) -> Support:
    """Read beam and support from the mesh and the case.

    Args:
        points: Of the undeformed mesh, (points, 3), m.
        dimension: 2 or 3.
        case: The case as run, with support.length and support.clearance.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    bending = dimension - 1
    return Support(
        dimension=dimension,
        length=float(case["support"]["length"]),
        clearance=float(case["support"]["clearance"]),
        start=float(low[0]),
        end=float(high[0]),
        bottom=float(low[bending]),
        top=float(high[bending]),
        front=float(low[1]) if dimension == 3 else 0.0,
        back=float(high[1]) if dimension == 3 else 0.0,
    )
