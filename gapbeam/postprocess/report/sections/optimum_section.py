"""The report on a search for a least figure: its values, figures with their derivatives, and the way there."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gapbeam.postprocess.report.blocks import Block, Cell, ReportSection, TableBlock, Verdict, picture_section
from gapbeam.postprocess.report.study_json import read_records

OPTIMUM_FILE, OPTIMUM_PICTURE = "optimum.json", "optimum.png"
Rows = list[tuple[Cell, ...]]


def optimum_tables(record: Mapping[str, Any]) -> list[tuple[str, tuple[str, ...], Rows]]:
    """Return caption, heads and rows of the values, and of the figures with their derivatives."""
    values, figures = record["values"], record["figures"]
    names = ("lower", "first", "found", "upper")
    rows: Rows = [(str(one["path"]), *(float(one[name]) for name in names)) for one in values]
    heads = ("figure", "first", "found", "limit", *(f"by {one['path']}" for one in values))
    found: Rows = []
    for one in figures:
        limit = None if one["limit"] is None else float(one["limit"])
        slopes = (float(one["slopes"][other["path"]]) for other in values)
        found.append((str(one["figure"]), float(one["first"]), float(one["found"]), limit, *slopes))
    return [
        ("Values of the search", ("value", *names), rows),
        ("Figures of the response at the first and at the found values, and their derivatives there", heads, found),
    ]


def optimum_sections(folder: Path, command: str) -> list[ReportSection]:
    """Return the verdict, the tables and the picture.

    Args:
        folder: As `gapbeam optimize` left it.
        command: That makes the report.

    Raises:
        ResultsError: The file cannot be read, or is no such study.
    """
    del command
    (record,) = read_records(folder / OPTIMUM_FILE, ("headline", "stable", "values", "figures"))
    blocks: list[Block] = [Verdict("passed" if record["stable"] else "warning", str(record["headline"]))]
    blocks += [TableBlock(caption, heads, rows, digits=5) for caption, heads, rows in optimum_tables(record)]
    caption = "Figures, over their limits or first values, and values, in their ranges, of all responses on the way."
    return [
        ReportSection("Summary", "summary", blocks),
        *picture_section(folder / OPTIMUM_PICTURE, caption, "gapbeam optimize"),
    ]
