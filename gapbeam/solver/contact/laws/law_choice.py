"""Contact laws: their tables, the union of them, and their formulas by number for compiled code.

A law is added by its file, and here by an import, a place in the union, a number and a line of `damping`; one whose
spring is not K d^n also by a number and a line of `own_spring`.

Kelvin and Voigt's law is a linear spring and a constant damper, p = K d + c d'; p jumps at touch.

A mass m on such a contact is a damped oscillator for the time of the contact, with zeta = c / (2 sqrt(K m)) and
s = sqrt(1 - zeta^2). Clipped, it leaves when the force is zero; if the face may pull, when d is zero again. It arrives
at v0 and leaves with e v0:

    clipped    e = exp(-(zeta / s) (pi - 2 asin zeta)) = exp(-2 (zeta / s) acos zeta),
    adhesive   e = exp(-pi zeta / s).

Clipped, zeta may exceed 1: acos becomes acosh and s = sqrt(zeta^2 - 1), with e = exp(-2) at zeta = 1.

Hunt and Crossley's law has damping in proportion to the elastic pressure, p = K d^n (1 + chi d').

A mass that arrives at v0 leaves with e v0, where p = chi v0 solves

    p (1 + e) = ln((1 + p) / (1 - p e)),

whatever K, n and the mass are.

ADAMS's IMPACT function is p = K d^n + c(d) d', c rising as a smooth step up to a depth. Lankarani and Nikravesh's law
is Hunt and Crossley's damping with chi = 3 (1 - e^2) / (4 v0); it gives a higher restitution than asked for unless e is
close to 1.

Source: Hunt and Crossley (1975), J. Appl. Mech. 42, 440-445; Lankarani and Nikravesh (1990), J. Mech. Des. 112,
369-376; Eq. 2 of Li et al. (2013).
"""

from __future__ import annotations

from collections.abc import Iterator
from math import asin, asinh, exp, expm1, hypot, log, log1p, nan, pi, sqrt
from typing import Annotated, ClassVar, Literal

import scipy
from pydantic import Field

from gapbeam.solver.compilation.jit import compiled_in_order
from gapbeam.solver.contact.formulations.formulation_choice import ChosenFormulation
from gapbeam.solver.contact.laws.damper import DampedPoint, Damper, Parameters, per_area
from gapbeam.solver.contact.laws.law_tables import (
    ChosenLaw,
    ComputedDamping,
    ElasticPlastic,
    PiecewiseLinear,
    RestitutionLaw,
)
from gapbeam.solver.contact.laws.springs import power, spring_potential, spring_pressure, spring_slope
from gapbeam.solver.messages.errors import Fault
from gapbeam.solver.schema.table import OF_TYPE, NonNegative, Number, Positive, models_in, type_name
from gapbeam.solver.system.operators import Array


class KelvinVoigt(ChosenLaw):
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

    jumps: ClassVar[bool] = True
    exact: ClassVar[bool] = True
    takes_damping: ClassVar[bool] = True
    rolls: ClassVar[bool] = True

    @property
    def dissipates(self) -> bool:
        """True for a restitution below 1."""
        return self.restitution is not None and self.restitution < 1.0

    def damper(self, damping: float | Array, areas: float | Array) -> Damper:
        """Return the constant damper."""
        return Damper("kelvin-voigt", per_area(damping, areas))

    def computed_damping(
        self, stiffness: float, mass: float, adhesive: bool, units: tuple[str, str]
    ) -> ComputedDamping | None:
        """Return c = 2 zeta sqrt(K m) of the restitution; None: no restitution is asked for."""
        if self.restitution is None:
            return None
        ratio = kelvin_voigt_ratio(self.restitution, adhesive)
        reason = (
            f"restitution {self.restitution:g}, {'adhesive' if adhesive else 'clipped'}: zeta = {ratio:.4g} of the "
            f"supported part as a mass, {mass:.4g} {units[0]}, on K = {stiffness:.4g} {units[1]}"
        )
        half, double = (kelvin_voigt_restitution(share * ratio, adhesive) for share in (0.5, 2.0))
        consequence = f"half: restitution {half:.3g}; double: {double:.3g}"
        return ComputedDamping(2.0 * ratio * sqrt(stiffness * mass), reason, consequence)

    def contradictions(self, formulation: ChosenFormulation, damping: float) -> Iterator[Fault]:
        """The law takes a damping or a restitution, and no restitution where there is no damping."""
        if self.restitution is None:
            return
        if not formulation.follows_the_law:
            yield Fault(
                ("contact", "law", "restitution"),
                f"{self.restitution:g} with the formulation {formulation.type}",
                f"no restitution: the formulation {formulation.type} has no damping",
                'formulation = "penalty" in [contact], or leave restitution out',
                (("contact", "formulation"),),
            )
        elif damping > 0.0:
            yield Fault(
                ("contact", "law", "restitution"),
                f"{self.restitution:g} together with damping = {damping:g}",
                "one of the two: the damping is computed from the restitution",
                "leave damping out",
                (("contact", "damping"),),
            )


