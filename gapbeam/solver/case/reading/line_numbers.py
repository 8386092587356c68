"""Line numbers of the keys of a case file, which tomllib does not give."""

from __future__ import annotations

import re
import tomllib

from gapbeam.solver.faults import Key

_NAME = r"""(?:[A-Za-z0-9_-]+|"[^"\n]*"|'[^'\n]*')"""
_NAMES = rf"{_NAME}(?:[ \t]*\.[ \t]*{_NAME})*"
_HEADER = re.compile(rf"[ \t]*(\[\[?)[ \t]*({_NAMES})[ \t]*\]")
_ASSIGNMENT = re.compile(rf"[ \t]*({_NAMES})[ \t]*=(.*)", re.DOTALL)
_LONGEST_VALUE = 200


def key_lines(text: str) -> dict[Key, int]:
    """Return the line number, from 1, of every table and key outside inline tables.

    Args:
        text: A case file that tomllib accepts. Where this scanner loses its way, keys are left out.
    """
    lines: dict[Key, int] = {}
    entries: dict[Key, int] = {}
    table: Key = ()
    rows = text.replace("\r\n", "\n").split("\n")
    number = 0
    while number < len(rows):
        row, start = rows[number], number + 1
        number += 1
        if header := _HEADER.match(row):
            table = _numbered(_names(header[2]), entries)
            if header[1] == "[[":
                entries[table] = entries.get(table, -1) + 1
                lines.setdefault(table, start)
                table = (*table, entries[table])
            lines[table] = start
        elif assignment := _ASSIGNMENT.match(row):
            value = assignment[2]
            limit = number + _LONGEST_VALUE
            while not _is_complete(value):
                if number == min(len(rows), limit):
                    return lines
                value += "\n" + rows[number]
                number += 1
            lines[(*table, *_names(assignment[1]))] = start
    return lines


def line_of(key: Key, lines: dict[Key, int]) -> int | None:
    """Return the line of a key, or of the innermost table around it that has one."""
    return next((lines[key[:size]] for size in range(len(key), 0, -1) if key[:size] in lines), None)


def _numbered(names: Key, entries: dict[Key, int]) -> Key:
    """Return a header as a key, with the number of the entry behind each array of tables it lies in."""
    key: Key = ()
    for name in names:
        if key in entries:
            key = (*key, entries[key])
        key = (*key, name)
    return key


def _names(text: str) -> Key:
    """Return the parts of a dotted key."""
    data, names = tomllib.loads(f"{text} = 0"), []
    while isinstance(data, dict):
        name, data = next(iter(data.items()))
        names.append(name)
    return tuple(names)


def _is_complete(value: str) -> bool:
    try:
        tomllib.loads(f"value ={value}")
    except ValueError:
        return False
    return True
