"""The choice of regions: `region` of a [[support]], by name or as a table with its `type`."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from gapbeam.solver.supports.regions.hole import Hole
from gapbeam.solver.supports.regions.polygon import Polygon
from gapbeam.solver.supports.regions.profile import Profile
from gapbeam.solver.supports.regions.slot import Slot
from gapbeam.solver.supports.regions.stop import Stop

RegionChoice = Annotated[Slot | Stop | Hole | Polygon | Profile, Field(discriminator="type")]
