"""What the regions of supports have in common: the faces that bound what the beam may take up."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass

from gapbeam.solver.faults import Fault, Key
from gapbeam.solver.supports.support import Face
from gapbeam.solver.table import Table


@dataclass(frozen=True)
class Placement:
    """Where the region of a support is.

    Attributes:
        clearance: Of the support, m.
        offset: Of the support, upward from the axis of the undeformed beam, m.
        lateral: As offset, sideways, toward +y, m.
        tilt: By how much the support rises along the beam, no unit.
        middle: The middle of the support along the beam, where its offset is meant, m.
    """

    clearance: float
    offset: float = 0.0
    lateral: float = 0.0
    tilt: float = 0.0
    middle: float = 0.0


class Region(Table, ABC):
    """Table of a region."""

    type: str

    @abstractmethod
    def faces(self, name: str, placed: Placement) -> tuple[Face, ...]:
        """Return the faces that bound the region.

        Args:
            name: Of the support, with which the names of its faces begin.
            placed: Where the region is.
        """

    @property
    @abstractmethod
    def sides(self) -> tuple[float, ...]:
        """The sides of the beam on which the region is bounded: 1 below it, -1 above it."""

    @property
    def recess(self) -> float:
        """How much farther away than the clearance its wall is at most, m."""
        return 0.0

    @property
    def along_radii(self) -> bool:
        """Whether a beam in its middle is met along the radii of its section, wherever it has moved to."""
        return False

    @property
    def touches_at_once(self) -> bool:
        """Whether a beam that lies in it along its length touches it along lines or areas that do not grow."""
        return True

    def of_whole(self) -> Region:
        """Return the region as it is met where the stiffness of the whole support is given."""
        return self

    def faults(self, key: Key, radius: float) -> Iterator[Fault]:  # noqa: ARG002
        """Yield what does not fit together in the table itself, or the beam.

        Args:
            key: Of the table.
            radius: Half the thickness of the beam, m.
        """
        yield from ()
