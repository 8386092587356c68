"""Values that replace those of the case file (--set KEY=VALUE, a mapping in Python), and its key `units`.

The numbers of a file become SI as soon as it is read, before overrides, which are SI. The checks know SI alone. What
they found in a file in mm is said as the file has it, so that advice can be typed there: lengths in words, and numbers.
"""

from __future__ import annotations

import copy
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from pydantic import BaseModel

from gapbeam.solver.case.beam_profile import Beam, Material
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.figure_table import RECORDED
from gapbeam.solver.case.json_schema import OF_KEY, OF_QUANTITY, unit_in
from gapbeam.solver.case.reading.known_keys import candidates, is_array, value_at
from gapbeam.solver.case.reading.toml_text import read_toml
from gapbeam.solver.case.reading.value_words import shown
from gapbeam.solver.messages.errors import Fault, Key
from gapbeam.solver.messages.wording import either, near, printable
from gapbeam.solver.schema.record_table import OF_MOTIONS
from gapbeam.solver.schema.table import type_name

QUOTED = re.compile(r"""("(?:[^"\\]|\\.)*"|'[^']*')""")
POINT_WITHOUT_DIGIT = re.compile(r"(?<![\w.])(?P<sign>[+-]?)\.(?P<digits>\d)")
POINT_WITHOUT_DECIMALS = re.compile(r"(?<![\w.])(?P<number>[+-]?\d[\d_]*)\.(?![\d.])(?=[eE\s,\]}]|$)")

Overrides = Mapping[str, object] | Sequence[str]


def override(
    data: dict[str, Any], overrides: Overrides, root: type[BaseModel] = Case
) -> tuple[dict[Key, str], list[Fault]]:
    """Put overrides into the tables of a case file.

    Args:
        data: The case file as read; changed in place.
        overrides: Dotted keys and values (None removes the key), or texts KEY=VALUE.
        root: Model of the whole file.

    Returns:
        For each key that was replaced, how it was typed; and faults for those that have no place.
    """
    typed: dict[Key, str] = {}
    faults: list[Fault] = []
    before = copy.deepcopy(data)
    for entry in pairs(overrides):
        if isinstance(entry, Fault):
            faults.append(entry)
            continue
        name, value = entry
        place = _place(data, name, root)
        if isinstance(place, Fault):
            faults.append(place)
            continue
        table, key = place
        last = str(key[-1])
        if value is None:
            table.pop(last, None)
        else:
            table[last] = copy.deepcopy(value)
        typed[key] = name
    for key in typed:
        for size in range(1, len(key)):
            if value_at(key[:size], before) is None:
                take_default_type(data, key[:size], root)
    return typed, faults


def take_default_type(data: dict[str, Any], key: Key, root: type[BaseModel]) -> None:
    """Let a table without a type be of the type that it has by default, where that knows all keys.

    Args:
        data: The case as read.
        key: Key of the table.
        root: Model of the whole file.
    """
    table, models = value_at(key, data), candidates(key, data, root)
    if not isinstance(table, dict) or "type" in table or len(models) < 2:
        return
    fields = [owner.model_fields.get(str(key[-1])) for owner in candidates(key[:-1], data, root)]
    default = fields[0].get_default(call_default_factory=True) if len(fields) == 1 and fields[0] else None
    for model in models:
        if isinstance(default, model) and set(table) <= set(model.model_fields):
            table["type"] = type_name(model)


def pairs(overrides: Overrides) -> Iterator[tuple[str, object] | Fault]:
    """Yield dotted keys with their values, and a fault for a text that is no KEY=VALUE."""
    if isinstance(overrides, Mapping):
        yield from overrides.items()
        return
    for text in [overrides] if isinstance(overrides, str) else overrides:
        name, equals, value = text.partition("=")
        if not equals or not name.strip() or not value.strip():
            expected = "KEY=VALUE, such as support.clearance=0.2e-3"
            yield Fault((), shown(text), expected, "no blanks around =", where="`overrides=`")
        else:
            yield name.strip(), parse_value(value.strip())


def parse_value(text: str) -> object:
    """Return a value typed on the command line: a TOML value, or else the text itself.

    Numbers may lack a digit on one side of the point, as most programs read them: .025, 2., [-.5, 1.e3].
    """
    for words in (text, _with_digits(text)):
        try:
            data = read_toml(f"value = {words}")
        except (ValueError, RecursionError):
            continue
        return data["value"] if list(data) == ["value"] else text
    return text


