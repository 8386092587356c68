"""The computed time step: the frequencies of interest, the contact, and records that fall on whole steps."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from math import ceil, gcd, pi, sqrt
from operator import itemgetter

from solver.case import Case, Exciter, Ramped
from solver.case_file.consistency import contradictions_in
from solver.case_file.faults import CaseError
from solver.case_tables.recorded import Recorded
from solver.contact_scales import contact_duration
from solver.defaults import Default, overhang_frequency
from solver.loads.recorded import MOST_POWER, signal_of

STEPS_PER_PERIOD = 50  # of the highest frequency of interest
PERIOD_ERROR = (2.0 * pi / STEPS_PER_PERIOD) ** 2 / 12.0  # of the midpoint rule at the frequency of interest
STEPS_PER_CONTACT = 20  # for peak forces
RIGID_RATIO = 10.0  # of contact frequency to frequency of interest; a stiffer contact is rigid on that time scale
FORCING_HARMONICS = 5.0  # of the forcing that are of interest
MODAL_SHARE = 0.25  # of the mass of a beam, that its bending modes have at its tip
ON_SPRING = "an exciter and a quarter of the beam on its spring"
SHORTEST_SHARE = 0.25  # of the step that would do; what would ask for a shorter one is not made a whole number of steps


def forcing_frequencies(case: Case) -> list[float]:
    """Return the frequencies of all harmonic loads, Hz, each once, in ascending order; none beside a recorded load."""
    if any(isinstance(load, Recorded) for load in case.load):
        return []
    return sorted({load.frequency for load in case.load if isinstance(load, Ramped)})


def frequency_of_interest(case: Case) -> tuple[float, str]:
    """Return the highest frequency of interest, Hz, and where it comes from.

    `time.frequency`, or the largest of 5 times the highest forcing frequency, the frequency below which 99 % of the
    power of a record lie, the second bending frequency of the overhang clamped at the support, and the frequency of an
    exciter with a quarter of the beam on its spring: the mass of a bending mode of a cantilever at its tip.
    """
    if case.time.frequency is not None:
        return case.time.frequency, "time.frequency"
    harmonic = max((load.frequency for load in case.load if isinstance(load, Ramped)), default=0.0)
    candidates = [
        (overhang_frequency(case, 2), "the second bending frequency of the clamped overhang"),
        *((_exciter_frequency(case, load), ON_SPRING) for load in case.load if isinstance(load, Exciter)),
        (FORCING_HARMONICS * harmonic, f"{FORCING_HARMONICS:g} times the highest forcing frequency"),
    ]
    for load in case.load:
        if isinstance(load, Recorded):
            origin = f"below which {MOST_POWER:.0%} of the power of the load {load.name} lie"
            candidates.append((signal_of(load).content.below(MOST_POWER), origin))
    return max(candidates, key=itemgetter(0))


def _exciter_frequency(case: Case, exciter: Exciter) -> float:
    mass = case.material.density * case.beam.length * case.beam.width * case.beam.thickness
    return sqrt(exciter.stiffness / (exciter.mass + MODAL_SHARE * mass)) / (2.0 * pi)


def time_step(case: Case, stiffness: float) -> Default:
    """Return the time step that `time.step = "auto"` asks for.

        dt = 1 / (50 f),    and at most T_c / 20 where 1 / (2 T_c) < 10 f

    f is the highest frequency of interest, T_c the duration of an impact. A contact whose frequency is ten times f is
    rigid on the time scale of interest: its own duration is then left to `time.adaptive`. The step is rounded down so
    that output intervals, where none is given the forcing periods, and the end are whole numbers of steps; a period
    or an end that would ask for less than a quarter of the step is left between steps.

    Args:
        case: The case.
        stiffness: K of the contact, given or computed, Pa/m^n.

    Source: at n steps in a period the midpoint rule makes it (2 pi / n)^2 / 12 too long, 0.13 % at 50; 20 steps in a
    contact are the least that peak forces ask for.
    """
    frequency, origin = frequency_of_interest(case)
    longest, duration = 1.0 / (STEPS_PER_PERIOD * frequency), contact_duration(case, stiffness)
    reason = f"{STEPS_PER_PERIOD} steps in a period of {frequency:.4g} Hz, {origin}"
    rigid = 0.5 / duration >= RIGID_RATIO * frequency
    if rigid:
        reason += (
            f"; contacts of {duration:.2g} s are rigid on that time scale and not resolved, "
            "for which there is time.adaptive"
        )
    elif duration / STEPS_PER_CONTACT < longest:
        longest = duration / STEPS_PER_CONTACT
        reason = f"{STEPS_PER_CONTACT} steps in a contact of {duration:.3g} s, in reach of {frequency:.4g} Hz, {origin}"
    value, whole = rounded_down(case, longest)
    if whole:
        reason += f"; whole steps in {', '.join(whole)}"
    consequence = (
        f"half: twice the time, periods at {frequency:.4g} Hz {PERIOD_ERROR / 4:.2%} too long; "
        f"double: half the time, {PERIOD_ERROR * 4:.1%} too long"
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
    if faults:
        raise CaseError(f'the case with time.step = "auto", {chosen.value:.4g} s: {chosen.reason},', faults)
    return resolved, (chosen,)


def rounded_down(case: Case, longest: float) -> tuple[float, list[str]]:
    """Return the largest step up to a length of which the spans of a case are whole multiples, s, and their names.

    Output intervals always are; the others as long as the step stays above a quarter of what would do.
    """
    longest = min(longest, case.time.end)
    unit, whole = Fraction(0), list[str]()
    for name, span, wanted in _spans(case):
        smaller = _divisor(unit, span)
        if wanted or smaller >= SHORTEST_SHARE * longest:
            unit = smaller
            whole.append(name)
    if not whole:
        return longest, whole
    return float(unit / ceil(unit / _exact(longest))), whole


def _spans(case: Case) -> Iterator[tuple[str, Fraction, bool]]:
    """Yield name, length in s, and whether it has to be a whole number of steps."""
    given = [name for name in ("history_interval", "fields_interval") if getattr(case.output, name) is not None]
    for name in given:
        yield f"output.{name}", _exact(getattr(case.output, name)), True
    if not given:
        for frequency in forcing_frequencies(case):
            yield f"the period of {frequency:g} Hz", 1 / _exact(frequency), False
    yield "time.end", _exact(case.time.end), False


def _exact(number: float) -> Fraction:
    """Return a number as it is written in decimals."""
    return Fraction(repr(float(number)))


def _divisor(one: Fraction, other: Fraction) -> Fraction:
    """Return the largest number of which both are whole multiples."""
    denominators = one.denominator * other.denominator
    return Fraction(gcd(one.numerator * other.denominator, other.numerator * one.denominator), denominators)
