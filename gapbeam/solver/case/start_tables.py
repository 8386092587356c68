"""The tables [analysis.motion] and [analysis.mode]: what is added to the state at t = 0."""

from __future__ import annotations

from pydantic import Field

from gapbeam.solver.case.rigid_motion import RigidMotion
from gapbeam.solver.table import Name, Number, Table, Vector, Whole

Components = tuple[Number, Number, Number]


class StartMotion(Table):
    """A rigid motion, added to the state at t = 0: a displacement and a velocity, each with its rotation.

    The rotation is small and leaves `point` in its place; [x, y] of a slice, [x, y, z] of a solid or a beam in 3D.
    """

    lift: Number = Field(default=0.0, description="displacement along the bending direction, m", examples=[0.1e-3])
    displacement: Vector | None = Field(
        default=None,
        description="displacement [x, y] or [x, y, z] instead of lift, m; default none",
        examples=[[0.0, 0.1e-3, 0.0]],
    )
    tilt: Number = Field(default=0.0, description="rotation that raises the far end, rad", examples=[1.0e-4])
    rotation: Components | None = Field(
        default=None,
        description="rotation about x, y and z by the rule of the right hand (3D) instead of tilt, which is that "
        "about -y, rad; default none",
        examples=[[0.0, 0.0, 1.0e-4]],
    )
    velocity: Number | Vector = Field(
        default=0.0,
        description="velocity along the bending direction, or [x, y] or [x, y, z], m/s",
        examples=[-0.2, [0.0, 0.1, 0.0]],
    )
    spin: Number | Components = Field(
        default=0.0,
        description="rotation rate that raises the far end, or the vector about x, y and z (3D), rad/s",
        examples=[1.0, [10.0, 0.0, 0.0]],
    )
    point: Number | Vector | None = Field(
        default=None,
        description="the point that the rotations leave in its place, x on the axis or all coordinates, m; default the "
        "middle",
    )

    def pose(self, length: float) -> RigidMotion:
        """Return the displacement of a beam of a length, m."""
        translation = self.lift if self.displacement is None else self.displacement
        return self._about(length, translation, self.tilt if self.rotation is None else self.rotation)

    def rate(self, length: float) -> RigidMotion:
        """Return the velocity of a beam of a length, m."""
        return self._about(length, self.velocity, self.spin)

    def _about(self, length: float, translation: float | Vector, rotation: float | Components) -> RigidMotion:
        along = (0.0, 0.0, translation) if isinstance(translation, float | int) else in_space(translation)
        turn = (0.0, -rotation, 0.0) if isinstance(rotation, float | int) else rotation
        point = 0.5 * length if self.point is None else self.point
        center = (point, 0.0, 0.0) if isinstance(point, float | int) else in_space(point)
        return RigidMotion.about(center, along, turn)


class StartMode(Table):
    """A vibration mode of the beam without contact, added to the state at t = 0.

    u = a cos(phase) x(X) and v = a w sin(phase) x(X), with x = 1 at the probe along the bending direction.
    """

    number: Whole = Field(
        ge=1,
        le=1000,
        description="bending mode of the free model, as `gapbeam modes` numbers it; 1 and 2 of a beam without"
        " joints are rigid motions",
        examples=[1],
    )
    amplitude: Number = Field(description="a, amplitude of the probe along the bending direction, m", examples=[1.0e-4])
    probe: Name = Field(description="name of the [[probe]] whose amplitude is meant", examples=["tip"])
    phase: Number = Field(
        default=0.0,
        description="phase of a cos(w t - phase): 0 starts at rest with a, 90 with the velocity w a, degrees",
        examples=[90.0],
    )


def in_space(vector: Vector) -> tuple[float, float, float]:
    """Return [x, y] of a slice, whose y is the bending direction, or [x, y, z] as x, y, z."""
    return (vector[0], 0.0, vector[1]) if len(vector) == 2 else vector
