"""Values that replace those of the case file: --set KEY=VALUE on the command line, a mapping in Python."""

from __future__ import annotations

import copy
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from pydantic import BaseModel

from gapbeam.solver.case.case import Case
from gapbeam.solver.case.reading.known_keys import candidates, is_array, value_at
from gapbeam.solver.case.reading.toml_text import read_toml
from gapbeam.solver.case.reading.value_words import shown
from gapbeam.solver.errors import Fault, Key
from gapbeam.solver.table import type_name
from gapbeam.solver.wording.short_words import either, near, printable

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
                _take_default_type(data, key[:size], root)
    return typed, faults


def _take_default_type(data: dict[str, Any], key: Key, root: type[BaseModel]) -> None:
    """Let a table that the file does not have be of the type that it has by default, where it knows all keys."""
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
