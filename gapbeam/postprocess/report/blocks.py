"""Blocks of reports: contents as frozen data, without layout.

Charts are in `report.charts`. A section is built anywhere from plain numbers; `report.html_page`
turns a report into a page. Blocks check themselves when they are made: shapes that differ, anchors and choices that
do not exist.

Texts of `Words`, of captions, notes and verdicts may hold a little Markdown: `code`, *emphasis*, **strong**,
[links](https://...), lists, and paragraphs between empty lines. Everything else is shown as it is written. Numbers are
written with significant digits, a true minus sign and powers of ten.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from gapbeam.postprocess.report.charts import Chart
from gapbeam.postprocess.report.moving_scene import MovingScene
from gapbeam.postprocess.results_errors import BlockError

Cell = str | float | int | None
Level = Literal["passed", "note", "warning", "error"]

_ANCHOR = re.compile(r"[a-z][a-z0-9-]*")


@dataclass(frozen=True)
class Words:
    """Paragraphs.

    Attributes:
        text: Text with a little Markdown.
    """

    text: str


@dataclass(frozen=True)
class Verdict:
    """Verdict before the numbers: shown in a frame, in red where it is an error.

    Attributes:
        level: "passed", "note", "warning" or "error".
        text: Text with a little Markdown.
    """

    level: Level
    text: str


@dataclass(frozen=True)
class Command:
    """A command that a reader can copy.

    Attributes:
        text: One or more lines.
    """

    text: str


@dataclass(frozen=True)
class Listing:
    """A text shown as it is, such as a case file, folded away until it is asked for.

    Attributes:
        caption: Description.
        text: Text, of any kind.
    """

    caption: str
    text: str


@dataclass(frozen=True)
class Picture:
    """A picture, put into the page.

    Attributes:
        path: Path of a file: PNG, JPEG, SVG or GIF; or the contents of a PNG.
        caption: Description, also read to those who cannot see it.
        command: Command that makes the picture.
    """

    path: Path | bytes
    caption: str
    command: str = ""


@dataclass(frozen=True)
class TableBlock:
    """Numbers and words in rows.

    Attributes:
        caption: Description.
        columns: Heads, with the unit in parentheses.
        rows: A cell a column: words, numbers (shown to `digits` significant digits, integers whole) or None.
        notes: Notes below the table.
        digits: Significant digits of numbers.
        command: Command that makes the numbers.

    Raises:
        BlockError: A row with more or fewer cells than there are columns.
    """

    caption: str
    columns: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    notes: Sequence[str] = ()
    digits: int = 4
    command: str = ""

    def __post_init__(self) -> None:
        for number, row in enumerate(self.rows, start=1):
            if len(row) != len(self.columns):
                raise BlockError(f"{self.caption}: row {number} has {len(row)} cells, there are {self.columns}")


@dataclass(frozen=True)
class ReportSection:
    """Blocks under a heading; a section in a section gets the smaller heading.

    Attributes:
        title: The heading.
        anchor: Its address in the page: lower-case letters, digits and hyphens.
        blocks: Blocks in reading order.
        folded: Whether readers open it first; a link to it, and print, do so too.

    Raises:
        BlockError: The anchor is not valid.
    """

    title: str
    anchor: str
    blocks: Sequence[Block]
    folded: bool = False

    def __post_init__(self) -> None:
        if not _ANCHOR.fullmatch(self.anchor):
            raise BlockError(f"{self.title}: anchor {self.anchor!r}; expected lower-case letters, digits and hyphens")


@dataclass(frozen=True)
class LiveModel:
    """A reduced model that the reader's browser marches.

    Attributes:
        data: Result of `KernelData.as_json`.
        caption: Description.
    """

    data: Mapping[str, object]
    caption: str


Block = Words | Verdict | Command | Listing | Picture | TableBlock | Chart | MovingScene | LiveModel | ReportSection


@dataclass(frozen=True)
class Report:
    """A whole page.

    Attributes:
        title: Title of the page.
        subtitle: Subtitle below it; may be empty.
        sections: Sections in reading order.
        meta: Sources and programs of the report: names and values, at its end.

    Raises:
        BlockError: Two sections with one anchor.
    """

    title: str
    subtitle: str
    sections: Sequence[ReportSection]
    meta: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        anchors = [section.anchor for section in sections_of(self.sections)]
        twice = sorted({anchor for anchor in anchors if anchors.count(anchor) > 1})
        if twice:
            raise BlockError(f"{self.title}: more than one section has the anchor {', '.join(twice)}")


def warnings_of(texts: Sequence[str]) -> list[Verdict]:
    """Return warnings as one verdict, several as a list in it; none where there is none."""
    lines = [" ".join(text.split()) for text in texts]
    if len(lines) < 2:
        return [Verdict("warning", line) for line in lines]
    return [Verdict("warning", "\n".join(f"- {line}" for line in lines))]


def sections_of(blocks: Sequence[Block]) -> Iterator[ReportSection]:
    """Yield every section among blocks, and those in them, in reading order."""
    for block in blocks:
        if isinstance(block, ReportSection):
            yield block
            yield from sections_of(block.blocks)


MINUS = "\N{MINUS SIGN}"
ABSENT = "\N{EN DASH}"
TIMES = "\N{NO-BREAK SPACE}×\N{NO-BREAK SPACE}"
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_PLAIN = range(-3, 6)  # powers of ten of numbers that are written without them


def number(value: float, digits: int = 4) -> str:
    """Return a number to significant digits: 0.01235, −1.235 × 10⁻⁵, 123 500.

    Args:
        value: Integers are written whole; what is not finite is a dash.
        digits: Significant digits of numbers that are no integers.
    """
    if isinstance(value, int):
        return _grouped(str(value))
    if not math.isfinite(value):
        return ABSENT
    if value == 0.0:
        return "0"
    mantissa, power = f"{value:.{digits - 1}e}".split("e")
    if int(power) in _PLAIN:
        return _grouped(f"{float(f'{mantissa}e{power}'):.{max(digits - 1 - int(power), 0)}f}")
    return f"{mantissa}{TIMES}10{str(int(power)).translate(_RAISED)}".replace("-", MINUS)


def cell(value: Cell, digits: int = 4) -> str:
    """Return a cell of a table as text; nothing is a dash."""
    if value is None:
        return ABSENT
    return value if isinstance(value, str) else number(value, digits)


def percent(fraction: float | None, signed: bool = True) -> str:
    """Return a fraction in percent to two significant digits, whole percents where it is large."""
    if fraction is None or not math.isfinite(fraction):
        return ABSENT
    value = 100.0 * fraction
    if abs(value) < 0.005:
        return "0 %"
    size = number(float(f"{abs(value):.2g}"), 2) if abs(value) < 100.0 else _grouped(f"{abs(value):.0f}")
    sign = MINUS if value < 0.0 else "+" if signed else ""
    return f"{sign}{size} %"


def _grouped(text: str) -> str:
    """Set a thin space between the thousands of five digits and more."""
    whole, point, rest = text.partition(".")
    sign, whole = ("-", whole[1:]) if whole.startswith("-") else ("", whole)
    if len(whole) > 4:
        whole = f"{int(whole):,}".replace(",", "\N{NARROW NO-BREAK SPACE}")
    return f"{sign}{whole}{point}{rest}".replace("-", MINUS)


def picture_section(path: Path, caption: str, command: str) -> list[ReportSection]:
    """Return the section of a picture; none where the file is not there."""
    return [ReportSection("Picture", "picture", [Picture(path, caption, command)])] if path.is_file() else []


def statistics_row(one: Mapping[str, Any]) -> tuple[str, float, str, str, str, str, str]:
    """Return the cells of a figure with its interval, for a table of statistics."""
    needed = one["time_for_2_percent"]
    return (
        one["name"],
        one["value"],
        "" if one["unit"] == "1" else one["unit"],
        f"{number(one['low'])} to {number(one['high'])}",
        f"{one['effective_samples']:.0f}",
        one["verdict"],
        "" if needed is None else number(needed),
    )
