"""Body of a flexible support: a mass on a spring and a damper, which stand on the frame.

    m q'' + c q' + k q = f_contact + f_loads

The faces of the support move with q: along the bending axis, and of supports around the beam across it, too.
"""

from __future__ import annotations

from math import pi, sqrt
from typing import Literal

from pydantic import Field

from gapbeam.solver.table import NonNegative, Number, Positive, Table


class SupportBody(Table):
    """A mass on a spring and a damper that carries a support: along the bending axis, and around the beam across it."""

    mass: Positive = Field(description="mass m that moves with the faces of the support, kg", examples=[0.05])
    stiffness: Positive = Field(
        description="stiffness k of the spring to the frame, in both directions of a support around the beam, N/m",
        examples=[2.0e5],
    )
    damping: NonNegative = Field(default=0.0, description="damping c of the damper beside it, N s/m", examples=[10.0])
    displacement: Literal["rest"] | Number = Field(
        default=0.0,
        description='displacement at t = 0, upward, from the seat or from relaxed springs, m; "rest": where '
        "the body rests without the beam",
        examples=[-1.0e-3],
    )
    velocity: Number = Field(
        default=0.0, description="velocity at t = 0 along the bending axis, upward, m/s", examples=[0.1]
    )

    @property
    def moved(self) -> bool:
        """True where the body has a start of its own."""
        return self.displacement != 0.0 or self.velocity != 0.0

    @property
    def frequency(self) -> float:
        """Frequency of the mass on its spring, without the beam, Hz."""
        return sqrt(self.stiffness / self.mass) / (2.0 * pi)
