"""What the regions of supports have in common: the planes that bound what the beam may take up."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import NamedTuple

from gapbeam.solver.table import Table


class Plane(NamedTuple):
    """A rigid plane across the bending axis.

    Attributes:
        word: What distinguishes the planes of one region, in the names of faces.
        side: +1 below the beam, -1 above it.
        gap: Distance to the outermost point of the undeformed beam, of any sign, m.
    """

    word: str
    side: float
    gap: float


class Region(Table, ABC):
    """Table of a region."""

    @abstractmethod
    def planes(self, clearance: float, offset: float) -> tuple[Plane, ...]:
        """Return the planes that bound the region.

        Args:
            clearance: Of the support, m.
            offset: Of the support, upward from the axis of the undeformed beam, m.
        """

    @property
    @abstractmethod
    def sides(self) -> tuple[float, ...]:
        """The sides on which the region is bounded."""