def _with_digits(text: str) -> str:
    """Return a text with a digit on both sides of the point of every number outside quotes."""
    parts = QUOTED.split(text)
    parts[::2] = [POINT_WITHOUT_DIGIT.sub(r"\g<sign>0.\g<digits>", part) for part in parts[::2]]
    parts[::2] = [POINT_WITHOUT_DECIMALS.sub(r"\g<number>.0", part) for part in parts[::2]]
    return "".join(parts)


def _place(data: dict[str, Any], name: str, root: type[BaseModel]) -> tuple[dict[str, Any], Key] | Fault:
    """Return the table that an override goes into, and its key; tables on the way are made."""
    parts = name.split(".")
    table, key = data, tuple[str | int, ...]()
    if not all(parts):
        return _misplaced(name, "a key with an empty part", "table.key, such as support.clearance")
    if is_array(parts[0], data, root) and len(parts) > 1:
        number = _entry(data, parts, name, root)
        if isinstance(number, Fault):
            return number
        table, key, parts = data[parts[0]][number], (parts[0], number), parts[2:]
        if not parts:
            return _misplaced(name, "no key behind the entry", f"{name}.key")
    for part in parts[:-1]:
        key = (*key, part)
        if isinstance(table.get(part), str) and candidates(key, data, root):
            table[part] = {"type": table[part]}  # scheme = "newmark" stands for scheme.type = "newmark"
        table = table.setdefault(part, {})
        if not isinstance(table, dict):
            return _misplaced(name, f"{'.'.join(map(str, key))} = {shown(table)}", "a table before the last dot")
    return table, (*key, parts[-1])


def _entry(data: Mapping[str, Any], parts: Sequence[str], name: str, root: type[BaseModel]) -> int | Fault:
    """Return the number, from 0, of the entry of an array of tables that is meant by its number or name."""
    array, wanted = parts[:2]
    entries = data.get(array)
    if not isinstance(entries, list) or not all(isinstance(entry, dict) for entry in entries) or not entries:
        return _misplaced(name, f"no [[{array}]] in the case file", f"a case file with a [[{array}]]")
    names = [_name_of(array, number, data, root) for number in range(len(entries))]
    if wanted in names:
        return names.index(wanted)
    if wanted.isdecimal() and len(wanted) < 9 and int(wanted) < len(entries):
        return int(wanted)
    known = [str(entry) for entry in names if entry is not None]
    close = near(wanted, known)
    numbers = f"a number from 0 to {len(entries) - 1}" if len(entries) > 1 else "0"
    return _misplaced(
        name,
        f"[[{array}]] {printable(wanted)}, which is not in the case file",
        either([numbers, *known]),
        f"did you mean {'.'.join([array, close, *parts[2:]])}?" if close else "",
    )


def _name_of(array: str, number: int, data: Mapping[str, Any], root: type[BaseModel]) -> object:
    """Return the name of an entry, as written or by default."""
    entry = data[array][number]
    models = candidates((array, number), data, root)
    field = models[0].model_fields.get("name") if len(models) == 1 else None
    return entry.get("name", field.default if field and not field.is_required() else None)


def _misplaced(name: str, found: str, expected: str, hint: str = "") -> Fault:
    return Fault((), found, expected, hint, where=f"`overrides=` {printable(name)}")


SI = "m-kg-s"
UNITS = {SI: (1.0, 1.0), "mm-t-s": (1e-3, 1e3), "mm-kg-s": (1e-3, 1.0)}
"""Length in m and mass in kg of a system of units whose time is s."""
MILLIMETERS = "mm-t-s"
FORCE_OR_ACCELERATION, DENSITY = "N or m/s^2", "N^2/Hz or (m/s^2)^2/Hz"
MOTION = "m/s^2, m/s or m"

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
    sizes["J"] = sizes["W"] = mass * length**2
    several = re.split(r", | or ", unit)
    if len(several) > 1:
        first, *others = (factor_of(one, units) for one in several)
        return first if all(other == first for other in others) else None
    if unit.startswith("in the unit"):
        return None
    if squared := re.fullmatch(r"\((.+)\)\^2/Hz", unit):
        one = factor_of(squared[1], units)
        return None if one is None else one**2
    top, _, bottom = unit.partition("/")
    factor = 1.0
    for sign, part in ((1, top), (-1, bottom)):
        for word in part.split():
            name, _, power = word.partition("^")
            factor *= sizes.get(name, 1.0) ** (sign * float(power or 1))
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
    for name, value in table.items():
        if isinstance(value, dict):
            yield from _converted((*key, name), value, data, units)
        elif isinstance(value, list) and any(isinstance(one, dict) for one in value):
            for number, one in enumerate(value):
                if isinstance(one, dict):
                    yield from _converted((*key, name, number), one, data, units)
        elif _numbers(value):
            factor = size_of((*key, name), data, units)
            if factor is None:
                hint = 'write the case in SI units, without the key "units"'
                yield Fault((*key, name), f'{value} with units = "{units}"', "a key with one unit", hint)
            elif factor != 1.0:
                table[name] = _times(value, factor)


