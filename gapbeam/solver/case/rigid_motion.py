"""Rigid motions of the beam: what a start adds to a pose or a velocity.

    u(X) = t + w x (X - p)

with x along the beam, y across the bending plane and z along the bending direction, also where the case is a slice.
Rotations are small: u is linear in the coordinates.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gapbeam.solver.attachments.mean_motion import MotionName
from gapbeam.solver.system.operators import Array

NAMES: tuple[MotionName, ...] = ("axial", "lateral", "vertical", "twist", "rotation", "lateral_rotation")
"""The six rigid motions, as cross-sections take part in them: along x, y, z and about x, -y, z."""


@dataclass(frozen=True)
class RigidMotion:
    """A displacement, or a velocity, of all points of a rigid body.

    Attributes:
        translation: Of the origin, (x, y, z), m or m/s.
        rotation: Of the body, a vector by the rule of the right hand, (x, y, z), rad or rad/s.
    """

    translation: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rotation: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @classmethod
    def about(
        cls,
        point: tuple[float, float, float],
        translation: tuple[float, float, float],
        rotation: tuple[float, float, float],
    ) -> RigidMotion:
        """Return the motion whose rotation leaves a point in its place."""
        (x, y, z), (a, b, c), (u, v, w) = point, rotation, translation
        return cls((u - (b * z - c * y), v - (c * x - a * z), w - (a * y - b * x)), rotation)

    def __add__(self, other: RigidMotion) -> RigidMotion:
        (u, v, w), (a, b, c) = self.translation, self.rotation
        (du, dv, dw), (da, db, dc) = other.translation, other.rotation
        return RigidMotion((u + du, v + dv, w + dw), (a + da, b + db, c + dc))

    @property
    def names(self) -> frozenset[MotionName]:
        """The motions that it consists of, as the section at x = 0 takes part in them."""
        return frozenset(name for name, value in self.section(0.0).items() if value != 0.0)

    def section(self, x: float) -> Mapping[MotionName, float]:
        """Return the motions of the cross-section at x, m and rad, or per second."""
        (u, v, w), (a, b, c) = self.translation, self.rotation
        return dict(zip(NAMES, (u, v + c * x, w - b * x, a, -b, c), strict=True))

    def at(self, places: Array) -> Array:
        """Return the motion of points, (k, 3).

        Args:
            places: x, y and z of points, (k, 3), m.
        """
        return np.asarray(np.array(self.translation) + np.cross(np.array(self.rotation), places))


def unit_motions() -> tuple[RigidMotion, ...]:
    """Return the six motions of `NAMES`, each with the value 1 in the section at x = 0."""
    ends = {"axial": (1.0, 0.0, 0.0), "lateral": (0.0, 1.0, 0.0), "vertical": (0.0, 0.0, 1.0)}
    turns = {"twist": (1.0, 0.0, 0.0), "rotation": (0.0, -1.0, 0.0), "lateral_rotation": (0.0, 0.0, 1.0)}
    return tuple(
        RigidMotion(translation=ends[name]) if name in ends else RigidMotion(rotation=turns[name]) for name in NAMES
    )
