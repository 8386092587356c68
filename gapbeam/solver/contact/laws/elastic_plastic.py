"""A stop that yields: elastic up to a yield pressure, then plastic, with a set that stays; the gap has grown.

A mass m that arrives at v0 on such a stop (F_y, k of the whole contact, no hardening) leaves a set s and returns at v1:

    m v0^2 / 2 = F_y s + F_y^2 / (2 k),    v1 = F_y / sqrt(k m)
"""

from __future__ import annotations

from collections.abc import Iterator
from math import inf
from typing import ClassVar, Literal

from pydantic import Field

from gapbeam.solver.contact.formulations.chosen_formulation import ChosenFormulation
from gapbeam.solver.contact.laws.chosen_law import ChosenLaw
from gapbeam.solver.contact.laws.damper import Damper, per_area
from gapbeam.solver.faults import Fault
from gapbeam.solver.system.operators import Array
from gapbeam.solver.table import Number, Positive


class ElasticPlastic(ChosenLaw):
    """A linear spring K that yields at a pressure, returns along K and keeps its plastic set, with contact.damping."""

    type: Literal["elastic-plastic"] = Field(description="name of the law")
    yield_pressure: Positive | None = Field(
        default=None,
        description="pressure at which the stop yields (of each of contact.points in N), Pa",
        examples=[2.0e6],
    )
    yield_force: Positive | None = Field(
        default=None,
        description="force at which a whole support yields, instead of yield_pressure, at supports with "
        "support_stiffness, N",
        examples=[500.0],
    )
    hardening: Number = Field(
        default=0.0, ge=0, le=0.99, description="stiffness of loading beyond the yield pressure, relative to K, no unit"
    )

    takes_damping: ClassVar[bool] = True
    jumps: ClassVar[bool] = True
    keeps_set: ClassVar[bool] = True

    @property
    def yield_point(self) -> tuple[float, float]:
        """Yield pressure or force, and hardening."""
        return self.yield_pressure or self.yield_force or inf, self.hardening

    @property
    def yields_as_whole(self) -> bool:
        """Whether a force is given."""
        return self.yield_force is not None

    @property
    def dissipates(self) -> bool:
        """Yes: by plastic work."""
        return True

    def damper(self, damping: float | Array, areas: float | Array) -> Damper:
        """Return the constant damper."""
        return Damper("kelvin-voigt", per_area(damping, areas))

    def contradictions(self, formulation: ChosenFormulation, damping: float) -> Iterator[Fault]:
        """The law has one yield point."""
        del formulation, damping
        if self.yield_pressure is None and self.yield_force is None:
            yield Fault(
                ("contact", "law", "yield_pressure"),
                "no yield_pressure and no yield_force",
                "one of the two: where the stop yields",
                "yield_pressure = 2e6, Pa, or yield_force = 500, N, with the support_stiffness of the support",
            )
        elif self.yield_pressure is not None and self.yield_force is not None:
            yield Fault(
                ("contact", "law", "yield_force"),
                f"{self.yield_force:g} N together with yield_pressure = {self.yield_pressure:g}",
                "one of the two",
                "leave one of them out",
                (("contact", "law", "yield_pressure"),),
            )