def _unit_of_another(table: Any, data: dict[str, Any], root: type[BaseModel]) -> str | None:
    """Return the unit of the key or the quantity that a table names.

    Names that do not exist are refused by themselves.
    """
    named = table if isinstance(table, dict) else {}
    if "quantity" in named:
        recorded = RECORDED.get(named["quantity"])
        return recorded.unit if recorded else ""
    place = _place(copy.deepcopy(data), str(named.get("key")), root)
    return "" if isinstance(place, Fault) else unit_of(place[1], data, root)


def size_of(place: Key, data: dict[str, Any], units: str) -> float | None:
    """Return the size of a key's unit in SI.

    Args:
        place: The way to the key.
        data: The case file as read.
        units: A key of `UNITS`.

    Returns:
        None where types of other tables leave the unit open; 1 of unknown keys.
    """
    unit = unit_of(place, data)
    return None if unit is None else factor_of(unit, units)


def unit_of_key(key: str, data: dict[str, Any], root: type[BaseModel] = Case) -> str:
    """Return the SI unit of a dotted key, as after `--set`; "" where it has none, or there is no such key.

    Args:
        key: The key.
        data: The file as read.
        root: Model of the whole file.
    """
    place = _place(copy.deepcopy(data), key, root)
    return "" if isinstance(place, Fault) else unit_of(place[1], data, root) or ""


def unit_of(place: Key, data: dict[str, Any], root: type[BaseModel] = Case) -> str | None:
    """Return the SI unit of a key, which may depend on others: points, exponent, quantity.

    Args:
        place: The way to the key.
        data: The file as read.
        root: Model of the whole file.

    Returns:
        None where types of other tables leave the unit open; "" of unknown keys and of numbers without a unit.
    """
    key, name = place[:-1], str(place[-1])
    fields = (model.model_fields[name] for model in candidates(key, data, root) if name in model.model_fields)
    description = next((field.description or "" for field in fields), "")
    unit, contact = unit_in(description), data.get("contact")
    if "contact.points" in description and isinstance(contact, dict) and contact.get("points") is not None:
        unit = {"Pa/m": "N/m", "Pa s/m": "N s/m", "Pa": "N"}.get(unit, unit)
    if "exponent n" in description:
        unit += _power(key, data)
    if unit in (OF_KEY, OF_QUANTITY):
        return _unit_of_another(value_at(key, data), data, root)
    load = value_at(key[:2], data) if key[:1] == ("load",) else None
    if not isinstance(load, dict):
        return unit
    if load.get("type") == "recorded_force" and "N or, for motion" in description:
        return "N"
    if unit == MOTION:
        return OF_MOTIONS.get(load.get("quantity", "acceleration"), unit)
    if unit not in (FORCE_OR_ACCELERATION, DENSITY):
        return unit
    along, force = load.get("type") == "random-line-load", load.get("quantity", "force") == "force"
    one = "N/m" if along else "N" if force else "m/s^2"
    if unit == FORCE_OR_ACCELERATION:
        return one
    table = value_at(key, data)
    if isinstance(table, dict) and table.get("scale", 1.0) != 1.0:
        return None  # the scale may be of another unit
    return f"{one}^2/Hz" if force and not along else f"({one})^2/Hz"


def _power(key: Key, data: dict[str, Any]) -> str:
    """Return the power of length that the law at a table adds to the unit of a stiffness, such as "^1.5"."""
    place = next((one for one in ((*key, "law"), ("contact", "law")) if value_at(one, data)), None)
    law = None if place is None else value_at(place, data)
    fields = [] if place is None else [model.model_fields.get("exponent") for model in candidates(place, data)]
    if len(fields) != 1 or fields[0] is None:
        return ""
    given = law.get("exponent") if isinstance(law, dict) else None
    exponent = fields[0].default if given is None else given
    return f"^{exponent!r}" if _numbers(exponent) and exponent != 1.0 else ""


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


