"""Text of a case file: bounded in extent, made into tables with line numbers, or a fault that helps."""

from __future__ import annotations

import os
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gapbeam.solver.messages.errors import CaseError, Fault, Key
from gapbeam.solver.messages.wording import either, near_file, printable
from gapbeam.solver.schema.record_table import KEY_OF_MANY_PARTS

LARGEST = 1_000_000
"""The largest case file that is read, bytes."""
NO_CASES = ("pyproject.toml",)
LONGEST_LINE = 300

EXPECTED = (
    ("overwrite a value", "every key at most once in its table"),
    ("twice", "every table at most once; only [[load]] and [[probe]] may be repeated"),
    ("immutable namespace", "every table written in one place"),
    ("Expected '='", "key = value"),
    ("Invalid statement", "key = value, a table [name], or a comment that starts with #"),
    ("Invalid value", 'a value: a number, "text" in quotes, true, false or a list [1.0, 2.0]'),
    ("after a statement", "nothing behind the value but a comment that starts with #"),
    ("Unclosed array", "a ] at the end of the list"),
    ("Unclosed inline table", "a } at the end of the table"),
    ("Unterminated string", "a quote at the end of the text"),
    ("Expected ']", "a table [name] or an entry [[name]] closed by as many brackets as it was opened"),
    ("Illegal character '\\n'", "a quote at the end of the text, on the same line"),
    ('Expected "', "a quote at the end of the text"),
    ("key part", "a key of letters, digits, _ and -"),
    ("backslash", "text in 'single quotes' where it holds a backslash"),
    ("Unescaped '\\\\'", "text in 'single quotes' where it holds a backslash"),
)
"""Parts of tomllib's messages, each with the expected syntax."""

HINTS = (
    (r"[“”„‘’]", 'straight quotes: "text"'),
    (r"[−–—]", "a plain minus sign: -"),
    (r"^\s*(//|;|%|/\*|!)", "# at the start of a comment"),
    (r"^\s*\[\[[^\]]*\][^\]]*$", "two brackets at both ends: [[name]]"),
    (r"^\s*\[[^\[\]=]*$", "a closing bracket: [name]"),
    (r"^\s*\[[^\[\]]*\]\]", "as many brackets before the name as behind it"),
    (r"^\s*\[\s*\]", "a name between the brackets"),
    (r"==", "a single ="),
    (r"=.*//", "# instead of // before a comment"),
    (r"=\s*\(", "square brackets around a list: [1.0, 2.0]"),
    (r"=\s*\[[^\],]*[^\],\s]\s+[^\],\s]", "a comma between the items of a list"),
    (r"^\s*[A-Za-z_]\w*( +\w+)+\s*=", "_ instead of blanks in the key"),
    (r"[;,]$", "nothing at the end of the line"),
    (r"^\s*[\w.-]+\s*:", "= instead of :"),
    (r"^[^=#]*[^\s=#][^=#]*$", "an = between key and value"),
    (r"=\s*(#|$)", "a value behind the ="),
    (r"=\s*(True|False|TRUE|FALSE)\b", "true and false in small letters"),
    (r"=\s*[+-]?\d+,\d", "a decimal point: 0.1 instead of 0,1"),
    (r"=\s*[+-]?\.\d", "a digit before the decimal point: 0.5 instead of .5"),
    (r"=\s*[+-]?\d+\.(?!\d)", "a digit behind the decimal point: 2.0 instead of 2."),
    (r"=\s*[+-]?0\d", "a number without zeros in front"),
    (r"=\s*[+-]?[\d._]+\s*([*/^]|\*\*)", "the result itself: a case file does not calculate"),
    (
        r"=\s*[+-]?[\d._]+([eE][+-]?\d+)?\s*[A-Za-zµμ%°]",
        "the number alone: all values are in SI units, Hz and degrees",
    ),
    (r"=\s*[A-Za-z_]", 'text in quotes: "text"'),
    (r"\\", "'single quotes' around text that holds a backslash"),
)
"""A pattern in the line where tomllib stopped, and what to try."""


def read_text(path: Path) -> str:
    """Return the text of a case file.

    Raises:
        CaseError: no such file, not a file, too large, not text.
    """
    try:
        if path.is_dir():
            raise _unreadable(path, "a folder", "the path of a case file", _cases_in(path))
        if not path.exists():
            raise _unreadable(path, "no such file", "the path of a case file", _similar(path))
        if not path.is_file():
            raise _unreadable(path, "a device or pipe", "the path of a case file")
        size = path.stat().st_size
        # the kernel's files have no size, and some of them wait for something to say
        with os.fdopen(os.open(path, os.O_RDONLY | os.O_NONBLOCK), "rb") as file:
            content = file.read(LARGEST + 1) or b""
        if max(size, len(content)) > LARGEST:
            raise _unreadable(
                path,
                f"{max(size, len(content))} bytes or more",
                f"a case file, of at most {LARGEST} bytes",
                "is it a mesh or a result?",
            )
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise _unreadable(path, f"a file that cannot be read: {reason}", "a case file that may be read") from error
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        found = f"the byte 0x{content[error.start]:02x}, which is not UTF-8"
        binary = b"\0" in content
        hint = "is it a mesh, a result or UTF-16 text?" if binary else "save it as UTF-8 text in the editor"
        raise _unreadable(path, found, "a text file in UTF-8", hint, f":{line}") from error


