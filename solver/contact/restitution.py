"""Damping factors from a coefficient of restitution.

Hunt and Crossley's law F = K d^n (1 + chi d') returns a mass that arrives at v0 with e v0, where p = chi v0 solves

    p (1 + e) = ln((1 + p) / (1 - p e)),

whatever K, n and the mass are. Lankarani and Nikravesh (1990) take p = 3 (1 - e^2) / 4, which gives a higher e than
asked for unless e is close to 1.

A mass m on a Kelvin-Voigt contact F = K d + c d' is a damped oscillator for the time of the contact, with
zeta = c / (2 sqrt(K m)) and s = sqrt(1 - zeta^2). Clipped, it leaves when the force is zero; if the face may pull, when
d is zero again:

    clipped    e = exp(-(zeta / s) (pi - 2 asin zeta)) = exp(-2 (zeta / s) acos zeta),
    adhesive   e = exp(-pi zeta / s).

Clipped, zeta may exceed 1: acos becomes acosh and s = sqrt(zeta^2 - 1), with e = exp(-2) at zeta = 1.
"""

from __future__ import annotations

from math import asin, asinh, exp, expm1, hypot, log, log1p, pi, sqrt

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