FAR_APART = 2.0  # powers of ten between the units of a file and SI

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?"
_NUMBERS = re.compile(rf"(?<![\w.]){_NUMBER}")
_LENGTHS = re.compile(rf"(?<![\w.]){_NUMBER}(?:(?: to | and | or |, ){_NUMBER})* m(?![\w/^])")
_ALONE = re.compile(
    rf"(?<![\w.=+-])(?<!= ){_NUMBER}(?:(?: to | and | or |, ){_NUMBER})*(?=$|[\],;:)]| (?:with|together)\b)"
)
_UNIT_ALONE = re.compile(r"\b(in |are |, )m(?=[,;)]|$)")
_SLIP = re.compile(r"is it in mm\? In m it is \S+")
_GIVEN = re.compile(rf"\b([a-z][\w.]*) = ({_NUMBER}(?!\w|\.\d)|\[[^\[\]]*\])(?! m\b)")
_AS_TYPED = re.compile(r"remove the quotes(?! and the unit)|a whole number without")


def in_file_units(faults: list[Fault], units: object, data: dict[str, Any], typed: Mapping[Key, str]) -> list[Fault]:
    """Return the faults of a file in the units that it names; those of overrides, which are SI, as they are.

    Args:
        faults: Faults in SI.
        units: The key `units` of the file; SI, nothing or no system leaves the faults as they are.
        data: The case file as read, in SI.
        typed: The keys that overrides have replaced.
    """
    if not isinstance(units, str) or units not in UNITS or UNITS[units] == UNITS[SI]:
        return faults
    return [fault if fault.key in typed else _restated(fault, units, data) for fault in faults]


def slips(before: dict[str, Any], data: dict[str, Any], typed: Mapping[Key, str], units: object) -> Iterator[str]:
    """Yield overrides, which are SI, whose numbers are about as large as those that the file has in its own units.

    Args:
        before: The case file as read, in SI.
        data: The same with overrides.
        typed: The keys that overrides have replaced, with how they were typed.
        units: The key `units` of the file.
    """
    if not isinstance(units, str) or units not in UNITS:
        return
    for key, name in typed.items():
        old, new, unit = value_at(key, before), value_at(key, data), unit_of(key, before)
        if not (unit and isinstance(old, int | float) and isinstance(new, int | float) and old and new):
            continue
        factor = factor_of(unit, units) or 1.0
        apart = abs(np.log10(factor))
        if apart >= FAR_APART and abs(np.log10(abs(new / old * factor))) < 0.5 * apart:
            yield (
                f"{name} = {new:g} is {new:g} {unit}, {abs(new / old):.3g} times the {old:g} {unit} of the file, which "
                f'has units = "{units}": overrides are SI. {new:g} in the units of the file is {new * factor:g} {unit}'
            )


def _restated(fault: Fault, units: str, data: dict[str, Any]) -> Fault:
    own = size_of(fault.key, data, units) or 1.0
    hint = _SLIP.sub("", fault.hint)

    def given(match: re.Match[str]) -> str:
        key = tuple(match[1].split("."))
        factor = size_of(key if len(key) > 1 else (*fault.key[:-1], *key), data, units) or 1.0
        return f"{match[1]} = {_divided(match[2], factor)}"

    def said(words: str) -> str:
        words = _ALONE.sub(lambda match: _divided(match[0], own), words)
        return _lengths(_GIVEN.sub(given, words), units)

    if not _AS_TYPED.match(hint):
        hint = _GIVEN.sub(given, hint)
    return replace(fault, found=said(fault.found), expected=said(fault.expected), hint=_lengths(hint, units))


def _divided(words: str, factor: float) -> str:
    return words if factor == 1.0 else _NUMBERS.sub(lambda match: f"{float(match[0]) / factor:.10g}", words)


def _lengths(words: str, units: str) -> str:
    """Return words with the lengths among them in mm."""
    words = _LENGTHS.sub(lambda match: f"{_divided(match[0][:-2], UNITS[units][0])} mm", words)
    return _UNIT_ALONE.sub(r"\1mm", words)
