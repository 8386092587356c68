"""Defaults that are computed, each with the reason that is printed beside it.

Accelerations are averaged over a time that leaves the ringing of impacts out of them.

In models whose sections keep their shape, an interference fit has a contact stiffness of its own.

A solid rectangle that two planes squeeze by |c| has the pressure p = E' |c| / h, with its thickness h; E' = E where it
may expand sideways, E / (1 - nu^2) in plane strain. A beam of elements and a rigid body are not squeezed. The springs
of their contact stand for the section: each face sinks by |c| / 2, so that the stiffness per area is

    p / (|c| / 2) = 2 E' / h

Source: Hooke's law; the pressure is the same all along except for a thickness or so next to the edges of the support.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from math import log, pi, sqrt
from typing import assert_never

from gapbeam.solver.case.beam_profile import BeamPiece
from gapbeam.solver.case.case import Case, Friction, law_at
from gapbeam.solver.case.solution_tables import BeamModel, RigidModel
from gapbeam.solver.loads.attachments import bending_rank
from gapbeam.solver.loads.load_choice import forcing_frequencies
from gapbeam.solver.loads.places import BodyForce, LineForce, PointForce, SupportAcceleration, SupportWalls
from gapbeam.solver.loads.support_walls import interference
from gapbeam.solver.messages.wording import counted
from gapbeam.solver.sections.section_table import RectangularSection
from gapbeam.solver.supports.support_tables import OneSupport

WANTED_RATIO = 0.01  # penetration over clearance
IMPACT = 10.0  # times the static reaction: what impacts of a rattling beam press with
SEAT_ROUND_OFF = 1.0e-12  # of E / h
SEAT_SHARE = 0.1  # of the bending stiffness of a beam that joints hold
BOTH = 2  # rigid motions in the bending plane
BETWEEN_POINTS = 2.5e-3  # of the diameter: how far a round section falls short of a wall between 32 points around it
SEAT_SOFTNESS = 1.0e-3  # of the contact or the body, whichever is softer
DEEPEST_TOUCH = 1.0e-6  # of the thickness
TOUCH_RATIO = 1.0e-4  # of the clearance
PATCH_SHARE = 0.1  # of the length of the support
SLIP_SHARE = 0.01  # of the speed of sliding
SLOWEST_SLIP = 2.0e-10  # of the speed of waves along the beam
SLOWEST_TOUCH = 2.0e-8  # of that speed
CLAMPED_ROOTS = (1.8751040687119611, 4.694091132974174)  # of 1 + cos x cosh x
PINNED_ROOTS = (pi, 2.0 * pi)  # of sin x
FREE_ROOTS = (4.730040744862704, 7.853204624095838)  # of 1 - cos x cosh x


@dataclass(frozen=True)
class Default:
    """A computed default: key, value, unit, reason, and the effect of half and double of it."""

    key: str
    value: float
    unit: str
    reason: str
    consequence: str = ""


def overhang_frequency(case: Case, mode: int = 1) -> float:
    """Return the bending frequency 1 or 2 of the overhang clamped at the support, Hz (Euler-Bernoulli).

    Of several overhangs and spans between supports, pinned at both ends, that with the lowest frequency is meant.
    A stub that is shorter than the beam is thick does not bend. Then the longest span between contact points is taken,
    pinned at both ends, or, without contact points, the whole beam, free at both ends. Of several segments in it, mean
    mass and mean flexibility are taken. No bending wave is faster than a shear wave: thick parts have the frequency of
    a shear wave of the same length, or of the thickness where that is larger.
    """
    (start, length, roots, _), profile = _bending(case), case.profile
    radius, speed = profile.bending_speed(start, start + length)
    bent = roots[mode - 1] ** 2 * radius * speed / (2.0 * pi * length * length)
    longest = max(length, profile.thickest)
    return min(bent, roots[mode - 1] * profile.shear_speed(start, start + length) / (2.0 * pi * longest))


def bending_words(case: Case) -> str:
    """Return the part of the beam that `overhang_frequency` belongs to, in words."""
    start, length, _, words = _bending(case)
    stepped = len(case.profile.between(start, start + length)) > 1
    return f"{words} of mean mass and flexibility" if stepped else words


def _bending(case: Case) -> tuple[float, float, tuple[float, float], str]:
    """Return the start of the part that bends, its length, m, the roots of its two lowest modes, and it in words."""
    beam, points, layout, profile = case.beam, case.contact.points or (), case.layout, case.profile
    parts = [(start, free, CLAMPED_ROOTS, _beyond(case, start, free)) for start, free in layout.overhangs(beam.length)]
    parts += [(start, span, PINNED_ROOTS, f"pinned span of {span:g} m") for start, span in layout.spans()]
    slender = [part for part in parts if part[1] >= profile.at(part[0] + 0.5 * part[1]).beam.thickness]
    if slender:
        return max(slender, key=lambda part: part[1] / part[2][0])
    places = sorted({float(point if isinstance(point, float | int) else point[0]) for point in points})
    span, start = max(((after - before, before) for before, after in pairwise(places)), default=(0.0, 0.0))
    if span >= profile.at(start + 0.5 * span).beam.thickness:
        return start, span, PINNED_ROOTS, f"pinned span of {span:g} m"
    return 0.0, beam.length, FREE_ROOTS, "free beam"


def _beyond(case: Case, start: float, length: float) -> str:
    """Return the part of a beam beyond a support, in words: what a joint holds is no overhang."""
    held = any(start <= joint.point <= start + length for joint in case.joint)
    return f"cantilever of {length:g} m" if held else "clamped overhang"


def contact_modulus(case: Case) -> float:
    """Return Young's modulus of the body behind the contact faces, the smallest of several, Pa."""
    return min(piece.material.young_modulus for piece in case.profile.supported(case.layout))


