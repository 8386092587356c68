"""Lankarani and Nikravesh's law: Hunt and Crossley's damping with chi = 3 (1 - e^2) / (4 v0).

It gives a higher restitution than asked for unless e is close to 1.

Source: Lankarani and Nikravesh (1990), J. Mech. Des. 112, 369-376; Eq. 2 of Li et al. (2013).
"""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from gapbeam.solver.contact.laws.hunt_crossley import nearly_elastic_product
from gapbeam.solver.contact.laws.restitution_law import RestitutionLaw
from gapbeam.solver.table import Number


class LankaraniNikravesh(RestitutionLaw):
    """K d^n (1 + chi d'), chi = 3 (1 - e^2) / (4 v0): Eq. 2 of Li et al. (2013); returns more than e."""

    type: Literal["lankarani-nikravesh"] = Field(description="name of the law")
    exponent: Number = Field(default=1.5, ge=1, le=5, description="n, no unit; 1.5 is Hertz's")
    restitution: Number = Field(gt=0, le=1, description="coefficient of restitution e, no unit", examples=[0.8])

    @property
    def touch_product(self) -> float:
        """The product p = chi v0 = 3 (1 - e^2) / 4."""
        return nearly_elastic_product(self.restitution)
