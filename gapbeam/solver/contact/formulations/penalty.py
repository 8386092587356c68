"""Penalty: the pressure follows a law of the penetration."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from gapbeam.solver.contact.formulations.chosen_formulation import ChosenFormulation


class Penalty(ChosenFormulation):
    """The law acts on the penetration itself."""

    type: Literal["penalty"] = Field(default="penalty", description="name of the formulation")

    follows_the_law: ClassVar[bool] = True
    takes_stiffness: ClassVar[bool] = True
