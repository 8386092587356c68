"""A hole: a bore, a sleeve or a drilled baffle around a round beam."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from gapbeam.solver.supports.regions.around_face import BoreFace
from gapbeam.solver.supports.regions.around_region import AroundRegion, place_around
from gapbeam.solver.supports.regions.region import Placement


class Hole(AroundRegion):
    """A round hole around a round section, the clearance wider than its radius."""

    type: Literal["hole"] = Field(description="a round hole around a beam of round section")
    contact: Literal["auto", "points", "circle"] = Field(
        default="auto",
        description="how its wall is met: at points around the section, each along its own radius, or as a circle, at "
        "one point of each station along the hole, along the line from the middle of the hole to the axis of the "
        "section: for sections that keep their shape, quicker, and the angular momentum of an orbit is kept; auto: at "
        "points, or as a circle with support_stiffness",
    )

    @property
    def along_radii(self) -> bool:
        """Where it is met at points; the circle is met where it is touched."""
        return self.contact != "circle"

    @property
    def touches_at_once(self) -> bool:
        """As a circle; points around the section touch one after the other."""
        return self.contact != "points"

    def of_whole(self) -> Hole:
        """Return the hole met as a circle: a force along the line from its middle to the axis of the section."""
        return self.model_copy(update={"contact": "circle"}) if self.contact == "auto" else self

    def faces(self, name: str, placed: Placement) -> tuple[BoreFace, ...]:
        """Return the inside of the hole."""
        return (BoreFace(f"{name}_hole", 0.0, *place_around(placed), exact=self.contact == "circle"),)
