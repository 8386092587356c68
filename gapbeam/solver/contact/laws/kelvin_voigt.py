"""Kelvin and Voigt's law: a linear spring and a constant damper, p = K d + c d'; p jumps at touch.

A mass m on such a contact is a damped oscillator for the time of the contact, with zeta = c / (2 sqrt(K m)) and
s = sqrt(1 - zeta^2). Clipped, it leaves when the force is zero; if the face may pull, when d is zero again. It arrives
at v0 and leaves with e v0:

    clipped    e = exp(-(zeta / s) (pi - 2 asin zeta)) = exp(-2 (zeta / s) acos zeta),
    adhesive   e = exp(-pi zeta / s).

Clipped, zeta may exceed 1: acos becomes acosh and s = sqrt(zeta^2 - 1), with e = exp(-2) at zeta = 1.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import asin, asinh, exp, hypot, log, pi, sqrt
from typing import ClassVar, Literal

from pydantic import Field
from scipy.optimize import brentq

from gapbeam.solver.contact.formulations.chosen_formulation import ChosenFormulation
from gapbeam.solver.contact.laws.chosen_law import ChosenLaw, ComputedDamping
from gapbeam.solver.contact.laws.damper import DampedPoint, Damper, per_area
from gapbeam.solver.faults import Fault
from gapbeam.solver.jit import compiled_in_order
from gapbeam.solver.system.operators import Array
from gapbeam.solver.table import Number


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

    @property
    def dissipates(self) -> bool:
        """Whether a restitution below 1 is asked for."""
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
    """Return c(d) = c, its slope and C(d) = c d, for d > 0; the coefficient is c, Pa s/m."""
    return at.coefficient, 0.0, at.coefficient * depth


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
    return float(brentq(lambda zeta: _decay(zeta) - lost, 0.0, exp(0.5 * lost), xtol=1.0e-300, rtol=1.0e-14))


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
