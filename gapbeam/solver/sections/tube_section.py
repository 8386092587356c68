"""The round tube."""

from __future__ import annotations

from collections.abc import Iterator
from math import hypot
from typing import Literal

from pydantic import Field

from gapbeam.meshes.sections.section_patches import SectionPatches, ring_patches
from gapbeam.solver.faults import Fault
from gapbeam.solver.sections.section_table import (
    SymmetricSection,
    disc_area,
    disc_moment,
    quarter_cells,
    round_faults,
    thin_enough,
    wall_cells,
)
from gapbeam.solver.table import Positive


class TubeSection(SymmetricSection):
    """A round tube.

    Source: Cowper (1966), table 1, hollow circle, for the shear coefficient.
    """

    type: Literal["tube"] = Field(description="a round tube; thickness and width are its outer diameter")
    wall: Positive = Field(description="thickness of the wall, m", examples=[0.005])

    @property
    def round(self) -> bool:
        """Its faces are curved."""
        return True

    def area(self, thickness: float, width: float) -> float:  # noqa: ARG002
        """Return pi (d^2 - d_i^2) / 4."""
        return disc_area(thickness) - disc_area(thickness - 2.0 * self.wall)

    def second_moment(self, thickness: float, width: float) -> float:  # noqa: ARG002
        """Return pi (d^4 - d_i^4) / 64."""
        return disc_moment(thickness) - disc_moment(thickness - 2.0 * self.wall)

    def shear_coefficient(self, thickness: float, width: float, poisson_ratio: float) -> float:  # noqa: ARG002
        """Return 6 (1 + nu) (1 + m^2)^2 / ((7 + 6 nu) (1 + m^2)^2 + (20 + 12 nu) m^2) with m = d_i / d."""
        square, nu = ((thickness - 2.0 * self.wall) / thickness) ** 2, poisson_ratio
        whole = (1.0 + square) ** 2
        return 6.0 * (1.0 + nu) * whole / ((7.0 + 6.0 * nu) * whole + (20.0 + 12.0 * nu) * square)

    def torsion_constant(self, thickness: float, width: float) -> float:
        """Return pi (d^4 - d_i^4) / 32."""
        return self.polar_moment(thickness, width)

    def patches(self, thickness: float, width: float, through: int, across: int) -> SectionPatches:  # noqa: ARG002
        """Return four quarters."""
        radius, quarter = 0.5 * thickness, quarter_cells(through, across)
        return ring_patches(radius, radius - self.wall, quarter, wall_cells(quarter), filled=False)

    def contains(self, y: float, z: float, thickness: float, width: float) -> bool:  # noqa: ARG002
        """Return whether a point is in the wall."""
        return 0.5 * thickness - self.wall <= hypot(y, z) <= 0.5 * thickness

    def hollow(self, thickness: float, width: float) -> tuple[float, float]:
        """Return the inner diameter, twice."""
        return thickness - 2.0 * self.wall, width - 2.0 * self.wall

    def faults(self, thickness: float, width: float) -> Iterator[Fault]:
        """Yield different diameters, and walls that leave no bore."""
        yield from round_faults(self.type, thickness, width)
        yield from thin_enough("wall", self.wall, 0.5 * thickness, "half of the diameter")
