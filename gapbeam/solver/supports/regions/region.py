"""Regions of supports: the faces that bound the beam. A stop is one plane, a slot is a plane below and one above."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar, Literal

from pydantic import Field

from gapbeam.solver.messages.errors import Fault, Key
from gapbeam.solver.schema.table import Table
from gapbeam.solver.supports.support import Face


@dataclass(frozen=True)
class Placement:
    """Place of the region of a support.

    Attributes:
        clearance: Clearance of the support, m.
        offset: Offset of the support, upward from the axis of the undeformed beam, m.
        lateral: As offset, sideways, toward +y, m.
        tilt: Rise of the support along the beam, no unit.
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
            name: Name of the support, with which the names of its faces begin.
            placed: Placement of the region.
        """

    @property
    @abstractmethod
    def sides(self) -> tuple[float, ...]:
        """The sides of the beam on which the region is bounded: 1 below it, -1 above it."""

    @property
    def recess(self) -> float:
        """Largest distance of the wall beyond the clearance, m."""
        return 0.0

    @property
    def along_radii(self) -> bool:
        """True where a centered beam is met along the radii of its section, wherever it has moved."""
        return False

    @property
    def touches_at_once(self) -> bool:
        """True where a beam that lies along the support touches along lines or areas that do not grow."""
        return True

    def of_whole(self) -> Region:
        """Return the region as it is met where the stiffness of the whole support is given."""
        return self

    def faults(self, key: Key, radius: float) -> Iterator[Fault]:  # noqa: ARG002
        """Yield the contradictions within the table, or to the beam.

        Args:
            key: Key of the table.
            radius: Half the thickness of the beam, m.
        """
        yield from ()


SIDES = {"below": 1.0, "above": -1.0}


class Stop(Region):
    """One plane, the clearance away from the undeformed beam."""

    type: Literal["stop"] = Field(description="one plane on one side of the beam")
    side: Literal["below", "above"] = Field(default="below", description="side of the beam on which the plane is")

    def faces(self, name: str, placed: Placement) -> tuple[Face, ...]:
        """Return the plane; an offset moves it upward."""
        side = SIDES[self.side]
        gap = placed.clearance - side * placed.offset
        return (Face(f"{name}_{self.side}", side, gap, placed.tilt, placed.middle),)

    @property
    def sides(self) -> tuple[float, ...]:
        """The side of the plane."""
        return (SIDES[self.side],)


class Slot(Region):
    """Two planes, half of the clearance on either side of a centered beam."""

    sides: ClassVar[tuple[float, ...]] = (1.0, -1.0)

    type: Literal["slot"] = Field(description="one plane below and one above the beam")

    def faces(self, name: str, placed: Placement) -> tuple[Face, ...]:
        """Return both planes: an offset opens the upper gap and closes the lower one."""
        below, above = 0.5 * placed.clearance - placed.offset, 0.5 * placed.clearance + placed.offset
        return (
            Face(f"{name}_below", 1.0, below, placed.tilt, placed.middle),
            Face(f"{name}_above", -1.0, above, placed.tilt, placed.middle),
        )


class AroundRegion(Region, ABC):
    """A region whose one face is met all around a beam of round section."""

    sides: ClassVar[tuple[float, ...]] = (1.0, -1.0)


def place_around(placed: Placement) -> tuple[float, float, float, float, float]:
    """Return the first arguments of all faces around a beam, from their gap on."""
    return placed.clearance, placed.tilt, placed.middle, placed.offset, placed.lateral
