"""A stop: one plane, below or above the beam."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from gapbeam.solver.supports.regions.region import Placement, Region
from gapbeam.solver.supports.support import Face

SIDES = {"below": 1.0, "above": -1.0}


class Stop(Region):
    """One plane, the clearance away from the undeformed beam."""

    type: Literal["stop"] = Field(description="one plane on one side of the beam")
    side: Literal["below", "above"] = Field(default="below", description="where the plane is, seen from the beam")

    def faces(self, name: str, placed: Placement) -> tuple[Face, ...]:
        """Return the plane; an offset moves it upward."""
        side = SIDES[self.side]
        gap = placed.clearance - side * placed.offset
        return (Face(f"{name}_{self.side}", side, gap, placed.tilt, placed.middle),)

    @property
    def sides(self) -> tuple[float, ...]:
        """The side of the plane."""
        return (SIDES[self.side],)
