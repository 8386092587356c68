"""The table [contact]: formulation, law and their figures."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from solver.case_tables.values import NonNegative, Number, Positive, Table, Whole, named


class Penalty(Table):
    """The law acts on the penetration itself."""

    type: Literal["penalty"] = Field(default="penalty", description="name of the formulation")


class NitscheMethod(Table):
    """Nitsche's method: consistent, the pressure is the stress of the body (Chouly, Hild and Renard 2015)."""

    type: Literal["nitsche"] = Field(description="name of the formulation")
    theta: Literal[1, 0, -1] = Field(default=1, description="1 symmetric, 0 incomplete, -1 skew, no unit")
    factor: Positive = Field(
        default=2.0, description="gamma relative to the largest eigenvalue of the trace problem of each cell, no unit"
    )


class Unilateral(Table):
    """Exact unilateral contact: g >= 0, p >= 0, g p = 0."""

    type: Literal["unilateral"] = Field(description="name of the formulation")


class AugmentedLagrangian(Table):
    """Unilateral contact by multipliers that are updated until nothing penetrates."""

    type: Literal["augmented-lagrangian"] = Field(description="name of the formulation")
    penetration: Positive = Field(
        default=1.0e-4, lt=1, description="largest penetration, relative to that of the penalty alone, no unit"
    )


Formulation = Annotated[
    Penalty | NitscheMethod | Unilateral | AugmentedLagrangian,
    Field(discriminator="type"),
]


class KelvinVoigt(Table):
    """Linear stiffness, with contact.damping or the damping that a restitution asks for."""

    type: Literal["kelvin-voigt"] = Field(default="kelvin-voigt", description="name of the law")
    restitution: Number | None = Field(
        default=None,
        gt=0,
        le=1,
        description="restitution of the supported part as a rigid mass, from which the damping is computed, "
        "no unit; default contact.damping is taken",
        examples=[0.8],
    )


class HuntCrossley(Table):
    """K d^n (1 + chi d'), chi from the restitution by its exact equation and the speed at touch of each point."""

    type: Literal["hunt-crossley"] = Field(description="name of the law")
    exponent: Number = Field(default=1.0, ge=1, le=5, description="n, no unit; 1.5 is Hertz's")
    restitution: Number = Field(gt=0, le=1, description="coefficient of restitution, no unit", examples=[0.8])


class LankaraniNikravesh(Table):
    """K d^n (1 + chi d'), chi = 3 (1 - e^2) / (4 v0): Eq. 2 of Li et al. (2013); returns more than e."""

    type: Literal["lankarani-nikravesh"] = Field(description="name of the law")
    exponent: Number = Field(default=1.5, ge=1, le=5, description="n, no unit; 1.5 is Hertz's")
    restitution: Number = Field(gt=0, le=1, description="coefficient of restitution e, no unit", examples=[0.8])


class AdamsImpact(Table):
    """K d^n + c(d) d', c rising as a smooth step up to a depth: ADAMS's IMPACT function."""

    type: Literal["adams-impact"] = Field(description="name of the law")
    exponent: Number = Field(default=1.5, ge=1, le=5, description="n, no unit")
    damping: NonNegative = Field(
        description="full damping per area (of each of contact.points in N s/m), Pa s/m", examples=[1.0e6]
    )
    full_depth: Positive = Field(description="penetration at which the damping is full, m", examples=[1.0e-5])


Law = Annotated[
    KelvinVoigt | HuntCrossley | LankaraniNikravesh | AdamsImpact,
    Field(discriminator="type"),
]


class Friction(Table):
    """Coulomb friction on base and gland, with a velocity over which it sets in."""

    coefficient: Number = Field(ge=0, le=100, description="coefficient of friction mu, no unit", examples=[0.2])
    slip_velocity: Literal["auto"] | Positive = Field(
        default="auto",
        description="velocity v0 at which the friction has 71 % of its limit, m/s; "
        "auto: 1 % of what the faces slide at when the beam rocks through its clearance",
    )


class Contact(Table):
    """Unilateral contact at base and gland."""

    formulation: Annotated[Formulation, BeforeValidator(named)] = Field(
        default=Penalty(), description="how the gap enters the equations: a name, or a table with the type and its keys"
    )
    law: Annotated[Law, BeforeValidator(named)] = Field(
        default=KelvinVoigt(), description="pressure over penetration: a name, or a table with the type and its keys"
    )
    stiffness: Literal["auto"] | Positive = Field(
        default="auto",
        description="penalty stiffness K per area (of each of contact.points in N/m; Pa/m^n or N/m^n in laws with an "
        "exponent n), Pa/m; auto: from the load, the clearance and the modulus",
    )
    damping: NonNegative = Field(
        default=0.0,
        description="damping of the law kelvin-voigt per area (of each of contact.points in N s/m), Pa s/m",
    )
    points: tuple[Number | tuple[Number, Number], ...] | None = Field(
        default=None,
        max_length=1000,
        description="places of resultant springs, the same at base and gland, each x (over the whole width) or [x, y] "
        "(3D), m; default contact all over the faces",
        examples=[[0.0, 0.05]],
    )
    patch: Literal["auto"] | Positive = Field(
        default="auto",
        description="size along x, and across for [x, y], of the patch that each of contact.points is spread over, "
        "m; auto: a tenth of support.length",
    )
    tension: Literal["clipped", "adhesive"] = Field(
        default="clipped",
        description="may the damper pull the face while it separates? clipped never, adhesive yes",
    )
    mass: Literal["consistent", "redistributed"] = Field(
        default="consistent",
        description="mass of the contact nodes; redistributed: moved into the body, which leaves them massless",
    )
    friction: Friction | None = Field(
        default=None, description="Coulomb friction on both faces, a table; default none: no friction"
    )
    quadrature_degree: Whole | None = Field(
        default=None,
        ge=1,
        le=20,
        description="quadrature degree on the contact faces; default 2*mesh.degree + 2",
    )
    touch_depth: Literal["auto"] | Positive = Field(
        default="auto",
        description="depth over which the damped law is switched on (Newmark and generalized-alpha), m; "
        "auto: 1e-8, at most 1e-4 of the clearance",
    )

    @property
    def stiffness_unit(self) -> str:
        """Unit of `stiffness`."""
        exponent = getattr(self.law, "exponent", 1.0)
        return ("Pa/m" if self.points is None else "N/m") + ("" if exponent == 1.0 else f"^{exponent:g}")

    @property
    def damping_unit(self) -> str:
        """Unit of `damping`, of the contact and of its law."""
        return "Pa s/m" if self.points is None else "N s/m"

    @property
    def rubs(self) -> Friction | None:
        """The friction that acts: none without the table, or with a coefficient of 0."""
        return self.friction if self.friction is not None and self.friction.coefficient > 0.0 else None