def lightest_supported(case: Case) -> BeamPiece:
    """Return the supported piece of the beam with the smallest mass above its contact faces."""
    return min(case.profile.supported(case.layout), key=lambda piece: piece.face_mass)


def support_reaction(case: Case) -> float:
    """Return the force couple at the support by statics of the rigid beam under all load amplitudes, N.

    Every load is turned into its moment about the edge of the base, divided by the support length; with several
    supports, about the farther of their outermost edges, divided by the distance between these.
    """
    layout, mass = case.layout, case.profile.mass
    lever = layout.arm(case.profile.middle)
    moment = 0.0
    for load in case.load:
        match load.place:
            case PointForce(point):
                x = point if isinstance(point, float | int) else point[0]
                added = load.static_force
                force = load.peak + (abs(added.force) if added is not None else 0.0)
                moment += force * layout.arm(float(x))
            case LineForce(places):
                moment += load.peak * layout.arm(0.5 * (places[0] + places[-1]))
            case BodyForce() | SupportAcceleration() | SupportWalls():
                moment += mass * load.peak * lever
            case unknown:
                assert_never(unknown)
    return moment / layout.reach


def stiffness_unit(case: Case) -> str:
    """Return the unit of a contact stiffness per area: Pa/m^n."""
    exponent = case.contact.law.spring_exponent
    return "Pa/m" if exponent == 1.0 else f"Pa/m^{exponent:g}"


def contact_stiffness(case: Case, cell_length: float, face: float) -> Default:
    """Return the penalty stiffness, given or computed: per area, or of each of `contact.points`.

    That of a point is the share of the face that falls to it: the stiffness per area times the area of the face over
    the number of points.

    Args:
        case: The case.
        cell_length: Length h of the facets of the contact faces along the beam, m.
        face: Area of a face, m^2.
    """
    contact = case.contact
    if contact.stiffness != "auto":
        return Default("contact.stiffness", contact.stiffness, contact.stiffness_unit, "given in the case")
    chosen = _stiffness_per_area(case, cell_length)
    if contact.points is None:
        return chosen
    count = len(contact.points)
    reason = f"{chosen.value:.3g} Pa/m on a face of {face:.3g} m^2 over {counted(count, 'point')}; {chosen.reason}"
    consequence = "half: contacts 1.4 times longer; double: 1.4 times shorter; the patch gives way besides"
    return replace(
        chosen, value=chosen.value * face / count, unit=contact.stiffness_unit, reason=reason, consequence=consequence
    )


