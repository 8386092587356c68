"""The hollow rectangle."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

from pydantic import Field

from gapbeam.meshes.sections.section_patches import SectionPatches, grid_patches
from gapbeam.solver.faults import Fault
from gapbeam.solver.sections.section_table import SymmetricSection, thin_enough, thin_walled_shear, wall_cells
from gapbeam.solver.sections.warping_function import torsion_of_blocks
from gapbeam.solver.table import Positive


class BoxSection(SymmetricSection):
    """A hollow rectangle whose walls are all equally thick.

    Source: Cowper (1966), table 1, thin-walled box section, for the shear coefficient.
    """

    type: Literal["box"] = Field(description="a hollow rectangle, thickness high and width wide")
    wall: Positive = Field(description="thickness of all four walls, m", examples=[0.002])

    def area(self, thickness: float, width: float) -> float:
        """Return b h - b_i h_i."""
        return width * thickness - (width - 2.0 * self.wall) * (thickness - 2.0 * self.wall)

    def second_moment(self, thickness: float, width: float) -> float:
        """Return (b h^3 - b_i h_i^3) / 12."""
        inside = (width - 2.0 * self.wall) * (thickness - 2.0 * self.wall) ** 3
        return (width * thickness**3 - inside) / 12.0

    def shear_coefficient(self, thickness: float, width: float, poisson_ratio: float) -> float:
        """Return Cowper's kappa with m = n = b / h, taken between the middles of the walls."""
        n = (width - self.wall) / (thickness - self.wall)
        more = 10.0 * n**2 * ((3.0 + poisson_ratio) * n + 3.0 * n**2)
        return thin_walled_shear(n, more, poisson_ratio)

    def torsion_constant(self, thickness: float, width: float) -> float:
        """Return J by finite elements, for walls of any thickness; Bredt's 4 A_m^2 t / s is that of thin ones."""
        outer = 0.5 * width, 0.5 * thickness
        return torsion_of_blocks((outer[0] - self.wall, outer[1] - self.wall), outer, ((False, True), (True, True)))

    def patches(self, thickness: float, width: float, through: int, across: int) -> SectionPatches:
        """Return four corners and four walls."""
        y, z, wall = 0.5 * width, 0.5 * thickness, self.wall
        lines = (-y, wall - y, y - wall, y), (-z, wall - z, z - wall, z)
        thin = wall_cells(through)
        full, hollow = (True, True, True), (True, False, True)
        return grid_patches(lines, ((thin, across, thin), (thin, through, thin)), (full, hollow, full))

    def contains(self, y: float, z: float, thickness: float, width: float) -> bool:
        """Return whether a point is in a wall."""
        outside = abs(y) > 0.5 * width or abs(z) > 0.5 * thickness
        return not outside and (abs(y) >= 0.5 * width - self.wall or abs(z) >= 0.5 * thickness - self.wall)

    def hollow(self, thickness: float, width: float) -> tuple[float, float]:
        """Return the sizes between the walls."""
        return thickness - 2.0 * self.wall, width - 2.0 * self.wall

    def faults(self, thickness: float, width: float) -> Iterator[Fault]:
        """Yield walls that leave no hollow."""
        yield from thin_enough("wall", self.wall, 0.5 * min(thickness, width), "half of the thickness and of the width")
