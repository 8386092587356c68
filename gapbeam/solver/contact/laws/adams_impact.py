"""The law of ADAMS's IMPACT function: p = K d^n + c(d) d', c rising as a smooth step up to a depth."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from gapbeam.solver.contact.laws.chosen_law import ChosenLaw
from gapbeam.solver.contact.laws.damper import DampedPoint, Damper, per_area
from gapbeam.solver.jit import compiled_in_order
from gapbeam.solver.system.operators import Array
from gapbeam.solver.table import NonNegative, Number, Positive


class AdamsImpact(ChosenLaw):
    """K d^n + c(d) d', c rising as a smooth step up to a depth: ADAMS's IMPACT function."""

    type: Literal["adams-impact"] = Field(description="name of the law")
    exponent: Number = Field(default=1.5, ge=1, le=5, description="n, no unit")
    damping: NonNegative = Field(
        description="full damping per area (of each of contact.points in N s/m), Pa s/m", examples=[1.0e6]
    )
    full_depth: Positive = Field(description="penetration at which the damping is full, m", examples=[1.0e-5])

    @property
    def spring_exponent(self) -> float:
        """The exponent n."""
        return self.exponent

    @property
    def dissipates(self) -> bool:
        """Whether there is damping."""
        return self.damping > 0.0

    def damper(self, damping: float | Array, areas: float | Array) -> Damper:
        """Return the damper with c_max and d_max."""
        del damping
        return Damper("adams-impact", per_area(self.damping, areas), (self.full_depth,))


@compiled_in_order
def stepped_damping(at: DampedPoint, depth: float) -> tuple[float, float, float]:
    """Return c(d) = c_max q^2 (3 - 2 q), q = d / d_max up to 1, its slope and its integral, for d > 0.

    C(d) = c_max d_max (q^3 - q^4 / 2) up to d_max, then linear. The coefficient is c_max, Pa s/m; the
    parameter d_max, m.
    """
    full_depth = at.parameters[0]
    q = min(depth / full_depth, 1.0)
    beyond = max(depth - full_depth, 0.0)
    return (
        at.coefficient * q * q * (3.0 - 2.0 * q),
        at.coefficient * 6.0 * q * (1.0 - q) / full_depth,
        at.coefficient * (full_depth * (q * q * q) * (1.0 - 0.5 * q) + beyond),
    )
