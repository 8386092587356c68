"""The key `units` of a case: its numbers become SI as soon as the file is read, before overrides, which are SI."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

from gapbeam.solver.case.beam_table import Beam, Material
from gapbeam.solver.case.json_schema import unit_in
from gapbeam.solver.case.reading.known_keys import candidates, value_at
from gapbeam.solver.errors import Fault, Key

SI = "m-kg-s"
UNITS = {SI: (1.0, 1.0), "mm-t-s": (1e-3, 1e3), "mm-kg-s": (1e-3, 1.0)}
"""Length in m and mass in kg of a system of units whose time is s."""
MILLIMETERS = "mm-t-s"

LIGHT = 1e-6  # kg/m^3: no solid is so light, and in t/mm^3 they are
HEAVY, STIFF = 100.0, 1e9  # kg/m^3 and Pa: a solid so dense is stiffer than rubber; in MPa, none is as stiff
LONG, THICK = 100.0, 10.0  # m
FALLING = 1000.0  # m/s^2: gravity in mm/s^2
ENOUGH = 2  # unlikely values that stop a run


def factor_of(unit: str, units: str) -> float | None:
    """Return the size in SI of one of a unit of some system, such as "N s/m^2"; None where it depends on a type.

    Args:
        unit: SI unit of the key, or several: "m/s^2, m/s or m".
        units: A key of `UNITS`.
    """
    length, mass = UNITS[units]
    sizes = {"m": length, "kg": mass, "N": mass * length, "Pa": mass / length}
    several = re.split(r", | or ", unit)
    if len(several) > 1:
        first, *others = (factor_of(one, units) for one in several)
        return first if all(other == first for other in others) else None
    if unit.startswith(("in the unit", "(")):
        return None
    top, _, bottom = unit.partition("/")
    factor = 1.0
    for sign, part in ((1, top), (-1, bottom)):
        for word in part.split():
            name, _, power = word.partition("^")
            factor *= sizes.get(name, 1.0) ** (sign * int(power or 1))
    return factor


def convert(data: dict[str, Any]) -> list[Fault]:
    """Convert the tables of a file to SI in place, by the unit that the description of each key ends with.

    Returns:
        Faults of numbers whose unit depends on a type of the table.
    """
    units = data.get("units")
    if not isinstance(units, str) or units not in UNITS or units == SI:
        return []
    data["units"] = SI
    return list(_converted((), data, data, units))


def _converted(key: Key, table: dict[str, Any], data: dict[str, Any], units: str) -> Iterator[Fault]:
    models = candidates(key, data)
    for name, value in table.items():
        if isinstance(value, dict):
            yield from _converted((*key, name), value, data, units)
        elif isinstance(value, list) and any(isinstance(one, dict) for one in value):
            for number, one in enumerate(value):
                if isinstance(one, dict):
                    yield from _converted((*key, name, number), one, data, units)
        elif _numbers(value):
            found = [model.model_fields[name].description or "" for model in models if name in model.model_fields]
            description = found[0] if found else ""
            depends = "N or, for motion" in description or _another_stiffness(key, description, data)
            factor = None if depends else factor_of(unit_in(description), units)
            if factor is None:
                hint = 'write the case in SI units, without the key "units"'
                yield Fault((*key, name), f'{value} with units = "{units}"', "a key with one unit", hint)
            elif factor != 1.0:
                table[name] = _times(value, factor)


def _another_stiffness(key: Key, description: str, data: dict[str, Any]) -> bool:
    """Return whether a stiffness, damping or pressure is of a point, or has the exponent of its law in its unit."""
    contact = data.get("contact")
    if "contact.points" in description and isinstance(contact, dict) and "points" in contact:
        return True
    for place in ((*key, "law"), ("contact", "law")) if "exponent n" in description else ():
        law = value_at(place, data)
        fields = [model.model_fields.get("exponent") for model in candidates(place, data)] if law else []
        given = law.get("exponent") if isinstance(law, dict) else None
        if len(fields) == 1 and fields[0] is not None and (given or fields[0].default) != 1.0:
            return True
    return False


def _numbers(value: object) -> bool:
    if isinstance(value, list):
        return bool(value) and all(_numbers(one) for one in value)
    return isinstance(value, int | float) and not isinstance(value, bool)


def _times(value: Any, factor: float) -> Any:
    return [_times(one, factor) for one in value] if isinstance(value, list) else value * factor


def looks_like_millimeters(data: Mapping[str, Any], tables: Mapping[str, Any]) -> list[Fault]:
    """Return the fault of a case whose values together say mm and MPa; one of them alone is only asked about.

    Args:
        data: The case file as read: one with the key `units` says what it means.
        tables: Its tables as far as they are intact.
    """
    beam, material = tables.get("beam"), tables.get("material")
    if "units" in data or not isinstance(beam, Beam) or not isinstance(material, Material):
        return []
    modulus, density = material.young_modulus, material.density
    lengths = f"length = {beam.length:g} m, thickness = {beam.thickness:g} m"
    falls = [one for one in tables.get("load", {}).values() if abs(getattr(one, "acceleration", None) or 0.0) > FALLING]
    asked = {
        lengths: beam.length > LONG or beam.thickness > THICK or beam.width > THICK,
        f"young_modulus = {modulus:g} Pa": modulus < STIFF and (density < LIGHT or density > HEAVY),
        f"density = {density:g} kg/m^3": density < LIGHT,
        "gravity in mm/s^2": bool(falls),
    }
    unlikely = [words for words, so in asked.items() if so]
    if len(unlikely) < ENOUGH:
        return []
    others = [] if density < LIGHT else [f"density in t/mm^3, {density * 1e-12:.4g}"]
    others += [] if not falls and not tables.get("load") else ["forces in N and moduli in MPa"]
    hint = f'write units = "{MILLIMETERS}" above the first table ({", ".join(others) or "everything as it is"}); '
    hint += f'or units = "{SI}" where the values are meant as they are'
    return [Fault(("units",), f"no units, and {', '.join(unlikely)}: these look like mm and MPa", "SI units", hint)]
