"""A stop that stiffens: a linear spring whose stiffness changes at given depths, with a constant damper.

    p(d) = K (<d> + sum_j (f_j - f_(j-1)) <d - d_j>) + c d',   f_0 = 1

K holds from touch to the first depth, f_j K from the depth d_j on: a force over penetration as a polygon. A buffer
before a hard stop and a bump stop are such laws.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar, Literal

from pydantic import Field

from gapbeam.solver.contact.formulations.chosen_formulation import ChosenFormulation
from gapbeam.solver.contact.laws.chosen_law import ChosenLaw
from gapbeam.solver.contact.laws.damper import Damper, per_area
from gapbeam.solver.faults import Fault
from gapbeam.solver.system.operators import Array
from gapbeam.solver.table import NonNegative, Positive


class PiecewiseLinear(ChosenLaw):
    """A linear spring K whose stiffness changes at given depths, with contact.damping: stops that stiffen, buffers."""

    type: Literal["piecewise-linear"] = Field(description="name of the law")
    depths: tuple[Positive, ...] = Field(
        min_length=1,
        max_length=100,
        description="penetrations at which the stiffness changes, ascending, m",
        examples=[[1.0e-4, 2.0e-4]],
    )
    factors: tuple[NonNegative, ...] = Field(
        min_length=1,
        max_length=100,
        description="stiffness beyond each of these depths, relative to K, no unit",
        examples=[[3.0, 20.0]],
    )

    takes_damping: ClassVar[bool] = True
    jumps: ClassVar[bool] = True

    @property
    def bends(self) -> tuple[tuple[float, float], ...]:
        """Depths with their factors."""
        return tuple(zip(self.depths, self.factors, strict=True))

    @property
    def dissipates(self) -> bool:
        """No, contact.damping aside."""
        return False

    def damper(self, damping: float | Array, areas: float | Array) -> Damper:
        """Return the constant damper."""
        return Damper("kelvin-voigt", per_area(damping, areas))

    def contradictions(self, formulation: ChosenFormulation, damping: float) -> Iterator[Fault]:
        """Every depth has a factor, and depths ascend."""
        del formulation, damping
        if len(self.factors) != len(self.depths):
            yield Fault(
                ("contact", "law", "factors"),
                f"{len(self.factors)} factors for {len(self.depths)} depths",
                "one factor for each depth",
                f"factors = {[2.0 * (number + 1) for number in range(len(self.depths))]}",
                (("contact", "law", "depths"),),
            )
        if list(self.depths) != sorted(set(self.depths)):
            yield Fault(
                ("contact", "law", "depths"),
                f"{list(self.depths)} m",
                "depths that ascend, each once",
                f"depths = {sorted(set(self.depths))}",
            )
