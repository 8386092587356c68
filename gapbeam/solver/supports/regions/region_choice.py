"""Regions that a [[support]] may have, by name or as a table with its `type`.

A hole is a bore, a sleeve or a drilled baffle around a round beam; a profile is a hole that is not round, measured or
worn; a polygon consists of flat walls, such as a broached hole, lattice bars or a V-block.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from math import radians
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from gapbeam.solver.messages.errors import Fault, Key
from gapbeam.solver.messages.wording import counted
from gapbeam.solver.schema.table import OF_TYPE, Number
from gapbeam.solver.supports.regions.around_face import BoreFace, ProfileFace, WallsFace
from gapbeam.solver.supports.regions.region import AroundRegion, Placement, Slot, Stop, place_around

FEWEST, MOST = 3, 3600  # angles
STEEPEST = 0.1  # slope of the wall, up to which the radii of the section stand for its normals


class Profile(AroundRegion):
    """A hole whose radius is given over the angle, linear in between."""

    along_radii: ClassVar[bool] = True
    touches_at_once: ClassVar[bool] = False

    type: Literal["profile"] = Field(
        description="a hole around a beam of round section that is not round: measured, drawn or worn"
    )
    angles: Annotated[tuple[Number, ...], Field(min_length=FEWEST, max_length=MOST)] = Field(
        description="ascending directions within one turn: 0 is down, 90 toward +y, degrees",
        examples=[[-90.0, 0.0, 90.0, 180.0]],
    )
    recesses: Annotated[tuple[Number, ...], Field(max_length=MOST)] = Field(
        description="distance of the wall beyond the clearance in these directions, linear in between, m",
        examples=[[0.0, 5.0e-5, 0.0, 0.0]],
    )

    def faces(self, name: str, placed: Placement) -> tuple[ProfileFace, ...]:
        """Return the inside of the hole."""
        return (ProfileFace(f"{name}_hole", 0.0, *place_around(placed), self.angles, self.recesses),)

    @property
    def recess(self) -> float:
        """Recess of the widest direction."""
        return max(0.0, *self.recesses)

    def faults(self, key: Key, radius: float) -> Iterator[Fault]:
        """Yield angles that do not ascend, a number of recesses that is another, and steep walls."""
        angles, recesses = self.angles, self.recesses
        if any(one >= following for one, following in pairwise(angles)) or angles[-1] - angles[0] >= 360.0:
            yield Fault(
                (*key, "angles"),
                f"{list(angles)} degrees",
                "angles in ascending order, less than 360 degrees from the first to the last",
                "leave out the last one where it repeats the first",
            )
        elif len(recesses) != len(angles):
            yield Fault(
                (*key, "recesses"),
                f"{len(recesses)} for {counted(len(angles), 'angle')}",
                "one recess for each angle",
                related=((*key, "angles"),),
            )
        else:
            ends = [*zip(angles, recesses, strict=True), (angles[0] + 360.0, recesses[0])]
            for (start, first), (end, last) in pairwise(ends):
                slope = abs(last - first) / (radius * radians(end - start))
                if slope > STEEPEST:
                    yield Fault(
                        (*key, "recesses"),
                        f"{first:g} m at {start:g} degrees and {last:g} m at {end:g}, a slope of {slope:.3g}",
                        f"slopes up to {STEEPEST:g}: contact acts along the radii of the beam",
                        'flat walls are those of the region "polygon"',
                    )
                    return


class Hole(AroundRegion):
    """A round hole around a round section, the clearance wider than its radius."""

    type: Literal["hole"] = Field(description="a round hole around a beam of round section")
    contact: Literal["auto", "points", "circle"] = Field(
        default="auto",
        description="contact at points around the section, or as a circle at one point of each station, for sections "
        "that keep their shape; auto: circle with support_stiffness, else points",
    )

    @property
    def along_radii(self) -> bool:
        """True where the hole is met at points; a circle is met where it is touched."""
        return self.contact != "circle"

    @property
    def touches_at_once(self) -> bool:
        """True for a circle; points around the section touch one after the other."""
        return self.contact != "points"

    def of_whole(self) -> Hole:
        """Return the hole met as a circle: a force along the line from its middle to the axis of the section."""
        return self.model_copy(update={"contact": "circle"}) if self.contact == "auto" else self

    def faces(self, name: str, placed: Placement) -> tuple[BoreFace, ...]:
        """Return the inside of the hole."""
        return (BoreFace(f"{name}_hole", 0.0, *place_around(placed), exact=self.contact == "circle"),)


POLYGON_MOST = 24  # walls
NEAREST = 15.0  # degrees between two walls, so that contact points of coarse meshes look at each


class Polygon(AroundRegion):
    """Flat walls, each the clearance away from the round beam in the middle, closed or open."""

    type: Literal["polygon"] = Field(description="flat walls around a beam of round section: V-block, bars, hexagon")
    walls: Annotated[tuple[Number, ...], Field(min_length=1, max_length=POLYGON_MOST)] = Field(
        description="directions of the walls from the axis: 0 is down, 90 toward +y, degrees",
        examples=[[-45.0, 45.0]],
    )
    recesses: Annotated[tuple[Number, ...], Field(max_length=POLYGON_MOST)] = Field(
        default=(), description="distance of each wall beyond the clearance; none given: 0, m"
    )

    def faces(self, name: str, placed: Placement) -> tuple[WallsFace, ...]:
        """Return all walls as one face."""
        recesses = self.recesses or (0.0,) * len(self.walls)
        return (WallsFace(f"{name}_walls", 0.0, *place_around(placed), self.walls, recesses),)

    @property
    def recess(self) -> float:
        """Recess of the farthest wall."""
        return max(0.0, *self.recesses, 0.0)

    def faults(self, key: Key, radius: float) -> Iterator[Fault]:  # noqa: ARG002
        """Yield walls in the same direction, and a number of recesses that is another."""
        turns = sorted(angle % 360.0 for angle in self.walls)
        if any(following - one < NEAREST for one, following in pairwise([*turns, turns[0] + 360.0])):
            yield Fault(
                (*key, "walls"),
                f"{list(self.walls)} degrees",
                f"directions at least {NEAREST:g} degrees apart",
                'many walls are a region "profile"; of two in one direction the beam meets the nearer one alone',
            )
        if self.recesses and len(self.recesses) != len(self.walls):
            yield Fault(
                (*key, "recesses"),
                f"{len(self.recesses)} for {counted(len(self.walls), 'wall')}",
                "one recess for each wall, or none",
                related=((*key, "walls"),),
            )


RegionChoice = Annotated[Slot | Stop | Hole | Polygon | Profile, OF_TYPE]
