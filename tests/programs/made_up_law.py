"""A law that nobody asked for, as somebody would add one: damping that grows with the penetration, p = K d + b d d'.

`tests/regression/test_made_up_law.py` lays this file beside the laws of the package.
"""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from gapbeam.solver.compilation.jit import compiled_in_order
from gapbeam.solver.contact.laws.damper import DampedPoint, Damper, per_area
from gapbeam.solver.contact.laws.law_tables import ChosenLaw
from gapbeam.solver.schema.table import NonNegative
from gapbeam.solver.system.operators import Array


class GrowingLaw(ChosenLaw):
    """K d + b d d': damping that grows with the penetration."""

    type: Literal["growing"] = Field(description="name of the law")
    growth: NonNegative = Field(description="growth b of the damping, Pa s/m^2", examples=[1.0e12])

    @property
    def dissipates(self) -> bool:
        """Whether there is damping."""
        return self.growth > 0.0

    def damper(self, damping: float | Array, areas: float | Array) -> Damper:
        """Return the damper with b."""
        del damping
        return Damper("growing", per_area(self.growth, areas))


@compiled_in_order
def growing_damping(at: DampedPoint, depth: float) -> tuple[float, float, float]:
    """Return c(d) = b d, its slope and its integral, for d > 0; the coefficient is b, Pa s/m^2."""
    return at.coefficient * depth, at.coefficient, 0.5 * at.coefficient * depth * depth