def _stiffness_per_area(case: Case, cell_length: float) -> Default:
    """Return the computed penalty stiffness per area.

    eps = max(100 p / |clearance|, 5 E / h), at most 100 E / h, for schemes that do not create energy and for massless
    contact nodes in the explicit one; 0.05 and 1 stand in the places of 5 and 100 for the others. Here p is ten
    times the static reaction (impacts) over the width and one cell of length h, plus E |clearance| / thickness for an
    interference fit. The first term aims at a penetration of 1 % of the clearance, the second keeps the contact stiff
    beside the body. A clearance c below the penetration p / (100 E / h) at the stiffest is none: the first term falls
    to 0 with it. Of several supports the one that asks for the stiffest contact counts.

    Args:
        case: The case.
        cell_length: Length h of the facets of the contact faces along the beam, m.
    """
    formulation = case.contact.formulation
    modulus, pieces = contact_modulus(case), case.profile.supported(case.layout)
    body_words = f"E = {modulus:.3g} Pa, h = {cell_length:.3g} m"
    body = modulus / cell_length
    computed = formulation.computed_stiffness
    if computed is not None:
        reason = f"{computed.share:g} E/h: {computed.reason} ({body_words})"
        return Default("contact.stiffness", computed.share * body, "Pa/m", reason, computed.consequence)
    pressure = IMPACT * support_reaction(case) / (min(piece.beam.width for piece in pieces) * cell_length)
    squeezed = interference(case.load, case.layout)
    if squeezed > 0.0:
        pressure += modulus * squeezed / min(piece.beam.thickness for piece in pieces)
    trusted = case.time.scheme.contact_range_on(case.contact.mass == "redistributed")
    limit, least = trusted.stiffest * body, trusted.softest * body
    wanted, clearance = max(
        ((_wanted(pressure, abs(one.clearance), limit, least), abs(one.clearance)) for one in case.layout.supports),
        default=(0.0, 0.0),
    )
    value = min(max(wanted, least), limit)
    if value == limit:
        why = f"{limit / body:g} E/h: the stiffest that the scheme {case.time.scheme.type} is trusted with"
    elif 0.0 < clearance * limit < pressure:
        why = f"{value / body:.3g} E/h: the clearance of {clearance:.3g} m is negligible compared with the penetration"
    elif value == wanted:
        why = f"penetration of {WANTED_RATIO:.0%} of the clearance under an impact pressure of {pressure:.3g} Pa"
    else:
        why = f"{least / body:g} E/h: much stiffer than the beam; penetration stays below {WANTED_RATIO:.0%}"
    softer, stiffer = ("", "")
    if clearance > 0.0:
        ratio = pressure / (value * clearance)
        softer, stiffer = (f"penetration {share:.2g} % of the clearance, " for share in (200.0 * ratio, 50.0 * ratio))
    consequence = f"half: {softer}contacts 1.4 times longer; double: {stiffer}contacts 1.4 times shorter"
    return Default("contact.stiffness", value, "Pa/m", f"{why} ({body_words})", consequence)


def _wanted(pressure: float, clearance: float, limit: float, least: float) -> float:
    """Return the stiffness with a penetration of 1 % of a clearance, or less where the clearance is next to none, Pa/m.

    Args:
        pressure: Pressure of an impact, Pa.
        clearance: Absolute value of the clearance, m.
        limit: The stiffest, Pa/m.
        least: The softest, Pa/m.
    """
    if clearance == 0.0 or pressure == 0.0:
        return 0.0
    share = clearance * limit / pressure
    return pressure / (WANTED_RATIO * clearance) if share >= 1.0 else least + (limit - least) * share


def contact_patch(case: Case) -> Default:
    """Return the size of the patches of `contact.points`, given or a tenth of the length of the support, m.

    The body gives way under a patch over the whole width by 2 ln 2 / (pi E width) more for every halving (Flamant's
    half-plane), and under a patch of a point [x, y] in inverse proportion to its size (Boussinesq's half-space).
    """
    size = case.contact.patch
    if size != "auto":
        return Default("contact.patch", size, "m", "given in the case")
    reason = "a tenth of support.length; under a force on a node the body gives way without bound as cells shrink"
    softest = min(one.material.young_modulus * one.beam.width for one in case.profile.supported(case.layout))
    more = 2.0 * log(2.0) / (pi * softest)
    consequence = f"half: the body gives way {more:.2g} m/N more under each resultant; double: as much less"
    if any(isinstance(point, tuple) for point in case.contact.points or ()):
        consequence = "half: the body gives way about twice as much close to each resultant; double: half as much"
    return Default("contact.patch", PATCH_SHARE * case.layout.length, "m", reason, consequence)


