"""Augmented Lagrangian: a penalty, and multipliers that are updated until nothing penetrates."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from gapbeam.solver.contact.formulations.chosen_formulation import BodyShare, ChosenFormulation
from gapbeam.solver.table import Positive

AUGMENTED = 10.0  # of E/h


class AugmentedLagrangian(ChosenFormulation):
    """Unilateral contact by multipliers that are updated until nothing penetrates."""

    type: Literal["augmented-lagrangian"] = Field(description="name of the formulation")
    penetration: Positive = Field(
        default=1.0e-4, lt=1, description="largest penetration, relative to that of the penalty alone, no unit"
    )

    takes_stiffness: ClassVar[bool] = True
    holds_points: ClassVar[bool] = True
    computed_stiffness: ClassVar[BodyShare | None] = BodyShare(
        AUGMENTED,
        "multipliers settle in a few updates",
        "half: more updates of the multipliers in a step; double: fewer; the same answer",
    )

    @property
    def without_potential(self) -> str:
        """Multipliers have no potential of the penetration."""
        return "augmented-lagrangian"

    @property
    def left_by_multipliers(self) -> float:
        """The penetration asked for."""
        return self.penetration
