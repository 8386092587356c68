"""The table [time]: span, step and scheme."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from solver.case_tables.values import Number, Positive, Switch, Table, Whole, named


class DiscreteGradient(Table):
    """Midpoint rule with the discrete gradient of the contact potential: conserves energy at any step."""

    type: Literal["discrete-gradient"] = Field(default="discrete-gradient", description="name of the scheme")


class ImplicitMidpoint(Table):
    """Midpoint rule with the contact pressure fully implicit: cheap, dissipates at impacts."""

    type: Literal["implicit-midpoint"] = Field(description="name of the scheme")


class Newmark(Table):
    """Newmark (1959); creates energy with stiff contact."""

    type: Literal["newmark"] = Field(description="name of the scheme")
    beta: Number = Field(
        default=0.25, gt=0, le=1, description="weight of the new acceleration in the displacement, no unit"
    )
    gamma: Number = Field(
        default=0.5, ge=0.5, le=1, description="weight of the new acceleration in the velocity, no unit"
    )


class GeneralizedAlpha(Table):
    """Generalized-alpha, Chung and Hulbert (1993)."""

    type: Literal["generalized-alpha"] = Field(description="name of the scheme")
    rho_inf: Number = Field(default=0.5, ge=0, le=1, description="spectral radius at infinite frequency, no unit")


class HHTAlpha(Table):
    """HHT-alpha, Hilber, Hughes and Taylor (1977); creates energy with stiff contact."""

    type: Literal["hht-alpha"] = Field(description="name of the scheme")
    alpha: Number = Field(
        default=0.05, ge=0, le=0.3333333333333333, description="weight of the old forces, no unit; 0 is Newmark's rule"
    )


class MoreauJean(Table):
    """Moreau and Jean's scheme: contact as impulses with a restitution; for the formulation unilateral."""

    type: Literal["moreau-jean"] = Field(description="name of the scheme")
    theta: Number = Field(default=0.5, ge=0.5, le=1, description="weight of the new velocity, no unit")
    restitution: Number = Field(default=0.0, ge=0, le=1, description="coefficient of restitution, no unit")


class CentralDifference(Table):
    """Central difference with a lumped mass matrix: explicit, stable only with tiny steps, which are enforced."""

    type: Literal["central-difference"] = Field(description="name of the scheme")


Scheme = Annotated[
    DiscreteGradient | ImplicitMidpoint | Newmark | HHTAlpha | GeneralizedAlpha | MoreauJean | CentralDifference,
    Field(discriminator="type"),
]


class Time(Table):
    """Span, step and scheme."""

    end: Positive = Field(description="end of the run, s", examples=[0.6])
    step: Literal["auto"] | Positive = Field(
        description="time step, s; auto: from the highest frequency of interest and the contact", examples=[1.0e-4]
    )
    frequency: Positive | None = Field(
        default=None,
        description="highest frequency of interest, Hz; default the larger of 5 times the highest forcing frequency "
        "and the second bending frequency of the overhang",
    )
    scheme: Annotated[Scheme, BeforeValidator(named)] = Field(
        default=DiscreteGradient(),
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
        description="how often a step that does not converge is halved, and how often an adaptive one",
    )
    max_iterations: Whole = Field(
        default=60, ge=1, le=1000, description="largest number of iterations of one contact solve"
    )
