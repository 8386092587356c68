"""The table [time]: span, step and scheme."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from gapbeam.solver.integrators.scheme_choice import USUAL, Scheme
from gapbeam.solver.table import Positive, Switch, Table, Whole, named


class Time(Table):
    """Span, step and scheme."""

    end: Positive = Field(description="end of the run, s", examples=[0.6])
    step: Literal["auto"] | Positive = Field(
        description="time step, s; auto: from the highest frequency of interest and the contact", examples=[1.0e-4]
    )
    frequency: Positive | None = Field(
        default=None,
        description="highest frequency of interest, Hz; default 5 times the highest of the loads, or the "
        "second bending frequency of the overhang if larger",
    )
    scheme: Annotated[Scheme, BeforeValidator(named)] = Field(
        default=USUAL,
        description="time integration: a name, or a table with the type and its keys",
    )
    adaptive: Switch = Field(
        default=False,
        description="halve steps in which a face opens or closes, or the scheme changes the energy",
    )
    max_halvings: Whole = Field(
        default=6,
        ge=0,
        le=20,
        description="most halvings of a step that does not converge, or of an adaptive one",
    )
    max_iterations: Whole = Field(
        default=60, ge=1, le=1000, description="largest number of iterations of one contact solve"
    )
