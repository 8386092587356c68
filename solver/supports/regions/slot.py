"""A slot: one plane below the beam and one above it."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from gapbeam.solver.supports.regions.region import Plane, Region


class Slot(Region):
    """Two planes with the clearance between them and the beam, half of it on either side of a centered beam."""

    type: Literal["slot"] = Field(description="one plane below and one above the beam")

    def planes(self, clearance: float, offset: float) -> tuple[Plane, ...]:
        """Return both planes: an offset opens the upper gap and closes the lower one."""
        return Plane("below", 1.0, 0.5 * clearance - offset), Plane("above", -1.0, 0.5 * clearance + offset)

    @property
    def sides(self) -> tuple[float, ...]:
        """Below and above."""
        return 1.0, -1.0
