"""A hole: a bore, a sleeve or a drilled baffle around a round beam."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from gapbeam.solver.supports.regions.bore_face import BoreFace
from gapbeam.solver.supports.regions.region import Region


class Hole(Region):
    """A round hole around a round section, the clearance wider than its radius."""

    type: Literal["hole"] = Field(description="a round hole around a beam of round section")

    def faces(self, name: str, clearance: float, offset: float) -> tuple[BoreFace, ...]:
        """Return the inside of the hole."""
        return (BoreFace(f"{name}_hole", 0.0, clearance, offset),)

    @property
    def sides(self) -> tuple[float, ...]:
        """Below and above."""
        return 1.0, -1.0
