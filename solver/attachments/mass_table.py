"""[[mass]]: a mass on the beam, with rotary inertia."""

from __future__ import annotations

from collections.abc import Iterator

from pydantic import Field

from gapbeam.solver.attachments.attached import Attached
from gapbeam.solver.attachments.mean_motion import MeanMotion, MotionName
from gapbeam.solver.loads.attachment import Attachment
from gapbeam.solver.table import Name, NonNegative, Number, Positive, Table

DISPLACEMENTS: tuple[MotionName, ...] = ("axial", "vertical", "lateral")
ROTATIONS: tuple[MotionName, ...] = ("rotation", "lateral_rotation")


class PointMass(Table):
    """A mass that moves with the cross-section of the beam at a place; gravity and base motion act on the mass."""

    name: Name = Field(description="name in messages, different for every mass", examples=["head"])
    point: Number = Field(description="x on the beam axis, m", examples=[0.51])
    mass: Positive = Field(description="mass, kg", examples=[0.2])
    rotary_inertia: NonNegative = Field(
        default=0.0, description="moment of inertia about the axes across the beam, kg m^2", examples=[1.0e-4]
    )
    polar_inertia: NonNegative = Field(
        default=0.0, description="moment of inertia about the axis of the beam (3D), kg m^2", examples=[2.0e-4]
    )

    def attached(self) -> Iterator[Attached]:
        """Yield what it adds to the motions of its cross-section."""
        for name in DISPLACEMENTS:
            yield Attached(MeanMotion(self.point, name), Attachment(self.mass, 0.0, 0.0))
        if self.rotary_inertia > 0.0:
            for name in ROTATIONS:
                yield Attached(MeanMotion(self.point, name), Attachment(self.rotary_inertia, 0.0, 0.0))
        if self.polar_inertia > 0.0:
            yield Attached(MeanMotion(self.point, "twist"), Attachment(self.polar_inertia, 0.0, 0.0))