def parse(text: str, source: str) -> dict[str, Any]:
    """Return the tables of a case file.

    Raises:
        CaseError: The text is not TOML.
    """
    try:
        return read_toml(text)
    except tomllib.TOMLDecodeError as error:
        raise CaseError(source, [_syntax_fault(text, source, str(error))]) from error
    except (RecursionError, MemoryError) as error:
        fault = Fault((), "lists or tables nested too deep", "at most a list in a table", where=source)
        raise CaseError(source, [fault]) from error
    except ValueError as error:  # a number with thousands of digits
        fault = Fault((), "a whole number of thousands of digits", "a number of a few digits", where=source)
        raise CaseError(source, [fault]) from error


def read_toml(text: str) -> dict[str, Any]:
    """Return the contents of a TOML text.

    Raises:
        ValueError: The text is not TOML, or holds a number of thousands of digits.
        RecursionError: Lists or tables are nested too deep, by brackets or by dots: tomllib takes memory as
            the square of the parts of a key.
    """
    if KEY_OF_MANY_PARTS.search(text):
        raise RecursionError
    return tomllib.loads(text)


def _syntax_fault(text: str, source: str, message: str) -> Fault:
    lines = text.replace("\r\n", "\n").split("\n")
    place = re.search(r"\(at line (\d+), column (\d+)\)", message)
    number, column = (int(place[1]), int(place[2])) if place else (_last(lines, r"\S") or 1, 0)
    if "Unclosed array" in message:  # noticed later than it was opened
        number, column = _last(lines[:number], r"=\s*\[[^\]]*$") or number, 0
    line = lines[number - 1].strip()
    expected = next((words for part, words in EXPECTED if part in message), "")
    if not expected:
        expected = f"a line of TOML; the reader says: {re.sub(r' *[(]at .*[)]$', '', message)}"
    hint = next((words for pattern, words in HINTS if re.search(pattern, line[:LONGEST_LINE])), "")
    if "twice" in message or "overwrite" in message:
        head = line[:LONGEST_LINE].partition("=")[0].strip()
        other = _last(lines[: number - 1], rf"^\s*{re.escape(head)}\s*(=|#|$)")
        hint = f"keep one of lines {other} and {number}" if other else "keep one of them"
    where = f"{source}:{number}: line {number}" + (f", column {column}" if column else "")
    return Fault((), printable(line, 100) or "an empty line", expected, hint, where=where)


def _last(lines: list[str], pattern: str) -> int | None:
    """Return the number of the last line that holds a pattern."""
    return next((n for n in range(len(lines), 0, -1) if re.search(pattern, lines[n - 1][:LONGEST_LINE])), None)


def _unreadable(path: Path, found: str, expected: str, hint: str = "", line: str = "") -> CaseError:
    return CaseError(str(path), [Fault((), found, expected, hint, where=f"{path}{line}")])


def _similar(path: Path) -> str:
    """Return a hint at the case file that was probably meant."""
    if not path.parent.is_dir():
        return f"there is no folder {path.parent} either; the current folder is {Path.cwd()}"
    names = [file.name for file in path.parent.glob("*.toml") if file.name not in NO_CASES]
    close = near_file(path.name, names)
    return f"did you mean {path.parent / close}?" if close else _cases_in(path.parent)


def _cases_in(folder: Path) -> str:
    names = sorted(str(file) for file in folder.glob("*.toml") if file.name not in NO_CASES)[:8]
    return f"one of its case files: {either(names)}" if names else f"there is no case file in {folder}"


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


MOST_ENTRIES = 1000
"""Entries of an array of tables, and items of a list."""
DEEPEST = 20
"""Lists and tables within each other."""


def beyond_bounds(data: Mapping[str, Any], source: str) -> list[Fault]:
    """Return a fault for every top-level key that holds too many entries or too many levels.

    Args:
        data: The file as read, overrides included.
        source: Its path.
    """
    if len(data) > MOST_ENTRIES:
        return [Fault((), f"{len(data)} tables and keys", f"at most {MOST_ENTRIES}", where=source)]
    faults = []
    for name, table in data.items():
        level, depth, most = [table], 0, 0
        while level and depth <= DEEPEST:
            level = [value for value in level if isinstance(value, Mapping | list | tuple)]
            most = max([most, *map(len, level)])
            inside = [value.values() if isinstance(value, Mapping) else value for value in level]
            level, depth = [entry for values in inside for entry in values], depth + 1
        where = f"{source}: {printable(name)}"
        if depth > DEEPEST:
            faults.append(Fault((), f"more than {DEEPEST} levels of lists and tables", "at most a few", where=where))
        elif most > MOST_ENTRIES:
            faults.append(Fault((), f"{most} entries", f"at most {MOST_ENTRIES}", where=where))
    return faults
