"""Which contact formulations there are: the union of their tables."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from gapbeam.solver.contact.formulations.augmented_lagrangian import AugmentedLagrangian
from gapbeam.solver.contact.formulations.nitsche_method import NitscheMethod
from gapbeam.solver.contact.formulations.penalty import Penalty
from gapbeam.solver.contact.formulations.unilateral import Unilateral

Formulation = Annotated[
    Penalty | NitscheMethod | Unilateral | AugmentedLagrangian,
    Field(discriminator="type"),
]
