"""A stop that yields: elastic up to a yield pressure, then plastic, with a set that stays; the gap has grown.

A mass m that arrives at v0 on such a stop (F_y, k of the whole contact, no hardening) leaves a set s and returns at v1:

    m v0^2 / 2 = F_y s + F_y^2 / (2 k),    v1 = F_y / sqrt(k m)
"""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from gapbeam.solver.contact.laws.chosen_law import ChosenLaw
from gapbeam.solver.contact.laws.damper import Damper, per_area
from gapbeam.solver.system.operators import Array
from gapbeam.solver.table import Number, Positive


class ElasticPlastic(ChosenLaw):
    """A linear spring K that yields at a pressure, returns along K and keeps its plastic set, with contact.damping."""

    type: Literal["elastic-plastic"] = Field(description="name of the law")
    yield_pressure: Positive = Field(
        description="pressure at which the stop yields (of each of contact.points in N), Pa", examples=[2.0e6]
    )
    hardening: Number = Field(
        default=0.0, ge=0, le=0.99, description="stiffness of loading beyond the yield pressure, relative to K, no unit"
    )

    takes_damping: ClassVar[bool] = True
    jumps: ClassVar[bool] = True
    keeps_set: ClassVar[bool] = True

    @property
    def yield_point(self) -> tuple[float, float]:
        """Yield pressure and hardening."""
        return self.yield_pressure, self.hardening

    @property
    def dissipates(self) -> bool:
        """Yes: by plastic work."""
        return True

    def damper(self, damping: float | Array, areas: float | Array) -> Damper:
        """Return the constant damper."""
        return Damper("kelvin-voigt", per_area(damping, areas))
