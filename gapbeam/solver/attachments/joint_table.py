"""[[joint]]: what holds a cross-section of the beam to the frame of the supports, without play."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from gapbeam.solver.attachments.attached import Attached
from gapbeam.solver.attachments.mean_motion import BENDING, IN_PLANE, OUT_OF_PLANE, MeanMotion, MotionName
from gapbeam.solver.loads.attachment import Attachment
from gapbeam.solver.table import Name, NonNegative, Number, Table

MOTIONS: tuple[MotionName, ...] = (*IN_PLANE, *OUT_OF_PLANE)


class Joint(Table):
    """What all joints have in common."""

    name: Name = Field(description="name in messages, different for every joint", examples=["root"])
    point: Number = Field(description="x on the beam axis, m", examples=[0.0])

    holds: ClassVar[tuple[MotionName, ...]] = ()
    """The motions that the section cannot have."""

    def attached(self) -> Iterator[Attached]:
        """Yield what the joint does to the motions of its cross-section."""
        for name in self.holds:
            yield Attached(MeanMotion(self.point, name), Attachment(0.0, 0.0, 0.0), held=True)


class ClampedJoint(Joint):
    """The cross-section neither moves nor rotates, on average; it can still deform."""

    type: Literal["clamped"] = Field(description="kind of joint")
    holds: ClassVar[tuple[MotionName, ...]] = MOTIONS


class PinnedJoint(Joint):
    """The cross-section rotates about its center, which does not move; there is no twist."""

    type: Literal["pinned"] = Field(description="kind of joint")
    holds: ClassVar[tuple[MotionName, ...]] = ("axial", "vertical", "lateral", "twist")


class GuidedJoint(Joint):
    """The cross-section slides up, down and sideways, and does not rotate or move along the beam."""

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


JointChoice = Annotated[ClampedJoint | PinnedJoint | GuidedJoint | ElasticJoint, Field(discriminator="type")]
"""All kinds of joints."""


def holds_motion(joints: tuple[Joint, ...], name: MotionName) -> bool:
    """Return whether joints hold a motion of a cross-section, or have springs on it."""
    return any(_on(one, held_only=False) and one.motion.name == name for joint in joints for one in joint.attached())


def bending_rank(joints: tuple[Joint, ...], *, held_only: bool, plane: tuple[MotionName, ...] = BENDING) -> int:
    """Return how many of the two rigid motions in a plane, heave and pitch, joints take from the beam.

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
