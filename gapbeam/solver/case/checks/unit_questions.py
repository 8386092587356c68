"""Values that look as if they were in another unit, with the question whether they are.

A question is asked where a value is beyond what is usual, or beside another value cannot be meant; it is never a fault:
cases of unusual size and material are allowed.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from gapbeam.solver.case.case import Case
from gapbeam.solver.case.segment_table import Segment
from gapbeam.solver.supports.layout import keyed
from gapbeam.solver.wording.short_words import apart, exceeds


class UsualRange(NamedTuple):
    """Usual range of a key.

    Attributes:
        table: Table of the key.
        key: The key.
        least: Smallest usual value, SI.
        most: Largest usual value, SI.
        unit: Its unit, and which it is not.
        slips: Other units that it may be in, each with its size in SI; the first that gives a usual value is asked
            about.
    """

    table: str
    key: str
    least: float
    most: float
    unit: str
    slips: tuple[tuple[str, float], ...]


MOST_SECTION = 10.0  # m
LENGTHS = (("mm", 1e-3), ("um", 1e-6))
USUAL = (
    UsualRange("beam", "length", 1e-3, 100.0, "m, not mm", LENGTHS),
    UsualRange("beam", "thickness", 1e-5, MOST_SECTION, "m, not mm", LENGTHS),
    UsualRange("beam", "width", 1e-5, MOST_SECTION, "m, not mm", LENGTHS),
    UsualRange("material", "young_modulus", 1e5, 2e12, "Pa, not GPa: steel has 2.1e11", (("GPa", 1e9), ("MPa", 1e6))),
    UsualRange("material", "density", 10.0, 25e3, "kg/m^3: steel has 7850", (("g/cm^3", 1e3), ("t/mm^3", 1e12))),
)
STIFF = 1e8  # Pa: what a modulus in GPa or MPa is at least once it is in Pa
HEAVY, SOFT = 2500.0, 1e9  # kg/m^3 and Pa: no solid material is so dense and so soft
LEAST_YIELD = 1e5  # Pa
SLOW = 1.0  # Hz
MUCH_DAMPING = 0.5  # of critical


def unit_questions(case: Case) -> Iterator[str]:
    """Yield values that look like another unit, one line each."""
    for usual in USUAL:
        value = getattr(getattr(case, usual.table), usual.key)
        yield from _asked(f"[{usual.table}]", usual, value)
        segments: tuple[Segment, ...] = case.segment
        for number, segment in enumerate(segments, 1):
            own = getattr(segment, usual.key, None)
            if usual.key != "length" and own is not None:
                yield from _asked(f'[[segment]] number {number} (name "{segment.name}")', usual, own)
    yield from _shape(case)
    yield from _material(case)
    yield from _clearances(case)
    yield from _damping(case)
    yield from _frequencies(case)


def _asked(place: str, usual: UsualRange, value: float) -> Iterator[str]:
    if not usual.least <= value <= usual.most:
        words = f"{place} {usual.key} = {value:g} is unusual; the unit is {usual.unit}"
        least = STIFF if usual.key == "young_modulus" else usual.least
        found = next(((unit, size * value) for unit, size in usual.slips if least <= size * value <= usual.most), None)
        unit = usual.unit.partition(",")[0].partition(":")[0]
        yield words if found is None else f"{words}; is it in {found[0]}, {_si(found[1])} {unit}?"


def _shape(case: Case) -> Iterator[str]:
    """Ask about a section that is larger than the beam is long."""
    for key in ("thickness", "width"):
        value = getattr(case.beam, key)
        if exceeds(value, case.beam.length) and value <= MOST_SECTION:  # what is larger is unusual by itself
            found, length = apart(value, case.beam.length)
            words = f"is more than the length, {length} m: is it in mm, {_si(1e-3 * value)} m?"
            yield f"[beam] {key} = {found} {words}"


def _material(case: Case) -> Iterator[str]:
    """Ask about a modulus too small for the density, and a yield stress too small for any material."""
    material = case.material
    if material.density >= HEAVY and 1e5 <= material.young_modulus < SOFT:
        yield (
            f"[material] young_modulus = {material.young_modulus:g} is less than any material of the density "
            f"{material.density:g} kg/m^3 has: is it in MPa, {_si(1e6 * material.young_modulus)} Pa?"
        )
    stress = material.yield_stress
    if stress is not None and stress < LEAST_YIELD:
        yield f"[material] yield_stress = {stress:g} is unusual; the unit is Pa: is it in MPa, {_si(1e6 * stress)} Pa?"


def _clearances(case: Case) -> Iterator[str]:
    """Ask about play larger than the section; of several supports about the first."""
    large = []
    for key, support in keyed(case.support):
        thickness = case.profile.at(0.5 * (support.start + support.end)).beam.thickness
        if exceeds(abs(support.clearance), thickness):
            large.append((key, support, thickness))
    for key, support, thickness in large[:1]:
        found, size = apart(support.clearance, thickness)
        place = "[support]" if len(key) == 1 else f'[[support]] number {int(key[1]) + 1} (name "{support.name}")'
        place += f", and {len(large) - 1} after it:" if large[1:] else ""
        yield (
            f"{place} clearance = {found} is more than the thickness of the beam, {size} m: "
            f"is it in mm, {_si(1e-3 * support.clearance)} m?"
        )


def _damping(case: Case) -> Iterator[str]:
    """Ask about half of the critical damping and more."""
    damping = case.damping
    for key, values in (("ratios", damping.ratios or ()), ("ratio", (damping.ratio,) if damping.ratio else ())):
        largest = max(values, default=0.0)
        if largest >= MUCH_DAMPING:
            yield f"[damping] {key}: {largest:g} of critical damping is unusual: is it in %, {_si(1e-2 * largest)}?"


def _frequencies(case: Case) -> Iterator[str]:
    """Ask about slow loads of which the run has no whole period; short runs with fast loads are usual."""
    for number, load in enumerate(case.load, 1):
        frequency = load.forcing_frequency
        if frequency is not None and frequency <= SLOW and frequency * case.time.end < 1.0 - 1e-9:
            period, end = apart(1.0 / frequency, case.time.end)
            yield (
                f'[[load]] number {number} (name "{load.name}") frequency = {frequency:g}: its period, '
                f"{period} s, is longer than the run, {end} s: is it in kHz, "
                f"{_si(1e3 * frequency)} Hz, or time.end too short?"
            )


def _si(value: float) -> str:
    """Return a number in SI units."""
    return f"{value:.6g}"
