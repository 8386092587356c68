"""Time step of a run where none is given: from the frequencies of interest, the contact and the output intervals.

An explicit scheme has a step below its stability limit.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from math import ceil, gcd, pi, sqrt
from operator import itemgetter

from gapbeam.solver.case.case import Case, Wear
from gapbeam.solver.case.checks.all_checks import contradictions_in
from gapbeam.solver.case.computed_defaults import Default, bending_words, lightest_supported, overhang_frequency
from gapbeam.solver.case.solution_tables import RigidModel
from gapbeam.solver.contact.laws.law_tables import ChosenLaw
from gapbeam.solver.integrators.stable_step import SAFETY, StableStep
from gapbeam.solver.integrators.time_scheme import (
    RIGID_RATIO,
    STEPS_PER_CONTACT,
    STEPS_PER_PERIOD,
    is_rigid,
    step_of_period,
)
from gapbeam.solver.loads.load_choice import forcing_frequencies
from gapbeam.solver.messages.errors import CaseError, UserError

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
    """Return the duration of the impact in each contact of a face, s: given, or computed.

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


MODAL_SHARE = 0.25  # of the mass of a beam, that its bending modes have at its tip
SAME = 1.0e-12  # relative: ratios of spans that differ by less are one; multiples of a step differ in the 16th digit
SHORTEST_SHARE = 0.25  # of the step that would do; what would ask for a shorter one is not made a whole number of steps


def frequency_of_interest(case: Case) -> tuple[float, str]:
    """Return the highest frequency of interest, Hz, and where it comes from.

    `time.frequency`, or the largest of those of the loads (5 times the forcing frequency, or the frequency below which
    99 % of the power of a record lie), the second bending frequency of the overhang clamped at the support, and the
    frequency of a quarter of the beam, with the mass of an exciter, on its spring: the mass of a bending mode of a
    cantilever at its tip. That of a support body on its spring counts where it is below `RIGID_RATIO` times all of
    these: a stiffer one is rigid.
    """
    bending = overhang_frequency(case, 2), f"the second bending frequency of the {bending_words(case)}"
    return _highest_with(case, [bending])


def _highest_with(case: Case, candidates: list[tuple[float, str]]) -> tuple[float, str]:
    """Return the highest of the given frequencies, of loads and of support bodies, Hz; 0 without any."""
    if case.time.frequency is not None:
        return case.time.frequency, "time.frequency"
    found = [*candidates, (0.0, "")]
    for load in case.load:
        if (added := load.attachment) is not None:
            origin = f"a quarter of the beam on the spring of the load {load.name}"
            moved = added.mass + MODAL_SHARE * case.profile.mass
            found.append((sqrt(added.stiffness / moved) / (2.0 * pi), origin))
    found += [one for load in case.load if (one := load.frequency_of_interest) is not None]
    highest = max(found, key=itemgetter(0))
    bodies = [(one.body.frequency, f"the support {one.name} on its spring") for one in case.layout.supports if one.body]
    return max([highest, *(one for one in bodies if one[0] < RIGID_RATIO * highest[0])], key=itemgetter(0))


def time_step(case: Case, stiffness: float) -> Default:
    """Return the time step that `time.step = "auto"` asks for, by `step_rule`.

    What is not resolved is left to `time.adaptive`. A rigid body does not bend: where a twentieth of its contact is
    longer than its bending asks for, loads and contact alone decide. The step is rounded down so
    that output intervals, where none is given the forcing periods, and the end are whole numbers of steps; a period
    or an end that would ask for less than a quarter of the step is left between steps.

    Args:
        case: The case.
        stiffness: K of the contact, given or computed, Pa/m^n.
    """
    frequency, origin = frequency_of_interest(case)
    longest, duration = step_of_period(frequency), contact_duration(case, stiffness)
    reason = f"{STEPS_PER_PERIOD} steps in a period of {frequency:.4g} Hz, {origin}"
    slowest = duration / STEPS_PER_CONTACT
    if isinstance(case.model, RigidModel) and case.time.frequency is None and slowest > longest:
        frequency, origin = _highest_with(case, [])
        longest = min(slowest, step_of_period(frequency))
        reason = f"{STEPS_PER_PERIOD} steps in a period of {frequency:.4g} Hz, {origin}; the rigid body does not bend"
        if longest == slowest:
            frequency = 0.5 / duration
            reason = f"{STEPS_PER_CONTACT} steps in a contact of {duration:.3g} s; the rigid body does not bend"
    elif is_rigid(duration, frequency):
        reason += (
            f"; contacts of {duration:.2g} s are rigid on that time scale and not resolved, "
            "for which there is time.adaptive"
        )
    elif slowest < longest:
        longest = slowest
        reason = f"{STEPS_PER_CONTACT} steps in a contact of {duration:.3g} s, in reach of {frequency:.4g} Hz, {origin}"
    value, whole = rounded_down(case, longest)
    if whole:
        reason += f"; whole steps in {', '.join(whole)}"
    error = (2.0 * pi * frequency * longest) ** 2 / 12.0  # of the midpoint rule in a period
    consequence = (
        f"half: twice the time, periods at {frequency:.4g} Hz {100.0 * error / 4.0:.2g} % too long; "
        f"double: half the time, {100.0 * error * 4.0:.2g} % too long"
    )
    return Default("time.step", value, "s", reason, consequence)


