"""Table [wear]: measurement of the work of sliding, and the wear that follows from it."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from gapbeam.solver.table import NonNegative, Positive, Table


class Wear(Table):
    """Archard's law: the volume worn is a coefficient times the work of sliding, the integral of N |v_t| over time."""

    coefficient: NonNegative | None = Field(
        default=None,
        description="volume worn per work of sliding (m^3/J), 1/Pa; default none: only the work is measured",
        examples=[2.0e-14],
    )
    area: Positive | None = Field(
        default=None,
        description="worn area of each face, over which the volume is spread, m^2; default none: no depth is given",
        examples=[1.0e-5],
    )
    depth_limit: Positive | None = Field(
        default=None,
        description="depth at which the life of a face ends, for `gapbeam life`, m; default none",
        examples=[0.2e-3],
    )
    growth: Literal["even", "local"] = Field(
        default="even",
        description="growth of gaps in a life: even by the depth of the face, local by the depth of each contact point",
    )
    impact_time: Literal["auto"] | Positive = Field(
        default="auto",
        description="duration of the impact at the start of each contact, s; auto: half a period of the contact",
    )
