"""A law with a spring of its own, as somebody would add one: a cubic stop, p = K (d + d^3 / s^2) + c d'.

`tests/regression/test_made_up_spring.py` lays this file beside the laws of the package.
"""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from gapbeam.solver.contact.laws.damper import Damper, per_area
from gapbeam.solver.contact.laws.law_tables import ChosenLaw
from gapbeam.solver.contact.laws.own_spring import OwnSpring
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

    def own_spring(self, stiffness: float | Array) -> OwnSpring:
        """Return the cubic spring."""
        k, s = stiffness, self.scale
        return OwnSpring(
            pressure=lambda d: np.asarray(k * (d + d**3 / s**2)),
            slope=lambda d: np.asarray(k * (1.0 + 3.0 * (d / s) ** 2)),
            potential=lambda d: np.asarray(k * (0.5 * d**2 + 0.25 * d**4 / s**2)),
        )
