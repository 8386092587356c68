"""The choice of cross-sections: `section` of [beam], by name or as a table with its `type`."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from gapbeam.solver.sections.box_section import BoxSection
from gapbeam.solver.sections.i_section import ISection
from gapbeam.solver.sections.polygon_section import PolygonSection
from gapbeam.solver.sections.rectangle import RectangularSection
from gapbeam.solver.sections.round_section import RoundSection
from gapbeam.solver.sections.tube_section import TubeSection

SectionChoice = Annotated[
    RectangularSection | BoxSection | ISection | PolygonSection | RoundSection | TubeSection,
    Field(discriminator="type"),
]
RECTANGLE = RectangularSection(type="rectangle")
