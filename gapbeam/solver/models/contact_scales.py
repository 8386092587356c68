"""Scales of the contact: its linearized stiffness and the duration of an impact."""

from __future__ import annotations

from math import pi, sqrt

from gapbeam.solver.case.case import Case
from gapbeam.solver.case.computed_defaults import Default, lightest_supported
from gapbeam.solver.case.wear_table import Wear
from gapbeam.solver.contact.laws.chosen_law import ChosenLaw

DEPTH_RATIO = 0.01  # penetration over clearance at which a law with an exponent is compared with a linear one
OF_THICKNESS = 1.0e-4  # where there is no clearance


def compared_depth(case: Case) -> float:
    """Return the penetration at which laws with an exponent are taken as linear, m: 1 % of the clearance.

    Without clearance a ten-thousandth of the thickness.
    """
    clearance = abs(case.layout.clearance)
    return DEPTH_RATIO * clearance if clearance > 0.0 else OF_THICKNESS * case.profile.thinnest


def slope_factor(case: Case, law: ChosenLaw | None = None) -> float:
    """Return the slope of a law over its stiffness K, n d^(n-1) at `compared_depth`, m^(n-1); 1 for n = 1.

    Args:
        case: The case.
        law: The law; None: that of [contact].
    """
    exponent = (law or case.contact.law).spring_exponent
    return float(exponent * compared_depth(case) ** (exponent - 1.0))


def compared_stiffness(case: Case, stiffness: float, law: ChosenLaw) -> float:
    """Return K of the law of [contact] that has the slope of another law at `compared_depth`, Pa/m^n.

    Args:
        case: The case.
        stiffness: K of the other law, in its unit.
        law: The other law; with the exponent of that of [contact], its K itself is returned.
    """
    if law.spring_exponent == case.contact.law.spring_exponent:
        return stiffness
    return stiffness * slope_factor(case, law) / slope_factor(case)


def impact_time(case: Case, wear: Wear, stiffness: float) -> Default:
    """Return how much of each contact of a face is its impact, s: given, or the duration of an impact.

    Args:
        case: The case.
        wear: Its table.
        stiffness: K of the contact, Pa/m^n.
    """
    name, unit = "wear.impact_time", "s"
    if wear.impact_time != "auto":
        return Default(name, wear.impact_time, unit, "given in the case")
    reason = "half a period of the supported part of the beam on one face"
    consequence = "half: of longer contacts less is impact and more is sliding or sticking; double: more is impact"
    return Default(name, contact_duration(case, stiffness), unit, reason, consequence)


def contact_duration(case: Case, stiffness: float) -> float:
    """Return the duration of an impact, s: half a period of the supported part of the beam on one face.

        T_c = pi / omega_c,    omega_c^2 = n K d^(n-1) / (density A / width)

    At least: a part of the beam that takes more of its length with it stays longer. The mass of a support that gives
    way makes it shorter: the reduced mass of both counts.

    Args:
        case: The case.
        stiffness: K of the contact, Pa/m^n.
    """
    piece = lightest_supported(case)
    mass = min(one.impact_mass(piece.face_mass, piece.beam.width) for one in case.layout.supports)
    return pi * sqrt(mass / (slope_factor(case) * stiffness))