def contact_damping(case: Case, stiffness: float, support: OneSupport | None = None) -> Default | None:
    """Return the damping that the law asks for instead of contact.damping; None: it asks for none.

    It may follow from the mass of the supported part of the beam: density times thickness per area, or the whole mass
    over the number of `contact.points`; with that of a support that gives way, from both.

    Args:
        case: The case.
        stiffness: K of the contact, Pa/m, or N/m of a point.
        support: Support with this contact; None: one that stands still.
    """
    contact, piece = case.contact, lightest_supported(case)
    mass, unit = piece.face_mass, "kg/m^2"
    if support is not None:
        mass = support.impact_mass(mass, piece.beam.width)
    if contact.points is not None:
        mass, unit = mass * piece.beam.width * case.layout.length / len(contact.points), "kg a point"
    law = law_at(contact, support)
    computed = law.computed_damping(stiffness, mass, contact.tension == "adhesive", (unit, contact.unit_with(law)))
    if computed is None:
        return None
    return Default("contact.damping", computed.value, contact.damping_unit, computed.reason, computed.consequence)


def tangent_stiffness(case: Case, face_stiffness: float) -> float:
    """Return the slope n S d^(n-1) of the force S d^n of a face where it carries the static reaction, N/m.

    Args:
        case: The case.
        face_stiffness: S of all points of a face together, N/m^n; S itself for n = 1 or without loads.
    """
    exponent, force = case.contact.law.spring_exponent, support_reaction(case)
    if exponent == 1.0 or force == 0.0:
        return face_stiffness
    depth = (force / face_stiffness) ** (1.0 / exponent)
    return float(exponent * force / depth)


def slip_velocity(case: Case, friction: Friction) -> Default:
    """Return v0 of the regularized friction, given or computed.

    v0 = 0.01 omega (h/2) |c| / a: a hundredth of the speed at which the faces slide, half a thickness h off the axis,
    when the beam rocks by the angle c / a, clearance over support length, at the highest frequency of its loads; at
    least 2e-10 sqrt(E / rho), which is 1e-6 m/s of steel.

    Args:
        case: The case.
        friction: Its table.
    """
    name, unit = "contact.friction.slip_velocity", "m/s"
    if friction.slip_velocity != "auto":
        return Default(name, friction.slip_velocity, unit, "given in the case")
    frequencies = [load.forcing_frequency for load in case.load if load.forcing_frequency is not None]
    frequency = max(frequencies, default=overhang_frequency(case))
    angle = case.layout.steepest
    thickness = max(piece.beam.thickness for piece in case.profile.supported(case.layout))
    sliding = pi * frequency * thickness * angle
    slowest = SLOWEST_SLIP * _wave_speed(case)
    value = max(SLIP_SHARE * sliding, slowest)
    if value > slowest:
        reason = f"{SLIP_SHARE:.0%} of the {sliding:.3g} m/s at which the faces slide, rocking at {frequency:.4g} Hz"
    else:
        reason = f"the least: rocking at {frequency:.4g} Hz slides the faces at {sliding:.3g} m/s only"
    consequence = "half: what sticks creeps half as fast, the solve is harder; double: it creeps twice as fast"
    return Default(name, value, unit, reason, consequence)


def slowest_touch(case: Case) -> float:
    """Return the speed as which slower touches are damped by laws that follow the speed at touch, m/s.

    2e-8 sqrt(E / rho), which is 1e-4 m/s of steel.
    """
    return SLOWEST_TOUCH * _wave_speed(case)


def _wave_speed(case: Case) -> float:
    """Return sqrt(E / rho) of the part of the beam in the first support, m/s."""
    material = case.profile.supported(case.layout)[0].material
    return sqrt(material.young_modulus / material.density)


