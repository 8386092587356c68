"""[[mass]]: a mass on the beam, with rotary inertia, on its axis or beside it.

A mass at d from the centroid of a cross-section moves as a point that the section carries (`attachments.mean_motion`),

    T = m |v + omega x d|^2 / 2 + I_r (theta_t^2 + psi_t^2) / 2 + I_p phi_t^2 / 2,

with the moments of inertia about axes through the center of the mass. Weight and base motion act at its place, too.
"""

from __future__ import annotations

from collections.abc import Iterator

from pydantic import Field

from gapbeam.solver.attachments.attached import Attached
from gapbeam.solver.attachments.mean_motion import DISPLACEMENTS, MeanMotion, MotionName
from gapbeam.solver.loads.attachment import Attachment
from gapbeam.solver.table import Name, NonNegative, Number, Positive, Table, Vector

ROTATIONS: tuple[MotionName, ...] = ("rotation", "lateral_rotation")


class PointMass(Table):
    """A mass that moves with the cross-section of the beam at a place; gravity and base motion act on the mass."""

    name: Name = Field(description="name in messages, different for every mass", examples=["head"])
    point: Number = Field(description="x on the beam axis, m", examples=[0.51])
    mass: Positive = Field(description="mass, kg", examples=[0.2])
    offset: Vector | None = Field(
        default=None,
        description="from the centroid of the cross-section to the center of the mass, [x, y, z] or, of a slice, "
        "[x, z], m; default: the mass is at the centroid",
        examples=[[0.0, 0.02, -0.03]],
    )
    rotary_inertia: NonNegative = Field(
        default=0.0,
        description="moment of inertia about the axes across the beam through the center of the mass, kg m^2",
        examples=[1.0e-4],
    )
    polar_inertia: NonNegative = Field(
        default=0.0,
        description="moment of inertia about the axis along the beam through the center of the mass (3D), kg m^2",
        examples=[2.0e-4],
    )

    @property
    def away(self) -> tuple[float, float, float]:
        """The offset along, beside and above the axis, m."""
        given = self.offset or (0.0, 0.0, 0.0)
        return given if len(given) == 3 else (given[0], 0.0, given[1])

    def attached(self) -> Iterator[Attached]:
        """Yield what it adds to the motions of its cross-section."""
        for name in DISPLACEMENTS:
            yield Attached(MeanMotion(self.point, name, self.away), Attachment(self.mass, 0.0, 0.0))
        if self.rotary_inertia > 0.0:
            for name in ROTATIONS:
                yield Attached(MeanMotion(self.point, name), Attachment(self.rotary_inertia, 0.0, 0.0))
        if self.polar_inertia > 0.0:
            yield Attached(MeanMotion(self.point, "twist"), Attachment(self.polar_inertia, 0.0, 0.0))