@compiled_in_order
def constant_damping(at: DampedPoint, depth: float) -> tuple[float, float, float]:
    """Return c(d) = c d^q, its slope and C(d) = c d^(q + 1) / (q + 1), for d > 0; the coefficient is c, Pa s/m^(q + 1).

    The parameter q is 0 but on lines of contact, `line_law`.
    """
    growth = at.parameters[0]
    if growth == 0.0:
        return at.coefficient, 0.0, at.coefficient * depth
    value = at.coefficient * power(depth, growth)
    return value, growth * value / depth, value * depth / (1.0 + growth)


def kelvin_voigt_ratio(restitution: float, adhesive: bool) -> float:
    """Return the damping ratio zeta = c / (2 sqrt(K m)) for a restitution e in (0, 1], to 1e-13 of itself.

    Args:
        restitution: e.
        adhesive: Whether the damper pulls until the penetration is zero; otherwise the force is clipped at zero.

    Raises:
        ValueError: e is not in (0, 1]; e = 0 would need infinite damping.
    """
    if not 0.0 < restitution <= 1.0:
        raise ValueError(f"a restitution of {restitution:g} is not in (0, 1]")
    lost = -log(restitution)
    if adhesive:
        return lost / hypot(pi, lost)
    if lost == 0.0:
        return 0.0
    # for zeta > 1 the decay exceeds 2 ln zeta, and up to there e > exp(-2)
    return float(
        scipy.optimize.brentq(lambda zeta: _decay(zeta) - lost, 0.0, exp(0.5 * lost), xtol=1.0e-300, rtol=1.0e-14)
    )


def kelvin_voigt_restitution(ratio: float, adhesive: bool) -> float:
    """Return the restitution e of a mass on a Kelvin-Voigt contact with a damping ratio zeta >= 0.

    An adhesive contact of zeta >= 1 never lets go: e = 0.
    """
    if adhesive:
        return exp(-pi * ratio / sqrt(1.0 - ratio * ratio)) if ratio < 1.0 else 0.0
    return exp(-_decay(ratio))


def _decay(ratio: float) -> float:
    """Return 2 (zeta / s) acos zeta, or with acosh for zeta > 1, without cancellation near 1."""
    if ratio == 1.0:
        return 2.0
    half = sqrt(0.5 * abs(1.0 - ratio))
    angle = 2.0 * (asin(half) if ratio < 1.0 else asinh(half))
    return 2.0 * ratio * angle / (sqrt(abs(1.0 - ratio)) * sqrt(1.0 + ratio))


NEARLY_ELASTIC = 1.0e-4  # 1 - e, below which the estimate for e close to 1 is right to a few 1e-4


class HuntCrossley(RestitutionLaw):
    """K d^n (1 + chi d'), chi from the restitution by its exact equation and the speed at touch of each point."""

    type: Literal["hunt-crossley"] = Field(description="name of the law")

    @property
    def touch_product(self) -> float:
        """The product p = chi v0."""
        return hunt_crossley_product(self.restitution)


@compiled_in_order
def proportional_damping(at: DampedPoint, depth: float) -> tuple[float, float, float]:
    """Return c(d) = chi K d^n, its slope and C(d) = chi psi(d), for d > 0; the coefficient is chi, s/m."""
    return (
        at.coefficient * spring_pressure(at.stiffness, at.exponent, depth),
        at.coefficient * spring_slope(at.stiffness, at.exponent, depth),
        at.coefficient * spring_potential(at.stiffness, at.exponent, depth),
    )


def hunt_crossley_product(restitution: float) -> float:
    """Return p = chi v0 for a restitution e in (0, 1], exactly.

    Raises:
        ValueError: e is not in (0, 1]; e = 0 would need infinite damping.
    """
    if not 0.0 < restitution <= 1.0:
        raise ValueError(f"a restitution of {restitution:g} is not in (0, 1]")
    if 1.0 - restitution < NEARLY_ELASTIC:
        return nearly_elastic_product(restitution)

    def excess(y: float) -> float:
        # p e = 1 - exp(-y) keeps 1 - p e positive; p = 0 is a double root of the equation, hence 1 / y^2
        p = -expm1(-y) / restitution
        return (p * (1.0 + restitution) - log1p(p) - y) / (y * y)

    lowest, highest = 1.0e-3 * (1.0 - restitution), (1.0 + restitution) / restitution
    y = scipy.optimize.brentq(excess, lowest, highest, xtol=1.0e-15, rtol=1.0e-14)
    return -expm1(-float(y)) / restitution


