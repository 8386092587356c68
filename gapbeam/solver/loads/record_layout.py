"""Layout of the rows of a text file: delimiter, decimal mark, and the names above the columns.

Commas that do not separate columns are decimal marks.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

DELIMITERS = (",", ";", "\t", None)
"""Delimiters of columns, None for blanks; in the order in which they are tried."""
MOST_ABOVE = 20
"""Lines above the rows that may name columns."""
_TWO = re.compile(r"\s*[-+]?\d+[\s;]+[-+]?\d+\s*")
_COMMENT = "#%!*/; \t"


class NoRows(Exception):  # noqa: N818 - what was found
    """No line holds two numbers; the message is what to try."""


@dataclass(frozen=True)
class RecordLayout:
    """Layout of the rows of a file.

    Attributes:
        leading: Number of lines above the first row.
        delimiter: Separator of columns; None: blanks.
        columns: Columns of a row.
        names: Names of the columns by each line above the rows that has as many, the last line first.
    """

    leading: int
    delimiter: str | None
    columns: int
    names: tuple[tuple[str, ...], ...] = ()

    def count(self, row: str) -> int:
        """Return the number of columns of a row."""
        return len(row.split()) if self.delimiter is None else row.count(self.delimiter) + 1

    def place(self, column: int | str) -> int | None:
        """Return the place of a column, from 0, by its number from 1 or its name, with or without its unit."""
        if isinstance(column, int):
            return column - 1 if column <= self.columns else None
        for names in self.names:
            for known in (names, tuple(map(without_unit, names))):
                if column.strip() in known:
                    return known.index(column.strip())
        return None

    @property
    def comma(self) -> bool:
        """True where numbers have decimal commas."""
        return self.delimiter != ","

    def entries(self, row: str) -> list[str]:
        """Return the entries of a row, with decimal points."""
        return _entries(row, self.delimiter)


def layout_of(lines: Sequence[str], wanted: Sequence[int | str]) -> RecordLayout:
    """Return the layout of the rows, by the first line that has numbers where they are wanted.

    Args:
        lines: The first lines of a file.
        wanted: Columns that have to hold numbers, from 1 or by name. Where no line fits, the first one with numbers in
            those columns that it has.

    Raises:
        NoRows: There is no such line.
    """
    single, second = False, None
    above: list[str] = []
    names: dict[tuple[int, str | None, int], tuple[tuple[str, ...], ...]] = {}
    for number, line in enumerate(lines):
        text, is_row = plain(line), False
        for delimiter in DELIMITERS:
            entries = _entries(text, delimiter)
            numeric = [_numeric(entry) for entry in entries]
            # "0,001 0,5" has decimal commas and blanks, and is no row of three
            if sum(numeric) < 2 or any(map(_TWO.fullmatch, entries)):
                continue
            key = (len(above), delimiter, len(entries))
            if key not in names:
                named = [_names(heading, delimiter, len(entries)) for heading in reversed(above[-MOST_ABOVE:])]
                names[key] = tuple(filter(None, named))
            layout = RecordLayout(number, delimiter, len(entries), names[key])
            is_row = True
            places = [layout.place(column) for column in wanted]
            if all(place is None or numeric[place] for place in places):
                if None not in places:
                    return layout
                second = second or layout
        single = single or _numeric(text.strip())
        if not is_row:
            above.append(line)
    if second is None:
        raise NoRows("it has one column: put the times in front of the values" if single else "")
    return second


def without_unit(name: str) -> str:
    """Return the name of a column without the unit in brackets behind it."""
    return name.split("(")[0].split("[")[0].strip()


def plain(line: str) -> str:
    """Return a line without the comment behind it."""
    return line.partition("#")[0].rstrip("\r\n ")


def _entries(text: str, delimiter: str | None) -> list[str]:
    return (text if delimiter == "," else text.replace(",", ".")).split(delimiter)


def _numeric(entry: str) -> bool:
    try:
        float(entry)
    except ValueError:
        return False
    return True


def _names(line: str, delimiter: str | None, columns: int) -> tuple[str, ...]:
    """Return the names in a line above the rows; none where it has another number of entries."""
    text = line.strip().lstrip(_COMMENT)
    for parts in (text.split(delimiter), *(re.split(pattern, text) for pattern in (",", ";", r"\t+", r"\s{2,}"))):
        names = tuple(part.strip().strip("\"'").strip() for part in parts)
        if len(names) == columns and not all(map(_numeric, names)):
            return names
    return ()
