"""The solid disc."""

from __future__ import annotations

from collections.abc import Iterator
from math import hypot
from typing import Literal

from pydantic import Field

from gapbeam.meshes.sections.section_patches import SectionPatches, ring_patches
from gapbeam.solver.faults import Fault
from gapbeam.solver.sections.section_table import SymmetricSection, disc_area, disc_moment, quarter_cells, round_faults

CORE = 0.55  # of the radius: the corners of the square of cells in the middle


class RoundSection(SymmetricSection):
    """A solid disc.

    Source: Cowper (1966), table 1, circle, for the shear coefficient.
    """

    type: Literal["round"] = Field(description="a solid disc; thickness and width are its diameter")

    @property
    def round(self) -> bool:
        """Its faces are curved."""
        return True

    def area(self, thickness: float, width: float) -> float:  # noqa: ARG002
        """Return pi d^2 / 4."""
        return disc_area(thickness)

    def second_moment(self, thickness: float, width: float) -> float:  # noqa: ARG002
        """Return pi d^4 / 64."""
        return disc_moment(thickness)

    def shear_coefficient(self, thickness: float, width: float, poisson_ratio: float) -> float:  # noqa: ARG002
        """Return 6 (1 + nu) / (7 + 6 nu)."""
        return 6.0 * (1.0 + poisson_ratio) / (7.0 + 6.0 * poisson_ratio)

    def torsion_constant(self, thickness: float, width: float) -> float:
        """Return pi d^4 / 32."""
        return self.polar_moment(thickness, width)

    def patches(self, thickness: float, width: float, through: int, across: int) -> SectionPatches:  # noqa: ARG002
        """Return a square of cells and four patches around it."""
        quarter = quarter_cells(through, across)
        return ring_patches(0.5 * thickness, 0.5 * CORE * thickness, quarter, max(1, quarter // 2), filled=True)

    def contains(self, y: float, z: float, thickness: float, width: float) -> bool:  # noqa: ARG002
        """Return whether a point is in the disc."""
        return hypot(y, z) <= 0.5 * thickness

    def faults(self, thickness: float, width: float) -> Iterator[Fault]:
        """Yield different diameters."""
        yield from round_faults(self.type, thickness, width)
