"""The face of a hole: the contact points of a round section around the axis of the beam.

A contact point at r e_r from the axis, with e_r = (cos t, sin t) across the beam, has the gap

    g = R - r + o . e_r,    R = R_b + c

with R_b the outer radius of the beam, c the radial clearance and o the offset of the hole from the axis. The normal of
a point stays e_r: a point that moves by u closes its gap by e_r . u. That errs by c^2 / (2 R_b) in depth and c / R_b in
direction, where the play is small beside the radius.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from gapbeam.solver.supports.support import Array, Face


@dataclass(frozen=True)
class BoreFace(Face):
    """The inside of a round hole.

    Attributes:
        offset: How far its axis lies above that of the beam, along the bending axis, m.
    """

    offset: float = 0.0

    around: ClassVar[bool] = True

    @property
    def carries(self) -> bool:
        """A beam rests on its lower half."""
        return True

    def gaps(self, positions: Array) -> Array:
        """Return c + (R_b - r) + o . e_r, (m,), m."""
        radii = np.linalg.norm(positions[:, 1:], axis=1)
        return np.asarray(self.gap + (radii.max() - radii) - self.offset * self.opening(positions)[:, -1])

    def opening(self, positions: Array) -> Array:
        """Return -e_r, (m, 3)."""
        across = positions.copy()
        across[:, 0] = 0.0
        return np.asarray(-across / np.linalg.norm(across, axis=1)[:, None])

    def growth(self, old: Face, positions: Array) -> Array:
        """Return the growth by another clearance and another offset, (m,), m."""
        moved = self.offset - (old.offset if isinstance(old, BoreFace) else 0.0)
        return np.asarray(self.gap - old.gap - moved * self.opening(positions)[:, -1])
