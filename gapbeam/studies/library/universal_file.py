"""Time responses in universal files: data sets 58 as text, with real values that are evenly spaced.

A data set stands between two lines with -1 alone, after a line with its number. In data set 58 five lines of text come
first, then one each of the function, of its values, and of the axes; then the values themselves, in columns of fixed
width, so that they may stand side by side without a blank.

Source: SDRC, Universal dataset number 58, Function at nodal DOF.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gapbeam.solver.loads.record_file import LARGEST
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.messages.wording import printable
from gapbeam.solver.system.operators import Array

MARK, NUMBER, BINARY = "-1", "58", "58b"
HEADER = 11
"""Lines of a data set 58 above its values."""
FUNCTION, FORM, ABSCISSA, ORDINATE = 5, 6, 7, 8
TIME, UNKNOWN = 17, 0
WIDTHS = {2: (6, 13), 4: (4, 20)}
"""Values of a line and characters of a value, by the type of real values: of single and of double precision."""
FUNCTIONS = {
    2: "an auto spectrum", 3: "a cross spectrum", 4: "a frequency response function", 5: "a transmissibility",
    6: "a coherence", 7: "an auto correlation", 8: "a cross correlation", 9: "a power spectral density",
}  # fmt: skip
QUANTITIES = {8: "displacement", 11: "velocity", 12: "acceleration", 9: "reaction force", 13: "excitation force"}


@dataclass(frozen=True)
class UniversalFunction:
    """A data set 58 of a file.

    Attributes:
        path: The file.
        number: Among its data sets 58, from 1.
        first: Number of the first line of its header, from 1.
        lines: Of header and values.
    """

    path: Path
    number: int
    first: int
    lines: list[str]

    def fault(self, found: str, expected: str) -> UserError:
        """Return the error of what the data set is, or has."""
        return UserError(f"{self.path}: data set 58 number {self.number}: found {found}; expected {expected}")

    def numbers(self, line: int, widths: tuple[int, ...]) -> list[float]:
        """Return numbers of a line, by their widths.

        Raises:
            UserError: It has none there.
        """
        text, at, found = self.lines[line], 0, list[float]()
        for width in widths:
            part = text[at : at + width].strip()
            try:
                found.append(float(part.upper().replace("D", "E")))
            except ValueError:
                where = f"{printable(part)!r} in line {self.first + line}, column {at + 1}"
                raise self.fault(where, f"a number of {width} characters") from None
            at += width
        return found

    def samples(self, quantity: str) -> tuple[Array, Array]:
        """Return times, s, and values.

        Args:
            quantity: Expected.

        Raises:
            UserError: It is no time response of that quantity, or its values are complex, uneven or cut off.
        """
        (function,) = self.numbers(FUNCTION, (5,))
        if function not in (0, 1):
            raise self.fault(FUNCTIONS.get(int(function), f"function type {function:g}"), "a time response")
        kind, count, even, begin, interval = self.numbers(FORM, (10, 10, 10, 13, 13))
        if kind not in WIDTHS:
            raise self.fault("complex values" if kind in (5, 6) else f"values of type {kind:g}", "real values")
        if even != 1:
            raise self.fault("values that are not evenly spaced", "evenly spaced ones; resample the recording")
        if not interval > 0.0:
            raise self.fault(f"an interval of {interval:g} s", "one above 0")
        (abscissa,), (ordinate,) = self.numbers(ABSCISSA, (10,)), self.numbers(ORDINATE, (10,))
        if abscissa not in (UNKNOWN, TIME):
            raise self.fault(f"an abscissa of type {abscissa:g}", f"the time, which is {TIME}")
        if ordinate != UNKNOWN and QUANTITIES.get(int(ordinate)) != quantity:
            what = QUANTITIES.get(int(ordinate), f"an ordinate of type {ordinate:g}")
            raise self.fault(what, f"{quantity}, as the unit says")
        each, width = WIDTHS[int(kind)]
        rows = -(-int(count) // each)
        if len(self.lines) != HEADER + rows:
            raise self.fault(f"{len(self.lines) - HEADER} lines of values", f"{rows} for {count:g} values: was it cut?")
        values = list[float]()
        for row in range(rows):
            values += self.numbers(HEADER + row, (width,) * min(each, int(count) - len(values)))
        return begin + interval * np.arange(len(values)), np.array(values)


def read_universal(path: Path, channel: int) -> UniversalFunction:
    """Return a data set 58 of a universal file; other data sets are passed over.

    Args:
        path: The file.
        channel: Its number among the data sets 58, from 1.

    Raises:
        UserError: There is no such file or data set, or it is binary or too large.
    """
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST + 1)
    except OSError as error:
        raise UserError(f"{path}: expected a universal file; {error.strerror or error}") from error
    if len(content) > LARGEST:
        raise UserError(f"{path}: found more than {LARGEST} bytes, expected fewer; export one channel")
    lines, at = content.decode("ascii", errors="replace").splitlines(), 0
    found, others = list[UniversalFunction](), set[str]()
    while at < len(lines):
        if lines[at].strip() != MARK:
            at += 1
            continue
        number = (lines[at + 1].split() or [""])[0] if at + 1 < len(lines) else ""
        if number == BINARY:
            raise UserError(
                f"{path}: found the binary data set 58b in line {at + 2}, expected text: export it as ASCII"
            )
        end = next((k for k in range(at + 2, len(lines)) if lines[k].strip() == MARK), None)
        if end is None:
            raise UserError(f"{path}: the data set that begins in line {at + 1} has no end, -1: was the file cut off?")
        if number == NUMBER:
            found.append(UniversalFunction(path, len(found) + 1, at + 3, lines[at + 2 : end]))
        else:
            others.add(printable(number))
        at = end + 1
    if not found:
        words = f"data sets {', '.join(sorted(others))}" if others else "no data set between lines of -1"
        raise UserError(f"{path}: found {words}, expected a data set 58 (function at a point)")
    if not 1 <= channel <= len(found):
        raise UserError(f"{path}: channel: found {channel}, expected 1 to {len(found)}: its data sets 58")
    one = found[channel - 1]
    if len(one.lines) < HEADER:
        raise one.fault(f"{len(one.lines)} lines", f"{HEADER} of header and then values")
    return one
