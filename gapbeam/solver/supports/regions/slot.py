"""A slot: one plane below the beam and one above it."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from gapbeam.solver.supports.regions.region import Placement, Region
from gapbeam.solver.supports.support import Face


class Slot(Region):
    """Two planes with the clearance between them and the beam, half of it on either side of a centered beam."""

    type: Literal["slot"] = Field(description="one plane below and one above the beam")

    def faces(self, name: str, placed: Placement) -> tuple[Face, ...]:
        """Return both planes: an offset opens the upper gap and closes the lower one."""
        below, above = 0.5 * placed.clearance - placed.offset, 0.5 * placed.clearance + placed.offset
        return (
            Face(f"{name}_below", 1.0, below, placed.tilt, placed.middle),
            Face(f"{name}_above", -1.0, above, placed.tilt, placed.middle),
        )

    @property
    def sides(self) -> tuple[float, ...]:
        """Below and above."""
        return 1.0, -1.0
