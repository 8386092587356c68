"""Two time schemes that gapbeam does not have, in one file, as somebody would add them.

Wood, Bossak and Zienkiewicz (1981) is of the family of generalized-alpha, so that a kernel marches it. The other is the
midpoint rule with a step of its own, which no kernel knows.
"""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.contact.solve.condensation import Condensed
from gapbeam.solver.integrators.generalized_alpha import AlphaFamily, Weights
from gapbeam.solver.integrators.midpoint import Midpoint
from gapbeam.solver.schema.table import Number
from gapbeam.solver.system.semi_discrete import SemiDiscreteSystem, State, Step


class Bossak(AlphaFamily):
    """Wood, Bossak and Zienkiewicz (1981): the inertia forces of a step are weighted."""

    type: Literal["bossak"] = Field(description="name of the scheme")
    alpha: Number = Field(default=0.1, ge=0, le=0.3, description="weight of the old inertia forces, no unit")

    @property
    def weights(self) -> Weights:
        """Weights of the family."""
        return Weights(-self.alpha, 0.0, 0.25 * (1.0 + self.alpha) ** 2, 0.5 + self.alpha)

    @property
    def creates_energy(self) -> bool:
        """Whether it is close to the trapezoidal rule."""
        return self.alpha < 0.2


class CautiousMidpoint(Midpoint):
    """Midpoint rule that solves the contact with at most ten iterations."""

    type: Literal["cautious-midpoint"] = Field(description="name of the scheme")
    needs_potential: ClassVar[bool] = True
    conserves_energy: ClassVar[bool] = True

    def advance(
        self,
        system: SemiDiscreteSystem,
        condensed: Condensed,
        law: ContactLaw,
        old: State,
        dt: float,
        max_iterations: int = 60,
    ) -> Step:
        """Advance by one step. Collective."""
        return super().advance(system, condensed, law, old, dt, min(max_iterations, 10))
