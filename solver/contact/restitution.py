"""Damping factors from a coefficient of restitution.

Hunt and Crossley's law F = K d^n (1 + chi d') returns a mass that arrives at v0 with e v0, where p = chi v0 solves

    p (1 + e) = ln((1 + p) / (1 - p e)),

whatever K, n and the mass are. Lankarani and Nikravesh (1990) take p = 3 (1 - e^2) / 4, which gives a higher e than
asked for unless e is close to 1.
"""

from __future__ import annotations

from math import expm1, log1p

from scipy.optimize import brentq

NEARLY_ELASTIC = 1.0e-4  # 1 - e, below which both formulas agree to a few 1e-4


def hunt_crossley_product(restitution: float) -> float:
    """Return p = chi v0 for a restitution e in (0, 1], exactly.

    Raises:
        ValueError: e is not in (0, 1]; e = 0 would need infinite damping.
    """
    if not 0.0 < restitution <= 1.0:
        raise ValueError(f"a restitution of {restitution:g} is not in (0, 1]")
    if 1.0 - restitution < NEARLY_ELASTIC:
        return lankarani_nikravesh_product(restitution)

    def excess(y: float) -> float:
        # p e = 1 - exp(-y) keeps 1 - p e positive; p = 0 is a double root of the equation, hence 1 / y^2
        p = -expm1(-y) / restitution
        return (p * (1.0 + restitution) - log1p(p) - y) / (y * y)

    lowest, highest = 1.0e-3 * (1.0 - restitution), (1.0 + restitution) / restitution
    y = brentq(excess, lowest, highest, xtol=1.0e-15, rtol=1.0e-14)
    return -expm1(-float(y)) / restitution


def lankarani_nikravesh_product(restitution: float) -> float:
    """Return p = chi v0 = 3 (1 - e^2) / 4: the paper's Eq. 2."""
    return 0.75 * (1.0 - restitution * restitution)
