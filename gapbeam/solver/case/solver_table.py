"""The table [solver]: how the linear systems of large models are solved."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from gapbeam.solver.table import Positive, Table

Tolerance = Annotated[float, Field(ge=1.0e-13, le=1.0e-4)]


class SolverTable(Table):
    """Linear solver for the effective operator of finite elements; without effect on beams and rigid bodies."""

    effective: Literal["auto", "factor", "iterative"] = Field(
        default="auto",
        description="factor: Cholesky factor by MUMPS; iterative: conjugate gradients with multigrid; auto: a factor "
        "as long as it fits in memory",
    )
    tolerance: Tolerance = Field(
        default=1.0e-9, description="of conjugate gradients: error over solution in the energy norm, no unit"
    )
    columns: Literal["auto", "keep", "drop"] = Field(
        default="auto",
        description="responses of the body to forces at the faces: kept, a step takes one back-substitution; "
        "dropped, two; auto: kept as long as they fit",
    )
    memory: Positive | None = Field(
        default=None, description="memory that auto counts on, over all ranks, GB; default 90 % of what is free"
    )
