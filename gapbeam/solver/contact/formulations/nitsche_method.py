"""Nitsche's method; the operator that it assembles stands in `assembly.nitsche_terms`."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from gapbeam.solver.contact.formulations.chosen_formulation import ChosenFormulation, StressTerms
from gapbeam.solver.table import Positive


class NitscheMethod(ChosenFormulation):
    """Nitsche's method: consistent, the pressure is the stress of the body (Chouly, Hild and Renard 2015)."""

    type: Literal["nitsche"] = Field(description="name of the formulation")
    theta: Literal[1, 0, -1] = Field(default=1, description="1 symmetric, 0 incomplete, -1 skew, no unit")
    factor: Positive = Field(
        default=2.0, description="gamma relative to the largest eigenvalue of the trace problem of each cell, no unit"
    )

    @property
    def stress_terms(self) -> StressTerms:
        """The terms with theta and factor."""
        return StressTerms(self.theta, self.factor)

    @property
    def without_potential(self) -> str:
        """Only the symmetric form has a potential."""
        return f"nitsche, theta = {self.theta}" if self.theta != 1 else ""
