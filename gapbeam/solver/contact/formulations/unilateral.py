"""Unilateral contact: the gap is held at zero by a penalty that is rigid beside the body, or exactly by impulses."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from gapbeam.solver.contact.formulations.chosen_formulation import BodyShare, ChosenFormulation

RIGID = 1.0e8  # of E/h: compresses by 1e-8 of what the body does


class Unilateral(ChosenFormulation):
    """Exact unilateral contact: g >= 0, p >= 0, g p = 0."""

    type: Literal["unilateral"] = Field(description="name of the formulation")

    holds_points: ClassVar[bool] = True
    takes_impulses: ClassVar[bool] = True
    computed_stiffness: ClassVar[BodyShare | None] = BodyShare(
        RIGID, "rigid beside the body", "half or double: no change that one could measure"
    )
