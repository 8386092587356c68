"""The mean motions of a cross-section that joints hold and masses follow.

Of the displacement u over the cross-section A at x, with y across and z along the bending direction from its center,

    along an axis:   int u_i dA / A
    rotation:        -int z u_x dA / int z^2 dA       (bending; u_x = -z theta)
    lateral:         -int y u_x dA / int y^2 dA
    twist:           int (y u_z - z u_y) dA / int (y^2 + z^2) dA

The forces that work on them are spread over the section likewise, and leave it free to deform.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from gapbeam.solver.system.operators import Array

MotionName = Literal["axial", "vertical", "lateral", "rotation", "lateral_rotation", "twist"]
IN_PLANE: tuple[MotionName, ...] = ("axial", "vertical", "rotation")
OUT_OF_PLANE: tuple[MotionName, ...] = ("lateral", "lateral_rotation", "twist")
BENDING: tuple[MotionName, ...] = ("vertical", "rotation")
SIDEWAYS: tuple[MotionName, ...] = ("lateral", "lateral_rotation")


@dataclass(frozen=True)
class MeanMotion:
    """A mean motion of the cross-section at a place.

    Attributes:
        x: The place, m.
        name: Which motion.
    """

    x: float
    name: MotionName

    @property
    def turns(self) -> bool:
        """Whether it is a rotation, rad; else a displacement, m."""
        return self.name in ("rotation", "lateral_rotation", "twist")

    def direction(self, dimension: int) -> Array:
        """Return the direction of a displacement as a unit vector, (dimension,); 0 for a rotation."""
        along = np.zeros(dimension)
        if not self.turns:
            along[{"axial": 0, "vertical": -1, "lateral": 1}[self.name]] = 1.0
        return along

    def weights(self, across: Array, weights: Array) -> Array:
        """Return what gives the motion from displacements at points of the section.

        Args:
            across: Coordinates of k points across the axis, (k, dimension - 1), m: z, or y and z.
            weights: Of their areas, (k,).

        Returns:
            (k, dimension), the factors of the displacements.
        """
        dimension = across.shape[1] + 1
        if not self.turns:
            return np.asarray(weights[:, None] / np.sum(weights) * self.direction(dimension))
        arms = across - weights @ across / np.sum(weights)
        found = np.zeros((len(weights), dimension))
        if self.name == "twist":
            found[:, 1], found[:, 2] = -arms[:, 1], arms[:, 0]
            second = np.sum(arms**2, axis=1)
        else:
            arm = arms[:, -1] if self.name == "rotation" else arms[:, 0]
            found[:, 0], second = -arm, arm**2
        return np.asarray(weights[:, None] * found / (weights @ second))
