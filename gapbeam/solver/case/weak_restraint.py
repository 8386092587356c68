"""Weak restraint: springs on motions that nothing else may hold, too soft to change the results.

A motion that joints hold has none. Otherwise a spring is a share of the beam's own stiffness along its axis,

    k = 1e-6 (E A / L),    at most (2 pi 0.1 f)^2 m

with f of `overhang_frequency` and the mass m of the beam. The axial springs act on the faces, at h/2 from the axis, so
that they resist pitch as well: there the limit is what turns the beam back, in its play and by the tilt and offset of
its supports, with 1e-4 of the moment M of the loads,

    k (h/2)^2 a <= 1e-4 M,    a = largest clearance / length of a support + tilt + difference of offsets / reach,

but 1e-11 E A / L at least, which round-off does not hide. Friction holds the beam as well: then 1e-11 E A / L is left
for what is at rest, and sliding and rolling do not feel it; unless the seat, which knows no friction, needs more.
"""

from __future__ import annotations

from math import inf, pi

import numpy as np

from gapbeam.solver.attachments.attachment_tables import bending_rank, holds_motion
from gapbeam.solver.attachments.mean_motion import SIDEWAYS
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.computed_defaults import Default, overhang_frequency, support_reaction
from gapbeam.solver.loads.load_choice import Load

SHARE = 1.0e-6  # of E A / L
UNDER_FRICTION = 1.0e-11  # of E A / L
LEAST = 1.0e-11  # of E A / L: what round-off leaves of a spring
OF_LOADS = 1.0e-4  # of their moment: what may turn the beam back
OF_FREQUENCY = 0.1  # of the lowest bending frequency: frequency of the rigid beam on the restraint
AXIAL, LATERAL = 0, 1
RANK_OF_A_PLANE = 2


def axial_restraint(case: Case) -> Default:
    """Return the stiffness of the restraint along the beam, N/m: given, computed, or 0 where a joint holds it."""
    return _restraint(case, "axial", holds_motion(case.joint, "axial"), AXIAL)


def lateral_restraint(case: Case) -> Default:
    """Return the stiffness of the restraint across the bending plane, N/m; it keeps from swaying, yaw and twist."""
    held = bending_rank(case.joint, held_only=False, plane=SIDEWAYS) == RANK_OF_A_PLANE
    return _restraint(case, "lateral", held and holds_motion(case.joint, "twist"), LATERAL)


def twist_restraint(case: Case, radius: float) -> float:
    """Return the spring against twist of a round beam in holes, N m/rad: the lateral restraint at its radius, m."""
    return _restraint(case, "lateral", holds_motion(case.joint, "twist"), LATERAL).value * radius * radius


def _restraint(case: Case, name: str, held: bool, axis: int) -> Default:
    key, given = f"restraint.{name}", getattr(case.restraint, name)
    if given != "auto":
        return Default(key, given, "N/m", "given in the case")
    if held:
        return Default(key, 0.0, "N/m", "joints hold the beam")
    profile = case.profile
    own = min(one.material.young_modulus * one.beam.area for one in profile.pieces) / case.beam.length
    if case.contact.rubs is not None and not _pulled(case, axis):
        return Default(key, UNDER_FRICTION * own, "N/m", f"{UNDER_FRICTION:g} E A / L: friction holds the beam")
    slow = (2.0 * pi * OF_FREQUENCY * overhang_frequency(case)) ** 2 * profile.mass
    turned = max(_by_pitch(case), LEAST * own) if axis == AXIAL else inf
    if turned < min(slow, SHARE * own):
        return Default(key, turned, "N/m", "the beam pitches in its supports as if it was free")
    if slow < SHARE * own:
        return Default(key, slow, "N/m", f"the rigid beam on it has {OF_FREQUENCY:g} of its lowest bending frequency")
    return Default(key, SHARE * own, "N/m", f"{SHARE:g} E A / L")


def _by_pitch(case: Case) -> float:
    """Return the stiffness along the faces that turns the beam back with a small share of the moment of the loads, N/m.

    It is infinite where there are no loads, or nothing to pitch by.
    """
    layout, supports = case.layout, case.layout.supports
    moment = support_reaction(case) * layout.reach
    aside = sum(np.ptp([getattr(one, key) for one in supports]) for key in ("offset", "lateral")) / layout.reach
    angle = layout.steepest + max(abs(one.tilt) for one in supports) + aside
    lever = 0.5 * max(piece.beam.thickness for piece in case.profile.pieces)
    return OF_LOADS * moment / (lever * lever * angle) if moment > 0.0 and angle > 0.0 else inf


def _pulled(case: Case, axis: int) -> bool:
    """Return whether forces at rest pull the beam along an axis, or turn it, before friction is there."""
    aside = axis == LATERAL and any(one.away[1] != 0.0 for one in case.mass)
    return aside or any(load.may_rest and _along(load, axis, case.mesh.dimension) for load in case.load)


def _along(load: Load, axis: int, dimension: int) -> bool:
    direction = getattr(load, "direction", None)
    return direction is not None and axis < dimension - 1 and direction[axis] != 0.0
