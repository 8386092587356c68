"""The solid rectangle."""

from __future__ import annotations

from math import pi, sqrt, tanh
from typing import Literal

from pydantic import Field

from gapbeam.solver.sections.section_table import SymmetricSection, solid_shear

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
