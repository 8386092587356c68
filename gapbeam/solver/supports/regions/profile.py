"""A profile: a hole that is not round, measured or worn."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from math import radians
from typing import Annotated, Literal

from pydantic import Field

from gapbeam.solver.faults import Fault, Key
from gapbeam.solver.supports.regions.around_face import ProfileFace
from gapbeam.solver.supports.regions.around_region import AroundRegion, place_around
from gapbeam.solver.supports.regions.region import Placement
from gapbeam.solver.table import Number

FEWEST, MOST = 3, 3600  # angles
STEEPEST = 0.1  # slope of the wall, up to which the radii of the section stand for its normals


class Profile(AroundRegion):
    """A hole whose radius is given over the angle, linear in between and the same all along the support."""

    type: Literal["profile"] = Field(
        description="a hole around a beam of round section that is not round: measured, drawn or worn"
    )
    angles: Annotated[tuple[Number, ...], Field(min_length=FEWEST, max_length=MOST)] = Field(
        description="directions in ascending order within one turn, from straight down and positive toward +y, degrees",
        examples=[[-90.0, 0.0, 90.0, 180.0]],
    )
    recesses: Annotated[tuple[Number, ...], Field(max_length=MOST)] = Field(
        description="how much farther out than the clearance the wall is in these directions, linear in between, m",
        examples=[[0.0, 5.0e-5, 0.0, 0.0]],
    )

    @property
    def along_radii(self) -> bool:
        """Yes: the wall is met along the radii of the section."""
        return True

    def faces(self, name: str, placed: Placement) -> tuple[ProfileFace, ...]:
        """Return the inside of the hole."""
        return (ProfileFace(f"{name}_hole", 0.0, *place_around(placed), self.angles, self.recesses),)

    @property
    def touches_at_once(self) -> bool:
        """Never: points around the section touch one after the other."""
        return False

    @property
    def recess(self) -> float:
        """That of the widest direction."""
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
                f"{len(recesses)} for {len(angles)} angles",
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