def with_time_step(case: Case, stiffness: float) -> tuple[Case, tuple[Default, ...]]:
    """Return the case with its step as a number, and the step with its reason where it was computed.

    Args:
        case: The case.
        stiffness: K of the contact, given or computed, Pa/m^n.

    Raises:
        CaseError: The computed step does not go with the rest of the case, such as intervals without a common divisor.
    """
    if case.time.step != "auto":
        return case, ()
    chosen = time_step(case, stiffness)
    resolved = case.model_copy(update={"time": case.time.model_copy(update={"step": chosen.value})})
    faults = [replace(fault, where=".".join(map(str, fault.key))) for fault in contradictions_in(resolved)]
    hint = _common_divisor(case)
    of_step = [fault for fault in faults if fault.key == ("time", "step")]
    if hint and of_step:  # the intervals are whole numbers of the computed step but for rounding: it is far too short
        faults = [replace(fault, hint=hint) for fault in of_step]
    if faults:
        raise CaseError(f'the case with time.step = "auto", {chosen.value:.4g} s: {chosen.reason},', faults)
    return resolved, (chosen,)


def _common_divisor(case: Case) -> str:
    """Return output intervals near those of a case that a step of usual length divides, in words; "" without any."""
    given = {name: getattr(case.output, name) for name in ("history_interval", "fields_interval")}
    given = {name: value for name, value in given.items() if value is not None}
    longest = min([step_of_period(frequency_of_interest(case)[0]), *given.values()])
    step = float(f"{0.9 * longest:.0e}")
    near = [f"{name} = {float(f'{round(value / step) * step:.12g}')!r}" for name, value in given.items()]
    return f"{', '.join(near)}: whole numbers of steps of {step:g} s" if near else ""


def rounded_down(case: Case, longest: float) -> tuple[float, list[str]]:
    """Return the largest step up to a length of which the spans of a case are whole multiples, s, and their names.

    Output intervals always are; the others as long as the step stays above a quarter of what would do.
    """
    longest = min(longest, case.time.end)
    spans = list(_spans(case))
    first = spans[0][1]  # all spans are counted in: no digit depends on the size of a scene
    unit, whole = Fraction(0), list[str]()
    for name, span, wanted in spans:
        smaller = _divisor(unit, _ratio(span / first))
        if wanted or smaller >= SHORTEST_SHARE * longest / first:
            unit = smaller
            whole.append(name)
    if not whole:
        return longest, whole
    step = unit / ceil(unit / _ratio(longest / first))
    return first * step.numerator / step.denominator, whole


def _spans(case: Case) -> Iterator[tuple[str, float, bool]]:
    """Yield name, length in s, and whether it has to be a whole number of steps."""
    given = [name for name in ("history_interval", "fields_interval") if getattr(case.output, name) is not None]
    for name in given:
        yield f"output.{name}", getattr(case.output, name), True
    if not given:
        for frequency in forcing_frequencies(case.load):
            yield f"the period of {frequency:g} Hz", 1.0 / frequency, False
    yield "time.end", case.time.end, False


def _ratio(number: float) -> Fraction:
    """Return the simplest fraction that a ratio of two spans may stand for, round-off taken away."""
    exact, most = Fraction(number), 1
    while True:
        simple = exact.limit_denominator(most)
        if abs(simple - exact) <= SAME * exact:
            return simple
        most *= 10


def _divisor(one: Fraction, other: Fraction) -> Fraction:
    """Return the largest number of which both are whole multiples."""
    denominators = one.denominator * other.denominator
    return Fraction(gcd(one.numerator * other.denominator, other.numerator * one.denominator), denominators)


MUCH_SHORTER = 0.5  # damping that shortens the stable step this much is reported


def with_stable_step(
    asked: Case, case: Case, computed: tuple[Default, ...], limit: StableStep
) -> tuple[Case, tuple[Default, ...]]:
    """Return the case with a step that the explicit scheme can march, and the limit with its reason.

    A computed step is shortened to the limit; a given one is not touched.

    Args:
        asked: The case as it was given.
        case: The case with its step as a number.
        computed: Defaults of the step.
        limit: The largest stable step.

    Raises:
        UserError: The given step is longer than the limit.
    """
    step = case.time.step
    assert step != "auto"
    damped = limit.step < MUCH_SHORTER * limit.undamped
    words = f"; without damping {limit.undamped:g} s, and damping by mass alone costs nothing" if damped else ""
    reason = f"{SAFETY:g} of the stable step; the highest frequency is {limit.frequency:.3g} rad/s{words}"
    limit_row = Default(
        "limit of time.step", limit.step, "s", reason, "half: half the cells, or a contact 4 times stiffer"
    )
    if step <= limit.step:
        return case, (*computed, limit_row)
    if asked.time.step == "auto":
        value, _ = rounded_down(asked, limit.step)
        shortened = case.model_copy(update={"time": case.time.model_copy(update={"step": value})})
        return shortened, (Default("time.step", value, "s", "the limit of the explicit scheme"), limit_row)
    raise UserError(
        f"time.step: {step:g} s, which the scheme {case.time.scheme.type} cannot march; expected at most "
        f"{limit.written} s on this mesh{words}; try time.step = {limit.written}, larger cells, or an implicit "
        'scheme: time.scheme = "discrete-gradient"'
    )
