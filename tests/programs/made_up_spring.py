"""A law with a spring of its own, as somebody would add one: a cubic stop, p = K (d + d^3 / s^2) + c d'.

`tests/regression/test_made_up_spring.py` lays this file beside the laws of the package.
"""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from gapbeam.solver.compilation.jit import compiled_in_order
from gapbeam.solver.contact.laws.damper import Damper, Parameters, per_area
from gapbeam.solver.contact.laws.law_tables import ChosenLaw
from gapbeam.solver.schema.table import Positive
from gapbeam.solver.system.operators import Array


class CubicStop(ChosenLaw):
    """K (d + d^3 / s^2): a stop that stiffens smoothly; its stiffness is four times as large at d = s."""

    type: Literal["cubic-stop"] = Field(description="name of the law")
    scale: Positive = Field(description="penetration s at which half of the pressure is cubic, m", examples=[1.0e-4])

    takes_damping: ClassVar[bool] = True
    jumps: ClassVar[bool] = True

    @property
    def dissipates(self) -> bool:
        """No, contact.damping aside."""
        return False

    def damper(self, damping: float | Array, areas: float | Array) -> Damper:
        """Return the constant damper."""
        return Damper("kelvin-voigt", per_area(damping, areas))

    @property
    def own_spring(self) -> tuple[float, ...]:
        """The scale s."""
        return (self.scale,)


@compiled_in_order
def cubic_spring(at: Parameters, depth: float) -> tuple[float, float, float]:
    """Return f(d) = d + d^3 / s^2, its slope and its integral, for d > 0; the parameter is s, m."""
    square = (depth / at[0]) ** 2
    return depth * (1.0 + square), 1.0 + 3.0 * square, depth * depth * (0.5 + 0.25 * square)