def nearly_elastic_product(restitution: float) -> float:
    """Return p = 3 (1 - e^2) / 4, which the equation tends to for e close to 1."""
    return 0.75 * (1.0 - restitution * restitution)


class AdamsImpact(ChosenLaw):
    """K d^n + c(d) d', c rising as a smooth step up to a depth: ADAMS's IMPACT function."""

    type: Literal["adams-impact"] = Field(description="name of the law")
    exponent: Number = Field(default=1.5, ge=1, le=5, description="n, no unit")
    damping: NonNegative = Field(
        description="full damping per area (of each of contact.points in N s/m), Pa s/m", examples=[1.0e6]
    )
    full_depth: Positive = Field(description="penetration at which the damping is full, m", examples=[1.0e-5])

    @property
    def spring_exponent(self) -> float:
        """The exponent n."""
        return self.exponent

    @property
    def dissipates(self) -> bool:
        """True for damping above 0."""
        return self.damping > 0.0

    def damper(self, damping: float | Array, areas: float | Array) -> Damper:
        """Return the damper with c_max and d_max."""
        del damping
        return Damper("adams-impact", per_area(self.damping, areas), (self.full_depth,))


@compiled_in_order
def stepped_damping(at: DampedPoint, depth: float) -> tuple[float, float, float]:
    """Return c(d) = c_max q^2 (3 - 2 q), q = d / d_max up to 1, its slope and its integral, for d > 0.

    C(d) = c_max d_max (q^3 - q^4 / 2) up to d_max, then linear. The coefficient is c_max, Pa s/m; the
    parameter d_max, m.
    """
    full_depth = at.parameters[0]
    q = min(depth / full_depth, 1.0)
    beyond = max(depth - full_depth, 0.0)
    return (
        at.coefficient * q * q * (3.0 - 2.0 * q),
        at.coefficient * 6.0 * q * (1.0 - q) / full_depth,
        at.coefficient * (full_depth * (q * q * q) * (1.0 - 0.5 * q) + beyond),
    )


class LankaraniNikravesh(RestitutionLaw):
    """K d^n (1 + chi d'), chi = 3 (1 - e^2) / (4 v0): Eq. 2 of Li et al. (2013); returns more than e."""

    type: Literal["lankarani-nikravesh"] = Field(description="name of the law")
    exponent: Number = Field(default=1.5, ge=1, le=5, description="n, no unit; 1.5 is Hertz's")
    restitution: Number = Field(gt=0, le=1, description="coefficient of restitution e, no unit", examples=[0.8])

    @property
    def touch_product(self) -> float:
        """The product p = chi v0 = 3 (1 - e^2) / 4."""
        return nearly_elastic_product(self.restitution)


Law = Annotated[
    KelvinVoigt | HuntCrossley | LankaraniNikravesh | AdamsImpact | PiecewiseLinear | ElasticPlastic,
    OF_TYPE,
]
LAWS: dict[str, type[ChosenLaw]] = {type_name(law): law for law in models_in(Law) if issubclass(law, ChosenLaw)}
"""The tables of the laws by their names in a case file."""

UNDAMPED, KELVIN_VOIGT, HUNT_CROSSLEY, ADAMS_IMPACT = range(4)
FORMULAS = {"kelvin-voigt": KELVIN_VOIGT, "hunt-crossley": HUNT_CROSSLEY, "adams-impact": ADAMS_IMPACT}
"""The number of each damping formula, by the name of the law that brings it."""


@compiled_in_order
def damping(formula: int, at: DampedPoint, depth: float) -> tuple[float, float, float]:
    """Return c(d), its slope and its integral C(d) by a formula; not numbers where the formula is not known."""
    if formula == UNDAMPED or depth <= 0.0:
        return 0.0, 0.0, 0.0
    if formula == KELVIN_VOIGT:
        return constant_damping(at, depth)
    if formula == HUNT_CROSSLEY:
        return proportional_damping(at, depth)
    if formula == ADAMS_IMPACT:
        return stepped_damping(at, depth)
    return nan, nan, nan


SPRINGS = {"": 0}
"""The number of each spring formula, by the name of the law that brings it; 0 is K d^n."""


@compiled_in_order
def own_spring(formula: int, at: Parameters, depth: float) -> tuple[float, float, float]:  # noqa: ARG001
    """Return f(d), f'(d) and its integral for d > 0 by a formula; not numbers where the formula is not known."""
    return nan, nan, nan
