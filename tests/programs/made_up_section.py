"""A cross-section that gapbeam does not have, in one file, as somebody would add it: a cross of two bars."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

from pydantic import Field

from gapbeam.meshes.sections.section_patches import SectionPatches, grid_patches
from gapbeam.solver.messages.errors import Fault
from gapbeam.solver.schema.table import Positive
from gapbeam.solver.sections.section_table import SectionTable, solid_shear, thin_enough, wall_cells


class CrossSection(SectionTable):
    """An upright bar and one across, equally thick, through the axis of the beam."""

    type: Literal["cross"] = Field(description="two crossed bars, thickness high and width wide in all")
    bar: Positive = Field(description="thickness of both bars, m", examples=[0.004])

    def area(self, thickness: float, width: float) -> float:
        """Return t (h + b - t)."""
        return self.bar * (thickness + width - self.bar)

    def second_moment(self, thickness: float, width: float) -> float:
        """Return (t h^3 + (b - t) t^3) / 12."""
        return (self.bar * thickness**3 + (width - self.bar) * self.bar**3) / 12.0

    def height(self, thickness: float, width: float) -> float:
        """Return A / t: supports touch the upright bar."""
        return self.area(thickness, width) / self.bar

    def shear_coefficient(self, thickness: float, width: float, poisson_ratio: float) -> float:
        """Return the kappa of a rectangle over the upright bar, which carries the shear."""
        return self.bar * thickness / self.area(thickness, width) * solid_shear(poisson_ratio)

    def patches(self, thickness: float, width: float, through: int, across: int) -> SectionPatches:
        """Return four arms and what they have in common."""
        y, z, half = 0.5 * width, 0.5 * thickness, 0.5 * self.bar
        lines = (-y, -half, half, y), (-z, -half, half, z)
        cells = tuple((max(1, count // 2), wall_cells(count), max(1, count // 2)) for count in (across, through))
        arm, middle = (False, True, False), (True, True, True)
        return grid_patches(lines, (cells[0], cells[1]), (arm, middle, arm))

    def contains(self, y: float, z: float, thickness: float, width: float) -> bool:
        """Return whether a point is in one of the bars."""
        outside = abs(y) > 0.5 * width or abs(z) > 0.5 * thickness
        return not outside and min(abs(y), abs(z)) <= 0.5 * self.bar

    def faults(self, thickness: float, width: float) -> Iterator[Fault]:
        """Yield bars that leave no arms."""
        yield from thin_enough("bar", self.bar, min(thickness, width), "the smaller one of thickness and width")
