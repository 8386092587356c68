"""Hunt and Crossley's law: damping in proportion to the elastic pressure, p = K d^n (1 + chi d').

A mass that arrives at v0 leaves with e v0, where p = chi v0 solves

    p (1 + e) = ln((1 + p) / (1 - p e)),

whatever K, n and the mass are.

Source: Hunt and Crossley (1975), J. Appl. Mech. 42, 440-445.
"""

from __future__ import annotations

from math import expm1, log1p
from typing import Literal

from pydantic import Field
from scipy.optimize import brentq

from gapbeam.solver.contact.laws.damper import DampedPoint
from gapbeam.solver.contact.laws.restitution_law import RestitutionLaw
from gapbeam.solver.contact.laws.springs import spring_potential, spring_pressure, spring_slope
from gapbeam.solver.jit import compiled_in_order

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
    y = brentq(excess, lowest, highest, xtol=1.0e-15, rtol=1.0e-14)
    return -expm1(-float(y)) / restitution


def nearly_elastic_product(restitution: float) -> float:
    """Return p = 3 (1 - e^2) / 4, which the equation tends to for e close to 1."""
    return 0.75 * (1.0 - restitution * restitution)
