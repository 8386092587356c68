"""What laws have in common whose damping follows from a coefficient of restitution and the speed at touch."""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field

from gapbeam.solver.contact.laws.chosen_law import ChosenLaw
from gapbeam.solver.contact.laws.damper import Damper
from gapbeam.solver.system.operators import Array
from gapbeam.solver.table import Number


class RestitutionLaw(ChosenLaw):
    """Table of a law K d^n (1 + chi d'), chi = p / v0 by the restitution and the speed v0 at touch of each point."""

    exponent: Number = Field(default=1.0, ge=1, le=5, description="n, no unit; 1.5 is Hertz's")
    restitution: Number = Field(gt=0, le=1, description="coefficient of restitution, no unit", examples=[0.8])

    by_touch_speed: ClassVar[bool] = True

    @property
    def spring_exponent(self) -> float:
        """The exponent n."""
        return self.exponent

    @property
    def dissipates(self) -> bool:
        """Whether the restitution is below 1."""
        return self.restitution < 1.0

    def damper(self, damping: float | Array, areas: float | Array) -> Damper:
        """Return the damper with chi = 0, until the speed at touch is known."""
        del damping, areas
        return Damper("hunt-crossley")
