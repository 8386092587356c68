"""Measured signals and spectra from text files: rows of numbers in columns, as loggers and spreadsheets write them.

The lines above the first row are passed over; the last of them that has as many entries as a row names the columns.
Blank lines, and what stands behind #, say nothing. Columns are separated by commas, semicolons, tabs or blanks, and
numbers may have decimal commas where no comma separates them.

Commas that do not separate columns are decimal marks.
"""

from __future__ import annotations

import hashlib
import io
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from gapbeam.solver.messages.errors import Fault, Key, UserError
from gapbeam.solver.messages.wording import counted, either, is_numeric, near, near_file, printable
from gapbeam.solver.system.operators import Array

DELIMITERS = (",", ";", "\t", None)
"""Delimiters of columns, None for blanks; in the order in which they are tried."""
MOST_ABOVE = 20
"""Lines above the rows that may name columns."""
_TWO = re.compile(r"\s*[-+]?\d+[\s;]+[-+]?\d+\s*")
_COMMENT = "#%!*/; \t"


class NoRows(Exception):  # noqa: N818 - what was found
    """No line holds two numbers; the message is the advice."""


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
            return column - 1 if 1 <= column <= self.columns else None
        for names in self.names:
            for known in (names, tuple(map(without_unit, names))):
                if column.strip() in known:
                    return known.index(column.strip())
        return None


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
            numeric = [is_numeric(entry) for entry in entries]
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
        single = single or is_numeric(text.strip())
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


def _names(line: str, delimiter: str | None, columns: int) -> tuple[str, ...]:
    """Return the names in a line above the rows; none where it has another number of entries."""
    text = line.strip().lstrip(_COMMENT)
    for parts in (text.split(delimiter), *(re.split(pattern, text) for pattern in (",", ";", r"\t+", r"\s{2,}"))):
        names = tuple(part.strip().strip("\"'").strip() for part in parts)
        if len(names) == columns and not all(map(is_numeric, names)):
            return names
    return ()


LARGEST = 256_000_000
"""The largest file that is read, bytes."""
GREATEST = 1.0e30
"""Greatest number in a record."""
LONGEST_LINE = 10_000
HEAD = 65_536
TIME, FILE = ("time_column",), ("file",)

Column = int | str


@dataclass(frozen=True)
class RowKind:
    """Kind of rows in a file, in the words of messages and keys.

    Attributes:
        first: Increases from row to row.
        second: Belongs to it.
        fewest: Rows.
    """

    first: str
    second: str
    fewest: int

    @property
    def plural(self) -> str:
        """The entries of the first column."""
        return f"{self.first[:-1]}ies" if self.first.endswith("y") else f"{self.first}s"

    @property
    def keys(self) -> tuple[Key, Key]:
        """The keys of the two columns."""
        return (f"{self.first}_column",), (f"{self.second}_column",)

    @property
    def expected(self) -> str:
        """Description of a valid file, for messages."""
        return f"a text file with a {self.first} and a {self.second} in each row, its path relative to the case file"


SIGNAL = RowKind("time", "value", 2)
"""Two rows are a straight line."""


class RecordError(UserError):
    """A record that cannot be used, with all its faults; their keys are those within the table of the load."""

    def __init__(self, faults: list[Fault]) -> None:
        super().__init__("\n\n".join(map(str, faults)))
        self.faults = faults


@dataclass(frozen=True, eq=False)
class RecordedRows:
    """The rows of a file.

    Attributes:
        times: As in the file, increasing, or what else is in the first column, (rows,).
        values: As in the file, (rows,).
        checksum: SHA-256 of the file, hexadecimal.
    """

    times: Array
    values: Array
    checksum: str


def read_record(file: str, time_column: Column, value_column: Column, kind: RowKind = SIGNAL) -> RecordedRows:
    """Read a record; one that was read before and has not changed since is not read again.

    Args:
        file: Its path.
        time_column: Number from 1, or name.
        value_column: Number from 1, or name.
        kind: Contents of the columns.

    Raises:
        RecordError: There is no such file or column, it is too large, or it holds something else than finite numbers
            in rows of equal length whose times increase.
    """
    path = Path(file)
    try:
        if "\0" in file or not path.exists():
            raise _fault(FILE, f"{printable(file, 200)}, where there is no file", kind.expected, _here(file))
        if not path.is_file():
            found = "a folder" if path.is_dir() else "a device or pipe"
            raise _fault(FILE, f"{printable(file, 200)}, {found}", kind.expected)
        status = path.stat()
        if status.st_size > LARGEST:
            hint = "fewer columns, digits or rows; is it a record at all?"
            raise _fault(FILE, f"a file of {status.st_size} bytes", f"at most {LARGEST} bytes", hint)
        stamp = (status.st_mtime_ns, status.st_size, status.st_ino)
        return _read(path, stamp, (time_column, value_column), kind)
    except OSError as error:
        found = f"{printable(file, 200)}, which cannot be read: {error.strerror or error}"
        raise _fault(FILE, found, kind.expected) from error


@lru_cache(maxsize=8)
def _read(path: Path, _stamp: tuple[int, ...], columns: tuple[Column, Column], kind: RowKind) -> RecordedRows:
    with path.open("rb") as file:
        content = file.read(LARGEST + 1)
    layout = _layout(content[:HEAD], len(content) > HEAD, columns, kind)
    places = [_place(key, column, layout) for key, column in zip(kind.keys, columns, strict=True)]
    faults = [place for place in places if isinstance(place, Fault)]
    if not faults and places[0] == places[1]:
        faults = [Fault(kind.keys[1], f"the column of the {kind.plural}", "another one", "columns are counted from 1")]
    if faults:
        raise RecordError(faults)
    times, values = _numbers(content, layout, [place for place in places if isinstance(place, int)])
    faults = list(_faults(times, values, kind))
    if faults:
        raise RecordError(faults)
    return RecordedRows(times, values, hashlib.sha256(content).hexdigest())


