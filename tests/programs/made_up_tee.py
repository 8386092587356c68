"""A T that gapbeam does not have, as somebody would add it: patches, and which points lie in the material."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from gapbeam.meshes.sections.section_patches import SectionPatches, grid_patches
from gapbeam.solver.schema.table import Positive
from gapbeam.solver.sections.section_table import SectionTable, wall_cells


class TeeSection(SectionTable):
    """A flange on top of a web."""

    type: Literal["tee"] = Field(description="a flange on top of a web, thickness high and width wide in all")
    web: Positive = Field(description="thickness of the web, m", examples=[0.004])
    flange: Positive = Field(description="thickness of the flange, m", examples=[0.004])

    def patches(self, thickness: float, width: float, through: int, across: int) -> SectionPatches:
        """Return three patches in the flange, and the web."""
        y, z, half = 0.5 * width, 0.5 * thickness, 0.5 * self.web
        lines = (-y, -half, half, y), (-z, z - self.flange, z)
        outer = max(1, across // 2)
        cells = (outer, wall_cells(across), outer), (through, wall_cells(through))
        return grid_patches(lines, cells, ((False, True, False), (True, True, True)))

    def contains(self, y: float, z: float, thickness: float, width: float) -> bool:
        """Return whether a point is in the web or in the flange."""
        inside = abs(y) <= 0.5 * width and abs(z) <= 0.5 * thickness
        return inside and (abs(y) <= 0.5 * self.web or z >= 0.5 * thickness - self.flange)
