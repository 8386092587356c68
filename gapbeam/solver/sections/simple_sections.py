"""Simple cross-sections: tube, solid rectangle, solid disc."""

from __future__ import annotations

from collections.abc import Iterator
from math import hypot, pi, sqrt, tanh
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
    solid_shear,
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


TERMS = 400  # n up to which the series of the torsion constant is summed; what is left out is 1e-11 of it


class RectangularSection(SymmetricSection):
    """A solid rectangle.

    Source: Cowper (1966), J. Appl. Mech. 33, 335-340, table 1, for the shear coefficients of all sections.
    """

    type: Literal["rectangle"] = Field(description="a solid rectangle, thickness high and width wide")

    def area(self, thickness: float, width: float) -> float:
        """Return b h."""
        return width * thickness

    def second_moment(self, thickness: float, width: float) -> float:
        """Return b h^3 / 12."""
        return width * thickness**3 / 12.0

    def gyration_radius(self, thickness: float, width: float) -> float:  # noqa: ARG002
        """Return h / sqrt(12)."""
        return thickness / sqrt(12.0)

    def height(self, thickness: float, width: float) -> float:  # noqa: ARG002
        """Return h."""
        return thickness

    def shear_coefficient(self, thickness: float, width: float, poisson_ratio: float) -> float:  # noqa: ARG002
        """Return 10 (1 + nu) / (12 + 11 nu)."""
        return solid_shear(poisson_ratio)

    def torsion_constant(self, thickness: float, width: float) -> float:
        """Return a b^3 / 3 (1 - 192 b / (pi^5 a) sum tanh(n pi a / (2 b)) / n^5), n = 1, 3, ..., with a >= b.

        Source: Timoshenko and Goodier (1970), Theory of Elasticity, 3rd ed., sec. 109.
        """
        long, short = max(thickness, width), min(thickness, width)
        series = sum(tanh(0.5 * n * pi * long / short) / n**5 for n in range(1, TERMS, 2))
        return long * short**3 / 3.0 * (1.0 - 192.0 * short / (pi**5 * long) * series)

    def patches(self, thickness: float, width: float, through: int, across: int) -> None:  # noqa: ARG002
        """Return None: layers follow the points of loads and probes."""
        return

    def contains(self, y: float, z: float, thickness: float, width: float) -> bool:
        """Return whether a point is in the rectangle."""
        return abs(y) <= 0.5 * width and abs(z) <= 0.5 * thickness


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