def touch_depth(case: Case) -> float:
    """Return the depth over which the damped law is switched on, m: given, or a share of clearance and thickness."""
    if case.contact.touch_depth != "auto":
        return case.contact.touch_depth
    clearance, deepest = abs(case.layout.clearance), DEEPEST_TOUCH * case.profile.thinnest
    return min(deepest, TOUCH_RATIO * clearance) if clearance > 0.0 else deepest


def seat_springs(case: Case, stiffness: float, cell_length: float, area: float) -> float:
    """Return the springs of the search for the static seat, Pa/m.

    Well below contact and body, so that it contracts fast; and soft enough that the weight moves the beam through
    its clearance in a few iterations; never so soft that round-off of the body's stiffness hides them. Where joints
    hold the beam, the springs are well below its bending stiffness, E I / L^3.

    Args:
        case: The case.
        stiffness: Stiffness of the contact, Pa/m.
        cell_length: h of the contact faces, m.
        area: Area of both faces, m^2.
    """
    body, profile = contact_modulus(case) / cell_length, case.profile
    if bending_rank(case.joint, held_only=False) == BOTH:
        bending = min(piece.bending for piece in profile.pieces) / case.beam.length**3
        return max(SEAT_SHARE * bending / area, SEAT_ROUND_OFF * body)
    softest = SEAT_SOFTNESS * min(stiffness, body)
    weight = profile.mass * sum(load.weight_acceleration for load in case.load)
    travel = case.layout.widest
    if case.layout.holes:
        aside = max(abs(one.offset) + abs(one.lateral) + one.region.recess for one in case.layout.holes)
        travel += aside + BETWEEN_POINTS * profile.thickest
    wanted = min(softest, weight / (area * travel)) if weight > 0.0 and travel > 0.0 else softest
    return max(wanted, SEAT_ROUND_OFF * body)


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


SHARE = 0.05  # of a period: 2.5 ms at 20 Hz, as Li et al. (2013), section 4.2, smooth


def smoothing_window(case: Case) -> tuple[float, str]:
    """Return the window of the smoothed acceleration, s, and where it comes from.

    `output.smoothing_window`, or a twentieth of the forcing period, or without one of the first bending period; at most
    a twentieth of the run.
    """
    if case.output.smoothing_window is not None:
        return case.output.smoothing_window, "output.smoothing_window"
    frequencies = forcing_frequencies(case.load)
    if len(frequencies) == 1:
        period, words = 1.0 / frequencies[0], "the forcing period"
    else:
        period, words = 1.0 / overhang_frequency(case), f"the first bending period of the {bending_words(case)}"
    if period > case.time.end:
        period, words = case.time.end, "the run"
    return SHARE * period, f"{SHARE:g} of {words}"


FACES = 2  # that squeeze a section


def squeezed_stiffness(case: Case) -> Default | None:
    """Return the stiffness per area of squeezed sections; None: the contact is no interference fit of such a model.

    It asks for a beam model or a rigid one, `contact.stiffness = "auto"` with linear springs over faces, and sections
    that are solid rectangles. Every support that brings no stiffness of its own has an interference.
    """
    contact, mesh = case.contact, case.mesh
    if not isinstance(case.model, BeamModel | RigidModel) or mesh.file is not None:
        return None
    if contact.stiffness != "auto" or contact.points is not None or contact.law.spring_exponent != 1.0:
        return None
    if contact.formulation.computed_stiffness is not None:
        return None
    shared = [one for one in case.layout.supports if not one.brings_stiffness]
    if not shared or any(one.around or len(one.faces) != FACES or one.clearance >= 0.0 for one in shared):
        return None
    pieces = [piece for one in shared for piece in case.profile.between(one.start, one.end)]
    if not all(isinstance(piece.beam.section, RectangularSection) for piece in pieces):
        return None
    plane_strain = mesh.dimension == 2 and mesh.plane == "strain"
    values = []
    for piece in pieces:
        held = 1.0 - piece.material.poisson_ratio**2 if plane_strain else 1.0
        values.append(FACES * piece.material.young_modulus / (held * piece.beam.thickness))
    name = "2 E / ((1 - nu^2) thickness)" if plane_strain else "2 E / thickness"
    reason = f"{name}: sections of this model keep their shape, so its contact is as soft as squeezed sections"
    consequence = "in proportion to it: the contact force of the interference, too"
    return Default("contact.stiffness", min(values), "Pa/m", reason, consequence)
