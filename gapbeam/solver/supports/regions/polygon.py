"""A polygon: flat walls around a round beam, such as a broached hole, lattice bars or a V-block."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field

from gapbeam.solver.faults import Fault, Key
from gapbeam.solver.supports.regions.around_face import WallsFace
from gapbeam.solver.supports.regions.around_region import AroundRegion, place_around
from gapbeam.solver.supports.regions.region import Placement
from gapbeam.solver.table import Number

MOST = 24  # walls
NEAREST = 15.0  # degrees between two walls, so that contact points of coarse meshes look at each


class Polygon(AroundRegion):
    """Flat walls, each the clearance away from the round beam in the middle: always convex, closed or open."""

    type: Literal["polygon"] = Field(description="flat walls around a beam of round section: V-block, bars, hexagon")
    walls: Annotated[tuple[Number, ...], Field(min_length=1, max_length=MOST)] = Field(
        description="directions of the walls seen from the axis, from straight down and positive toward +y, degrees",
        examples=[[-45.0, 45.0]],
    )
    recesses: Annotated[tuple[Number, ...], Field(max_length=MOST)] = Field(
        default=(), description="how much farther away than the clearance each wall is; none given: 0, m"
    )

    def faces(self, name: str, placed: Placement) -> tuple[WallsFace, ...]:
        """Return all walls as one face."""
        recesses = self.recesses or (0.0,) * len(self.walls)
        return (WallsFace(f"{name}_walls", 0.0, *place_around(placed), self.walls, recesses),)

    @property
    def recess(self) -> float:
        """That of the farthest wall."""
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
                f"{len(self.recesses)} for {len(self.walls)} walls",
                "one recess for each wall, or none",
                related=((*key, "walls"),),
            )
