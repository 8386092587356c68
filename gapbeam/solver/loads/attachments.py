"""Attachments of a beam: tables [[joint]], [[fluid]] and [[mass]], and the mean motions of sections that they act on.

A joint holds a cross-section to the frame of the supports, without play.

A fluid at rest around a part of the beam adds mass, buoyancy and damping per length. A section that moves across the
axis with the velocity v relative to the fluid feels, per length,

    f = -m_a v' - c v,

with the added mass m_a and the damping c. The fluid fills the frame of the supports and moves with it. In a frame with
the acceleration a, and under gravity g, the displaced mass m_d is lifted as in any pressure field,

    (m + m_a) w'' + c w' + E I w'''' = (m - m_d) (g - a).

The equation is integrated along the fluid by Gauss's rule: each of its points is a mean motion of a cross-section.

Source: Morison, O'Brien, Johnson and Schaaf (1950), Petroleum Transactions 189, 149-154, in the linear form; Lamb
(1932), Hydrodynamics, 6th ed., sec. 68, for the cylinder, whose added mass is the displaced mass.

A mass sits on the axis or off it, with rotary inertia. At d from the centroid of a cross-section it moves as a point
that the section carries (below),

    T = m |v + omega x d|^2 / 2 + I_r (theta_t^2 + psi_t^2) / 2 + I_p phi_t^2 / 2,

with the moments of inertia about axes through the center of the mass. Weight and base motion act at its place, too.

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
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from gapbeam.solver.loads.places import Attachment
from gapbeam.solver.schema.table import (
    OF_TYPE,
    AlongBeam,
    Name,
    NonNegative,
    Number,
    Positive,
    Table,
    Vector,
    placed_along,
)
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
        name: Name of this motion.
        offset: Vector from the centroid of the section to the point, along x, y and z, m; displacements alone have one.
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


MOTIONS: tuple[MotionName, ...] = (*IN_PLANE, *OUT_OF_PLANE)


class Joint(Table):
    """Keys of all joints."""

    name: Name = Field(description="unique name", examples=["root"])
    point: Number = Field(description="x on the beam axis, m", examples=[0.0])

    holds: ClassVar[tuple[MotionName, ...]] = ()
    """The motions that the section cannot have."""

    def attached(self) -> Iterator[Attached]:
        """Yield the motions of its cross-section that the joint holds or springs."""
        for name in self.holds:
            yield Attached(MeanMotion(self.point, name), Attachment(0.0, 0.0, 0.0), held=True)


class ClampedJoint(Joint):
    """The cross-section neither moves nor rotates, on average; it can still deform."""

    type: Literal["clamped"] = Field(description="kind of joint")
    holds: ClassVar[tuple[MotionName, ...]] = MOTIONS


class PinnedJoint(Joint):
    """The cross-section rotates about its fixed center, without twist."""

    type: Literal["pinned"] = Field(description="kind of joint")
    holds: ClassVar[tuple[MotionName, ...]] = ("axial", "vertical", "lateral", "twist")


class GuidedJoint(Joint):
    """The cross-section slides across the beam, and does not rotate."""

    type: Literal["guided"] = Field(description="kind of joint")
    holds: ClassVar[tuple[MotionName, ...]] = ("axial", "rotation", "lateral_rotation", "twist")


class Stiffnesses(Table):
    """Springs on the motions of a cross-section."""

    axial: NonNegative = Field(default=0.0, description="along the beam, N/m")
    vertical: NonNegative = Field(default=0.0, description="in the bending direction, N/m", examples=[1.0e5])
    lateral: NonNegative = Field(default=0.0, description="across the bending plane (3D), N/m")
    rotation: NonNegative = Field(default=0.0, description="against rotation by bending, N m/rad", examples=[1.0e3])
    lateral_rotation: NonNegative = Field(
        default=0.0, description="against rotation by bending across the plane (3D), N m/rad"
    )
    twist: NonNegative = Field(default=0.0, description="against twist (3D), N m/rad")


class Dampings(Table):
    """Dampers on the motions of a cross-section."""

    axial: NonNegative = Field(default=0.0, description="along the beam, N s/m")
    vertical: NonNegative = Field(default=0.0, description="in the bending direction, N s/m", examples=[20.0])
    lateral: NonNegative = Field(default=0.0, description="across the bending plane (3D), N s/m")
    rotation: NonNegative = Field(default=0.0, description="against rotation by bending, N m s/rad")
    lateral_rotation: NonNegative = Field(
        default=0.0, description="against rotation by bending across the plane (3D), N m s/rad"
    )
    twist: NonNegative = Field(default=0.0, description="against twist (3D), N m s/rad")


class ElasticJoint(Joint):
    """Springs and dampers between the cross-section and the frame of the supports, relaxed where the beam is made."""

    type: Literal["elastic"] = Field(description="kind of joint")
    stiffness: Stiffnesses = Field(default=Stiffnesses(), description="springs of the joint")
    damping: Dampings = Field(default=Dampings(), description="dampers of the joint")

    def attached(self) -> Iterator[Attached]:
        """Yield the springs and dampers that are there."""
        for name in MOTIONS:
            attachment = Attachment(0.0, getattr(self.stiffness, name), getattr(self.damping, name))
            if attachment.acts:
                yield Attached(MeanMotion(self.point, name), attachment)


JointChoice = Annotated[ClampedJoint | PinnedJoint | GuidedJoint | ElasticJoint, OF_TYPE]
"""All kinds of joints."""


def holds_motion(joints: tuple[Joint, ...], name: MotionName) -> bool:
    """Return whether joints hold a motion of a cross-section, or have springs on it."""
    return any(_on(one, held_only=False) and one.motion.name == name for joint in joints for one in joint.attached())


def bending_rank(joints: tuple[Joint, ...], *, held_only: bool, plane: tuple[MotionName, ...] = BENDING) -> int:
    """Return the number of rigid motions in a plane, of heave and pitch, that joints hold.

    Args:
        joints: The joints.
        held_only: Count holds alone, no springs.
        plane: The displacement and the rotation of a cross-section there: in the bending plane, or across it.
    """
    rows = [
        ((0.0, 1.0) if one.motion.turns else (1.0, one.motion.x))
        for joint in joints
        for one in joint.attached()
        if one.motion.name in plane and _on(one, held_only)
    ]
    if not rows:
        return 0
    return 2 if any(first[0] * row[1] != first[1] * row[0] for first in rows for row in rows) else 1


def _on(one: Attached, held_only: bool) -> bool:
    return one.held or (not held_only and one.attachment.stiffness > 0.0)


STATIONS = 24  # Gauss points along a fluid; the third bending frequency of a cantilever is off by 1.5e-5 in them
ACROSS: tuple[MotionName, ...] = ("vertical", "lateral")


class Fluid(AlongBeam):
    """A [[fluid]] without its place: keys that all have."""

    name: Name = Field(description="unique name", examples=["water"])
    added_mass: NonNegative = Field(
        default=0.0, description="mass of fluid that moves with the beam across its axis, kg/m", examples=[0.5]
    )
    displaced_mass: NonNegative = Field(
        default=0.0, description="mass of the fluid that the beam displaces: its buoyancy, kg/m"
    )
    damping: NonNegative = Field(default=0.0, description="damping of motion across the axis, N s/m^2", examples=[2.0])

    def attached(self) -> Iterator[Attached]:
        """Yield the mass and damping of the fluid on the cross-sections at its Gauss points."""
        half = 0.5 * self.length
        for place, weight in zip(*np.polynomial.legendre.leggauss(STATIONS), strict=True):
            x, part = self.start + half * (1.0 + float(place)), half * float(weight)
            added = Attachment(part * self.added_mass, 0.0, part * self.damping)
            for name in ACROSS:
                yield Attached(MeanMotion(x, name), added, driven=-part * self.displaced_mass, spread=True)


PlacedFluid = placed_along(
    Fluid,
    "PlacedFluid",
    "the fluid",
    (0.1, 0.5),
    "Still fluid around the beam, in the frame of the supports.",
)

ROTATIONS: tuple[MotionName, ...] = ("rotation", "lateral_rotation")


class PointMass(Table):
    """A mass on the beam; gravity and base motion act on the mass."""

    name: Name = Field(description="unique name", examples=["head"])
    point: Number = Field(description="x on the beam axis, m", examples=[0.51])
    mass: Positive = Field(description="mass, kg", examples=[0.2])
    offset: Vector | None = Field(
        default=None,
        description="from the centroid of the section to the center of the mass, [x, y, z] or, of a slice, [x, z], "
        "m; default 0",
        examples=[[0.0, 0.02, -0.03]],
    )
    rotary_inertia: NonNegative = Field(
        default=0.0,
        description="moment of inertia about axes across the beam through its center, kg m^2",
        examples=[1.0e-4],
    )
    polar_inertia: NonNegative = Field(
        default=0.0,
        description="moment of inertia about the axis along the beam through its center (3D), kg m^2",
        examples=[2.0e-4],
    )

    @property
    def away(self) -> tuple[float, float, float]:
        """The offset along, beside and above the axis, m."""
        given = self.offset or (0.0, 0.0, 0.0)
        return given if len(given) == 3 else (given[0], 0.0, given[1])

    def attached(self) -> Iterator[Attached]:
        """Yield the inertia that the mass adds to the motions of its cross-section."""
        for name in DISPLACEMENTS:
            yield Attached(MeanMotion(self.point, name, self.away), Attachment(self.mass, 0.0, 0.0))
        if self.rotary_inertia > 0.0:
            for name in ROTATIONS:
                yield Attached(MeanMotion(self.point, name), Attachment(self.rotary_inertia, 0.0, 0.0))
        if self.polar_inertia > 0.0:
            yield Attached(MeanMotion(self.point, "twist"), Attachment(self.polar_inertia, 0.0, 0.0))