def _layout(head: bytes, goes_on: bool, columns: tuple[Column, Column], kind: RowKind) -> RecordLayout:
    """Return the layout of the rows, from the first bytes of a file."""
    if b"\0" in head:
        hint = "export it as text; UTF-16 text has to be saved as UTF-8"
        raise _fault(FILE, "a binary file", kind.expected, hint)
    lines = head.decode("utf-8-sig", errors="replace").splitlines()
    try:
        return layout_of(lines[:-1] if goes_on else lines, columns)
    except NoRows as error:
        first = f"; its first line is {printable(lines[0])!r}" if lines else ", which is empty"
        found = f"a file without a row of two numbers in its first {HEAD} bytes{first}"
        raise _fault(FILE, found, kind.expected, str(error)) from error


def _place(key: Key, column: Column, layout: RecordLayout) -> int | Fault:
    """Return the number of a column, from 0."""
    place = layout.place(column)
    if place is not None:
        return place
    if isinstance(column, int):
        return Fault(key, f"column {column}", f"1 to {layout.columns}: the first row has as many columns")
    known = [name for names in layout.names[:1] for name in names if name]
    if not known:
        found = f'"{printable(column)}", but no line above the rows names columns'
        return Fault(key, found, "a number of a column, from 1")
    close = near(column, map(without_unit, known))
    hint = f"did you mean {printable(close)!r}?" if close else ""
    return Fault(key, f'"{printable(column)}"', either(map(printable, known[:20])), hint)


def _numbers(content: bytes, layout: RecordLayout, columns: list[int]) -> tuple[Array, Array]:
    """Return two columns."""
    text = io.TextIOWrapper(io.BytesIO(content), encoding="utf-8-sig", errors="replace")
    rows = RowReader(text, layout)
    try:
        read = np.loadtxt(iter(rows), delimiter=layout.delimiter, usecols=columns, comments=None, ndmin=2)
    except ValueError as error:
        entries = _entries(rows.text, layout.delimiter)
        wrong = next((entries[place] for place in columns if not is_numeric(entries[place])), rows.text)
        found = f"{printable(wrong.strip())!r} in line {rows.line}"
        raise _fault(FILE, found, "a number", "put # in front of lines that are no rows") from error
    return np.ascontiguousarray(read[:, 0]), np.ascontiguousarray(read[:, 1])


@dataclass
class RowReader:
    """The rows of a file, one after the other, each with as many columns as the first.

    Attributes:
        file: The text.
        layout: Its layout.
        line: Number of the last line that was read.
        text: Text of this line.
    """

    file: io.TextIOWrapper
    layout: RecordLayout
    line: int = 0
    text: str = ""

    def __iter__(self) -> Iterator[str]:
        layout = self.layout
        for line in iter(lambda: self.file.readline(LONGEST_LINE + 1), ""):
            self.line += 1
            if self.line <= layout.leading:
                continue
            if len(line) > LONGEST_LINE:
                raise _fault(FILE, f"more than {LONGEST_LINE} characters in line {self.line}", "rows of a few numbers")
            self.text = plain(line)
            if not self.text.strip():
                continue
            count = layout.count(self.text)
            if count != layout.columns:
                found = f"{counted(count, 'column')} in line {self.line}: {printable(self.text.strip())!r}"
                hint = "was the file cut off? Lines that are no rows need a # in front"
                raise _fault(FILE, found, f"{layout.columns}, as in the first row", hint)
            yield self.text.replace(",", ".") if layout.delimiter != "," else self.text


def _faults(times: Array, values: Array, kind: RowKind) -> Iterator[Fault]:
    """Yield the faults of the numbers of a record."""
    (first, second), plural = kind.keys, kind.plural
    for key, word, numbers in ((first, kind.first, times), (second, kind.second, values)):
        wrong = np.flatnonzero(~(np.abs(numbers) <= GREATEST))
        if len(wrong):
            many = f", and {len(wrong) - 1} more" if len(wrong) > 1 else ""
            found = f"the {word} {numbers[wrong[0]]:g} in row {wrong[0] + 1}{many}"
            yield Fault(key, found, f"finite numbers up to {GREATEST:g}", "leave out rows where nothing was measured")
    if len(times) < kind.fewest:
        yield Fault(FILE, f"{counted(len(times), 'row')}", f"at least {kind.fewest}")
    back = np.flatnonzero(np.diff(times) <= 0.0)
    if len(back):
        row = int(back[0]) + 1
        before, after = float(times[row - 1]), float(times[row])
        alike = before == after
        found = f"{before} in row {row} and {'again' if alike else after} in row {row + 1}"
        hint = f"{plural} printed with too few digits, or another column?"
        hint = hint if alike else f"is it the column of the {plural}?"
        yield Fault(first, found, f"{plural} that increase from row to row", hint)


def _here(file: str) -> str:
    """Return a hint at a file of the same name in the current folder, or at others next to the missing one."""
    path = Path(file.replace("\0", ""))
    if Path(path.name).is_file():
        return f"{Path(path.name).absolute()} is a file: give that path"
    if not path.parent.is_dir():
        return f"there is no folder {path.parent} either"
    close = near_file(path.name, [other.name for other in path.parent.iterdir()][:1000])
    return f"did you mean {printable(close)}?" if close else ""


def _fault(key: Key, found: str, expected: str, hint: str = "") -> RecordError:
    return RecordError([Fault(key, found, expected, hint)])
