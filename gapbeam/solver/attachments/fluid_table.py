"""[[fluid]]: still fluid around a part of the beam: added mass, buoyancy and damping per length.

A section that moves across the axis with the velocity v relative to the fluid feels, per length,

    f = -m_a v' - c v,

with the added mass m_a and the damping c. The fluid fills the frame of the supports and moves with it. In a frame with
the acceleration a, and under gravity g, the displaced mass m_d is lifted as in any pressure field,

    (m + m_a) w'' + c w' + E I w'''' = (m - m_d) (g - a).

The equation is integrated along the fluid by Gauss's rule: each of its points is a mean motion of a cross-section.

Source: Morison, O'Brien, Johnson and Schaaf (1950), Petroleum Transactions 189, 149-154, in the linear form; Lamb
(1932), Hydrodynamics, 6th ed., sec. 68, for the cylinder, whose added mass is the displaced mass.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from pydantic import Field

from gapbeam.solver.attachments.attached import Attached
from gapbeam.solver.attachments.mean_motion import MeanMotion, MotionName
from gapbeam.solver.loads.attachment import Attachment
from gapbeam.solver.table import AlongBeam, Name, NonNegative, placed_along

STATIONS = 24  # Gauss points along a fluid; the third bending frequency of a cantilever is off by 1.5e-5 in them
ACROSS: tuple[MotionName, ...] = ("vertical", "lateral")


class Fluid(AlongBeam):
    """What a [[fluid]] has besides its place."""

    name: Name = Field(description="name in messages, different for every fluid", examples=["water"])
    added_mass: NonNegative = Field(
        default=0.0, description="mass of fluid that moves with the beam across its axis, kg/m", examples=[0.5]
    )
    displaced_mass: NonNegative = Field(
        default=0.0, description="mass of the fluid that the beam displaces: its buoyancy, kg/m"
    )
    damping: NonNegative = Field(default=0.0, description="damping of motion across the axis, N s/m^2", examples=[2.0])

    @property
    def acts(self) -> bool:
        """Whether the fluid does anything."""
        return max(self.added_mass, self.displaced_mass, self.damping) > 0.0

    def attached(self) -> Iterator[Attached]:
        """Yield what the fluid adds to the cross-sections at its Gauss points."""
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
    "Still fluid around the beam from x = from to x = to, in the frame of the supports.",
)
