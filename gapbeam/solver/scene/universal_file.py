"""Data sets of universal files, as text.

A data set stands between two lines with -1 alone, after a line with its number. Its lines have columns of fixed width,
so that numbers may stand side by side without a blank.

Source: SDRC, Universal file data sets (numbers 55, 58 and 164).
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from math import isfinite, nan
from pathlib import Path

from gapbeam.solver.loads.record_file import LARGEST
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.messages.wording import counted, printable

UNIVERSAL = (".uff", ".unv")
MARK = "-1"


@dataclass(frozen=True)
class DataSet:
    """A data set of a universal file.

    Attributes:
        path: The file.
        kind: Number of its kind, as "58".
        number: Among the data sets of its kind, from 1.
        first: Number of its first line in the file, from 1.
        lines: Its lines.
    """

    path: Path
    kind: str
    number: int
    first: int
    lines: list[str]

    def fault(self, found: str, expected: str) -> UserError:
        """Return the error about the data set."""
        return UserError(f"{self.path}: data set {self.kind} number {self.number}: found {found}; expected {expected}")

    def numbers(self, line: int, widths: tuple[int, ...]) -> list[float]:
        """Return numbers of a line, by their widths.

        Raises:
            UserError: There is no such line, or it has no numbers there.
        """
        if line >= len(self.lines):
            raise self.fault(counted(len(self.lines), "line"), f"{line + 1} or more: was it cut?")
        text, at, found = self.lines[line], 0, list[float]()
        for width in widths:
            part = text[at : at + width].strip()
            try:
                value = float(part.upper().replace("D", "E"))
            except ValueError:
                value = nan
            if not isfinite(value):
                where = f"{printable(part)!r} in line {self.first + line}, column {at + 1}"
                raise self.fault(where, f"a number of {width} characters")
            found.append(value)
            at += width
        return found


@dataclass(frozen=True)
class UniversalFile:
    """The data sets of a universal file.

    Attributes:
        path: The file.
        sets: Its data sets, in their order.
    """

    path: Path
    sets: list[DataSet]

    @classmethod
    def read(cls, path: Path) -> UniversalFile:
        """Read a file.

        Raises:
            UserError: There is no such file, it is too large, or a data set is cut off.
        """
        return cls(path, _all_sets(path))

    def first(self, kind: str) -> DataSet | None:
        """Return the first data set of a kind; None: there is none."""
        return next((one for one in self.sets if one.kind == kind), None)

    def of_kind(self, kind: str, what: str) -> list[DataSet]:
        """Return the data sets of a kind, at least one.

        Args:
            kind: Number of the kind.
            what: Name of the kind in messages.

        Raises:
            UserError: No data set is of the kind, or one is binary.
        """
        binary = self.first(f"{kind}b")
        if binary is not None:
            raise UserError(
                f"{self.path}: found the binary data set {binary.kind} in line {binary.first - 1}, expected text: "
                "export it as ASCII"
            )
        found = [one for one in self.sets if one.kind == kind]
        if not found:
            others = sorted({printable(one.kind) for one in self.sets})
            words = f"data sets {', '.join(others)}" if others else "no data set between lines of -1"
            raise UserError(f"{self.path}: found {words}, expected a data set {kind} ({what})")
        return found


def _all_sets(path: Path) -> list[DataSet]:
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST + 1)
    except OSError as error:
        raise UserError(f"{path}: expected a universal file; {error.strerror or error}") from error
    if len(content) > LARGEST:
        raise UserError(f"{path}: found more than {LARGEST} bytes, expected fewer; export less, such as one channel")
    lines, at, found = content.decode("ascii", errors="replace").splitlines(), 0, list[DataSet]()
    numbers = Counter[str]()
    while at < len(lines):
        if lines[at].strip() != MARK:
            at += 1
            continue
        kind = (lines[at + 1].split() or [""])[0] if at + 1 < len(lines) else ""
        end = next((k for k in range(at + 2, len(lines)) if lines[k].strip() == MARK), None)
        if end is None and not kind.endswith("b"):
            raise UserError(f"{path}: the data set that begins in line {at + 1} has no end, -1: was the file cut off?")
        numbers[kind] += 1
        found.append(DataSet(path, kind, numbers[kind], at + 3, lines[at + 2 : end]))
        at = len(lines) if end is None else end + 1
    return found
