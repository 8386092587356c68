"""Usual values, and questions about those that look like another unit; cases and files of structures share them.

So they do warnings about loads, and about steps that are too long for them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, NamedTuple

from gapbeam.solver.messages.wording import apart, exceeds


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
FEW = 20.0  # steps in a period
LENGTHS = (("mm", 1e-3), ("um", 1e-6))
USUAL = (
    UsualRange("beam", "length", 0.0, 100.0, "m, not mm", LENGTHS),
    UsualRange("beam", "thickness", 0.0, MOST_SECTION, "m, not mm", LENGTHS),
    UsualRange("beam", "width", 0.0, MOST_SECTION, "m, not mm", LENGTHS),
    UsualRange("material", "young_modulus", 1e5, 2e12, "Pa, not GPa: steel has 2.1e11", (("GPa", 1e9), ("MPa", 1e6))),
    UsualRange("material", "density", 10.0, 25e3, "kg/m^3: steel has 7850", (("g/cm^3", 1e3), ("t/mm^3", 1e12))),
)
STIFF = 1e8  # Pa: what a modulus in GPa or MPa is at least once it is in Pa
HEAVY, SOFT = 2500.0, 1e9  # kg/m^3 and Pa: no solid material is so dense and so soft
MUCH_DAMPING = 0.5  # of critical
NAMED = "is its number in the units that the file names?"
MUCH_PLAY = 3.0  # of the thickness: reeds, contact springs and sheets have as much
MOST_WIDTH = 10.0  # of the length: strips of plates are wider than long


def in_si(value: float) -> str:
    """Return a number in SI units."""
    return f"{value:.6g}"


def asked(place: str, usual: UsualRange, value: float, named: bool = False) -> Iterator[str]:
    """Ask about a value beyond its usual range.

    Args:
        place: Table in the message.
        usual: The range.
        value: SI.
        named: Whether the file names its units.
    """
    if not usual.least <= value <= usual.most:
        unit = usual.unit.partition(",")[0].partition(":")[0]
        if named:
            yield f"{place} {usual.key}: {value:g} {unit} is unusual; {NAMED}"
            return
        words = f"{place} {usual.key} = {value:g} is unusual; the unit is {usual.unit}"
        least = STIFF if usual.key == "young_modulus" else usual.least
        found = next(((unit, size * value) for unit, size in usual.slips if least <= size * value <= usual.most), None)
        yield words if found is None else f"{words}; is it in {found[0]}, {in_si(found[1])} {unit}?"


def shape_questions(place: str, length: float, thickness: float, width: float) -> Iterator[str]:
    """Ask about a section that is thicker, or wider by far, than the beam is long, m."""
    for key, value, usual in (("thickness", thickness, 1.0), ("width", width, MOST_WIDTH)):
        if exceeds(value, usual * length) and value <= MOST_SECTION:  # what is larger is unusual by itself
            found, other = apart(value, length)
            words = f"is more than the length, {other} m: is it in mm, {in_si(1e-3 * value)} m?"
            yield f"{place} {key} = {found} {words}"


def material_questions(place: str, young_modulus: float, density: float) -> Iterator[str]:
    """Ask about a modulus too small for the density, Pa and kg/m^3."""
    if density >= HEAVY and 1e5 <= young_modulus < SOFT:
        yield (
            f"{place} young_modulus = {young_modulus:g} is less than any material of the density {density:g} kg/m^3 "
            f"has: is it in MPa, {in_si(1e6 * young_modulus)} Pa?"
        )


def play_question(place: str, clearance: float, thickness: float) -> str:
    """Return the question about play of several thicknesses, m."""
    found, size = apart(clearance, thickness)
    return (
        f"{place} clearance = {found} is several times the thickness of the beam, {size} m: is it in mm, "
        f"{in_si(1e-3 * clearance)} m?"
    )


def damping_questions(place: str, largest: float) -> Iterator[str]:
    """Ask about half of the critical damping and more."""
    if largest >= MUCH_DAMPING:
        yield f"{place}: {largest:g} of critical damping is unusual: is it in %, {in_si(1e-2 * largest)}?"


def load_warnings(loads: Iterable[Any], look: Callable[[Any], Iterator[str]]) -> Iterator[str]:
    """Yield the warnings of each load, with its place in the file.

    Args:
        loads: The loads of the file, in its order.
        look: Function that yields the warnings of one.
    """
    for number, load in enumerate(loads, 1):
        for line in look(load):
            yield f'[[load]] number {number} (name "{load.name}") {line}'


def step_warnings(loads: Iterable[Any], step: float, periods: Mapping[str, float]) -> Iterator[str]:
    """Yield in what periods and features of loads a step is coarse.

    Args:
        loads: The loads of the file.
        step: The time step, s.
        periods: Periods of other motions by name, s.
    """
    loads = tuple(loads)
    forced = {f"load {load.name}": 1.0 / load.forcing_frequency for load in loads if load.forcing_frequency}
    for name, period in {**forced, **periods}.items():
        if step > period / FEW:
            yield f"[time] step = {step:g}: {period / step:.3g} steps in a period of the {name}, and 50 are good"
    for line in (line for load in loads for line in load.unusual_steps(step)):
        yield f"[time] step = {step:g}: {line}"
