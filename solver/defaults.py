"""Defaults that are computed, each with the reason that is printed beside it."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, sqrt

from solver.case import BaseMotion, Case, Gravity, HarmonicForce
from solver.case_tables.contact import AugmentedLagrangian, Unilateral

WANTED_RATIO = 0.01  # penetration over clearance
IMPACT = 10.0  # times the static reaction: what impacts of a rattling beam press with
SOFTEST_CONSERVING = 5.0  # of E/h: edges that carry the beam give way by about 1 % of its sag
SOFTEST_OTHERS = 0.05
STIFFEST_CONSERVING = 100.0  # of E/h, for schemes that cannot create energy
STIFFEST_OTHERS = 1.0
RIGID = 1.0e8  # of E/h, for unilateral contact: compresses by 1e-8 of what the body does
AUGMENTED = 10.0  # of E/h, for multipliers
SEAT_SOFTNESS = 1.0e-3  # of the contact or the body, whichever is softer
DEEPEST_TOUCH = 1.0e-8  # m
TOUCH_RATIO = 1.0e-4  # of the clearance
CLAMPED_ROOTS = (1.8751040687119611, 4.694091132974174)  # of 1 + cos x cosh x


@dataclass(frozen=True)
class Default:
    """A computed value: key, value, unit, why, and what half and double of it would change."""

    key: str
    value: float
    unit: str
    reason: str
    consequence: str = ""


def overhang_frequency(case: Case, mode: int = 1) -> float:
    """Return the bending frequency 1 or 2 of the overhang clamped at the support, Hz (Euler-Bernoulli)."""
    free = case.beam.length - case.support.length
    radius = case.beam.thickness / sqrt(12.0)
    speed = sqrt(case.material.young_modulus / case.material.density)
    return CLAMPED_ROOTS[mode - 1] ** 2 * radius * speed / (2.0 * pi * free * free)


def support_reaction(case: Case) -> float:
    """Return the force couple at the support by statics of the rigid beam under all load amplitudes, N.

    Every load is turned into its moment about the edge of the base, divided by the support length.
    """
    beam, edge = case.beam, case.support.length
    mass = case.material.density * beam.length * beam.thickness * beam.width
    lever = abs(0.5 * beam.length - edge)
    moment = 0.0
    for load in case.load:
        if isinstance(load, Gravity):
            moment += mass * load.acceleration * lever
        elif isinstance(load, HarmonicForce):
            x = load.point if isinstance(load.point, float | int) else load.point[0]
            moment += abs(load.amplitude) * abs(float(x) - edge)
        elif isinstance(load, BaseMotion):
            power = {"acceleration": 0, "velocity": 1, "displacement": 2}[load.quantity]
            moment += mass * abs(load.amplitude) * (2.0 * pi * load.frequency) ** power * lever
    return moment / edge


def stiffness_unit(case: Case) -> str:
    """Return the unit of the contact stiffness: Pa/m^n."""
    exponent = getattr(case.contact.law, "exponent", 1.0)
    return "Pa/m" if exponent == 1.0 else f"Pa/m^{exponent:g}"


def contact_stiffness(case: Case, cell_length: float) -> Default:
    """Return the penalty stiffness per area, given or computed.

    eps = max(100 p / |clearance|, 5 E / h), at most 100 E / h, for schemes that do not create energy; 0.05 and 1 stand
    in the places of 5 and 100 for the others. Here
    p is ten times the static reaction (impacts) over the width and one cell of length h, plus E |clearance| / thickness
    for an interference fit. The first term aims at a penetration of 1 % of the clearance, the second keeps the contact
    stiff beside the body.

    Args:
        case: The case.
        cell_length: Length h of the facets of the contact faces along the beam, m.
    """
    formulation, unit = case.contact.formulation, stiffness_unit(case)
    if case.contact.stiffness != "auto":
        return Default("contact.stiffness", case.contact.stiffness, unit, "given in the case")
    body_words = f"E = {case.material.young_modulus:.3g} Pa, h = {cell_length:.3g} m"
    body = case.material.young_modulus / cell_length
    if isinstance(formulation, Unilateral):
        reason = f"{RIGID:g} E/h: rigid beside the body ({body_words})"
        consequence = "half or double: no change that one could measure"
        return Default("contact.stiffness", RIGID * body, "Pa/m", reason, consequence)
    if isinstance(formulation, AugmentedLagrangian):
        reason = f"{AUGMENTED:g} E/h: multipliers settle in a few updates ({body_words})"
        consequence = "half: more updates of the multipliers in a step; double: fewer; the same answer"
        return Default("contact.stiffness", AUGMENTED * body, "Pa/m", reason, consequence)
    pressure = IMPACT * support_reaction(case) / (case.beam.width * cell_length)
    clearance = abs(case.support.clearance)
    if case.support.clearance < 0.0:
        pressure += case.material.young_modulus * clearance / case.beam.thickness
    wanted = pressure / (WANTED_RATIO * clearance) if clearance > 0.0 else 0.0
    conserving = case.time.scheme.type in ("discrete-gradient", "implicit-midpoint")
    limit = (STIFFEST_CONSERVING if conserving else STIFFEST_OTHERS) * body
    least = (SOFTEST_CONSERVING if conserving else SOFTEST_OTHERS) * body
    value = min(max(wanted, least), limit)
    if value == limit:
        why = f"{limit / body:g} E/h: the stiffest that the scheme {case.time.scheme.type} is trusted with"
    elif value == wanted:
        why = f"penetration of {WANTED_RATIO:.0%} of the clearance under an impact pressure of {pressure:.3g} Pa"
    else:
        why = f"{least / body:g} E/h: stiff beside the body, and stiffer than a penetration of {WANTED_RATIO:.0%} needs"
    softer, stiffer = ("", "")
    if clearance > 0.0:
        ratio = pressure / (value * clearance)
        softer, stiffer = (f"penetration {share:.2g} % of the clearance, " for share in (200.0 * ratio, 50.0 * ratio))
    consequence = f"half: {softer}contacts 1.4 times longer; double: {stiffer}contacts 1.4 times shorter"
    return Default("contact.stiffness", value, "Pa/m", f"{why} ({body_words})", consequence)


def touch_depth(case: Case) -> float:
    """Return the depth over which the damped law is switched on, m: given, or at most 1e-4 of the clearance."""
    if case.contact.touch_depth != "auto":
        return case.contact.touch_depth
    clearance = abs(case.support.clearance)
    return min(DEEPEST_TOUCH, TOUCH_RATIO * clearance) if clearance > 0.0 else DEEPEST_TOUCH


def seat_springs(case: Case, stiffness: float, cell_length: float, area: float) -> float:
    """Return the springs of the search for the static seat, Pa/m.

    Well below contact and body, so that it contracts fast; and soft enough that the weight moves the beam through
    its clearance in a few iterations.

    Args:
        case: The case.
        stiffness: Of the contact, Pa/m.
        cell_length: h of the contact faces, m.
        area: Of both faces, m^2.
    """
    softest = SEAT_SOFTNESS * min(stiffness, case.material.young_modulus / cell_length)
    mass = case.material.density * case.beam.length * case.beam.width * case.beam.thickness
    weight = mass * sum(load.acceleration for load in case.load if isinstance(load, Gravity))
    travel = max(case.support.clearance, 0.0)
    return min(softest, weight / (area * travel)) if weight > 0.0 and travel > 0.0 else softest


def rayleigh(case: Case) -> tuple[float, float]:
    """Return the coefficients (of M in 1/s, of K in s) of Rayleigh damping.

    zeta(w) = (mass / w + stiffness w) / 2 at two frequencies, or as given.
    """
    damping = case.damping
    if damping.frequencies is None or damping.ratios is None:
        return damping.mass or 0.0, damping.stiffness or 0.0
    (first, second), (low, high) = ((2.0 * pi * f for f in damping.frequencies), damping.ratios)
    scale = 2.0 / (second * second - first * first)
    return scale * first * second * (low * second - high * first), scale * (high * second - low * first)
