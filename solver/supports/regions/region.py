"""What the regions of supports have in common: the faces that bound what the beam may take up."""

from __future__ import annotations

from abc import ABC, abstractmethod

from gapbeam.solver.supports.support import Face
from gapbeam.solver.table import Table


class Region(Table, ABC):
    """Table of a region."""

    @abstractmethod
    def faces(self, name: str, clearance: float, offset: float) -> tuple[Face, ...]:
        """Return the faces that bound the region.

        Args:
            name: Of the support, with which the names of its faces begin.
            clearance: Of the support, m.
            offset: Of the support, upward from the axis of the undeformed beam, m.
        """

    @property
    @abstractmethod
    def sides(self) -> tuple[float, ...]:
        """The sides of the beam on which the region is bounded: 1 below it, -1 above it."""
