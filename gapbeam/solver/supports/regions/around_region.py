"""What regions around a round beam have in common."""

from __future__ import annotations

from abc import ABC

from gapbeam.solver.supports.regions.region import Placement, Region


class AroundRegion(Region, ABC):
    """A region whose one face is met all around a beam of round section."""

    @property
    def sides(self) -> tuple[float, ...]:
        """Below and above: the face takes all of the surface of the beam."""
        return 1.0, -1.0


def place_around(placed: Placement) -> tuple[float, float, float, float, float]:
    """Return what all faces around a beam begin with, from their gap on."""
    return placed.clearance, placed.tilt, placed.middle, placed.offset, placed.lateral
