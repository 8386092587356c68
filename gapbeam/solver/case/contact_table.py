"""Tables [contact], formulation and law with their figures, and [wear], which measures the work of sliding."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from gapbeam.solver.contact.formulations.formulation_choice import Formulation, Penalty
from gapbeam.solver.contact.laws.chosen_law import ChosenLaw
from gapbeam.solver.contact.laws.law_choice import KelvinVoigt, Law
from gapbeam.solver.table import NonNegative, Number, Positive, Table, Whole, named


class Friction(Table):
    """Coulomb friction on base and gland, with a velocity over which it sets in."""

    coefficient: Number = Field(ge=0, le=100, description="coefficient of friction mu, no unit", examples=[0.2])
    static_coefficient: Number | None = Field(
        default=None,
        ge=0,
        le=100,
        description="coefficient of friction of points that stick, at least that of points that slide, no unit; "
        "default coefficient",
        examples=[0.3],
    )
    slip_velocity: Literal["auto"] | Positive = Field(
        default="auto",
        description="velocity v0 at which friction has 71 % of its limit, m/s; auto: 1 % of the sliding of a "
        "rocking beam",
    )

    def at_support(self, friction: float | None, static_friction: float | None) -> tuple[float, float]:
        """Return the coefficients of sliding and of sticking at a support with its own figures, or None."""
        sliding = self.coefficient if friction is None else friction
        usual = self.static_coefficient if friction is None else friction
        sticking = usual if static_friction is None else static_friction
        return sliding, sliding if sticking is None else sticking


def whole_unit(law: ChosenLaw) -> str:
    """Return the unit of the stiffness of a whole support, or of a point."""
    exponent = law.spring_exponent
    return "N/m" if exponent == 1.0 else f"N/m^{exponent:g}"


class Contact(Table):
    """Unilateral contact at base and gland."""

    formulation: Annotated[Formulation, BeforeValidator(named)] = Field(
        default=Penalty(), description="contact formulation: a name, or a table with the type and its keys"
    )
    law: Annotated[Law, BeforeValidator(named)] = Field(
        default=KelvinVoigt(), description="pressure over penetration: a name, or a table with the type and its keys"
    )
    stiffness: Literal["auto"] | Positive = Field(
        default="auto",
        description="penalty stiffness K per area (of each of contact.points in N/m; with an exponent n "
        "/m^n), Pa/m; auto: from load, clearance and modulus",
    )
    damping: NonNegative = Field(
        default=0.0,
        description="damping of the law kelvin-voigt per area (of each of contact.points in N s/m), Pa s/m",
    )
    points: tuple[Number | tuple[Number, Number], ...] | None = Field(
        default=None,
        max_length=1000,
        description="places of resultant springs at base and gland, each x (over the whole width) or [x, y] "
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
        description="adhesive: the damper may pull while the face separates",
    )
    mass: Literal["consistent", "redistributed"] = Field(
        default="consistent",
        description="mass of the contact nodes; redistributed: moved into the body",
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
        description="depth over which damping sets in (Newmark, generalized-alpha), m; auto: 1e-6 of the "
        "thickness, at most 1e-4 of the clearance",
    )

    @property
    def stiffness_unit(self) -> str:
        """Unit of `stiffness`."""
        return self.unit_with(self.law)

    def unit_with(self, law: ChosenLaw) -> str:
        """Return the unit of the stiffness of a law."""
        exponent = law.spring_exponent
        return ("Pa/m" if self.points is None else "N/m") + ("" if exponent == 1.0 else f"^{exponent:g}")

    @property
    def damping_unit(self) -> str:
        """Unit of `damping`, of the contact and of its law."""
        return "Pa s/m" if self.points is None else "N s/m"

    @property
    def dissipates(self) -> bool:
        """True where contact dissipates energy, by its damping or by its law."""
        return self.damping > 0.0 or self.law.dissipates

    @property
    def rubs(self) -> Friction | None:
        """The friction that acts: none without the table, or with a coefficient of 0."""
        return self.friction if self.friction is not None and self.friction.coefficient > 0.0 else None


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


def advised_scheme(contact: Contact) -> str:
    """Return the implicit scheme that fits a contact: it conserves energy where the contact has a potential."""
    return "implicit-midpoint" if contact.formulation.without_potential else "discrete-gradient"
