"""Mean motions of a cross-section, which joints hold and masses follow, and the matrices that they add.

Of the displacement u over the cross-section A at x, with y across and z along the bending direction from its center,

    along an axis:   int u_i dA / A
    rotation:        -int z u_x dA / int z^2 dA       (bending; u_x = -z theta)
    lateral:         -int y u_x dA / int y^2 dA       (u_x = -y psi)
    twist:           int (y u_z - z u_y) dA / int (y^2 + z^2) dA

Where int y z dA is not 0, theta and psi are those of the plane that fits u_x best. The forces that work on the motions
are spread over the section likewise, and leave it free to deform. A point that the section carries at (d_x, d_y, d_z)
from its centroid moves by small rotations with it, phi the twist:

    axial:     u - d_z theta - d_y psi
    lateral:   v + d_x psi - d_z phi
    vertical:  w + d_x theta + d_y phi

"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from gapbeam.solver.loads.places import Attachment
from gapbeam.solver.system.operators import Array

MotionName = Literal["axial", "vertical", "lateral", "rotation", "lateral_rotation", "twist"]
IN_PLANE: tuple[MotionName, ...] = ("axial", "vertical", "rotation")
OUT_OF_PLANE: tuple[MotionName, ...] = ("lateral", "lateral_rotation", "twist")
DISPLACEMENTS: tuple[MotionName, ...] = ("axial", "lateral", "vertical")
"""Displacements of a solid, in the order of their axes."""
BENDING: tuple[MotionName, ...] = ("vertical", "rotation")
SIDEWAYS: tuple[MotionName, ...] = ("lateral", "lateral_rotation")
COUPLED = 1.0e-9  # of both second moments: a smaller product of inertia is round-off


@dataclass(frozen=True)
class MeanMotion:
    """A mean motion of the cross-section at a place, or the displacement of a point that this section carries.

    Attributes:
        x: The place, m.
        name: Which motion.
        offset: From the centroid of the section to the point, along x, y and z, m; displacements alone have one.
    """

    x: float
    name: MotionName
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def turns(self) -> bool:
        """True for a rotation, rad; False for a displacement, m."""
        return self.name in ("rotation", "lateral_rotation", "twist")

    def parts(self) -> Iterator[tuple[float, MeanMotion]]:
        """Yield the motions of the section itself that add up to this one, each with its factor."""
        along, beside, above = self.offset
        arms: dict[MotionName, tuple[tuple[float, MotionName], ...]] = {
            "axial": ((-above, "rotation"), (-beside, "lateral_rotation")),
            "lateral": ((along, "lateral_rotation"), (-above, "twist")),
            "vertical": ((along, "rotation"), (beside, "twist")),
        }
        yield 1.0, MeanMotion(self.x, self.name)
        for arm, name in arms.get(self.name, ()):
            if arm != 0.0:
                yield arm, MeanMotion(self.x, name)

    def direction(self, dimension: int) -> Array:
        """Return the direction of a displacement as a unit vector, (dimension,); 0 for a rotation."""
        along = np.zeros(dimension)
        if not self.turns:
            along[{"axial": 0, "vertical": -1, "lateral": 1}[self.name]] = 1.0
        return along

    def factors(self, moments: Array) -> Array:
        """Return F, which gives the motion as int u^T F s dA, with s = (1, y, z), in a slice (1, z).

        Args:
            moments: int s s^T dA of the section, (dimension, dimension).

        Returns:
            (dimension, dimension), a row for each component of the displacement.
        """
        (_, own), *carried = self.parts()
        found = own.of_section(moments)
        for arm, part in carried:
            found = found + arm * part.of_section(moments)
        return found

    def of_section(self, moments: Array) -> Array:
        """Return the same for the section itself, without the offset; the argument as there."""
        dimension, area, first = len(moments), moments[0, 0], moments[0, 1:] / moments[0, 0]
        found = np.zeros((dimension, dimension))
        if not self.turns:
            found[:, 0] = self.direction(dimension) / area
            return found
        second = moments[1:, 1:] - area * np.outer(first, first)
        if self.name == "twist":
            found[1] = [first[1], 0.0, -1.0]
            found[2] = [-first[0], 1.0, 0.0]
            return np.asarray(found / np.trace(second))
        arm = np.zeros(dimension)  # of s, about the centroid
        which = dimension - 2 if self.name == "rotation" else 0
        arm[1 + which] = 1.0
        squares = second[which, which]
        if dimension == 3:
            product, other = second[0, 1], second[1 - which, 1 - which]
            if abs(product) > COUPLED * np.sqrt(squares * other):
                arm[2 - which] = -product / other
                squares -= product**2 / other
        arm[0] = -arm[1:] @ first
        found[0] = -arm / squares
        return found


@dataclass(frozen=True)
class Attached:
    """A mass, a spring and a damper on one motion of a cross-section, or a hold that lets it have none.

    Attributes:
        motion: The motion.
        attachment: Mass in kg or kg m^2, spring and damper to the frame of the supports; zeros for a hold.
        held: Whether the section does not move so at all.
        driven: Mass that gravity and the motion of the frame act on; None: the mass that is attached.
        spread: Whether it is a part of something along the beam, which calls for no static shape of its own in a basis.
        restrains: Whether nothing else may hold the body so: a mesh takes the spring into its stiffness.
    """

    motion: MeanMotion
    attachment: Attachment
    held: bool = False
    driven: float | None = None
    spread: bool = False
    restrains: bool = False
