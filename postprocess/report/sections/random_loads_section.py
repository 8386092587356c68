"""The spectra of random loads: what was asked for, and what the signal of the run holds."""

from __future__ import annotations

from typing import Any

from gapbeam.postprocess.report.blocks import Block, ReportSection, TableBlock, Words
from gapbeam.postprocess.report.number_text import number

HEADER = ("band (Hz)", "asked", "generated", "ratio", "95 % interval of the ratio", "within")


def random_loads_section(summary: dict[str, Any], anchor: str = "random-loads") -> ReportSection | None:
    """Return what random loads were beside what they were to be; None for a run without any.

    Args:
        summary: Of a run.
        anchor: Of the section.
    """
    loads = summary.get("random_loads") or ()
    blocks = [block for load in loads for block in _of_load(load)]
    return ReportSection("Random loads", anchor, blocks) if blocks else None


def _of_load(load: dict[str, Any]) -> list[Block]:
    name = f"`{load['name']}`"
    asked = f"{name}: rms {number(load['rms'])} {load['unit']}, seed {load['seed']}"
    if not load["bands"]:
        return [Words(f"{asked}. The run is too short to compare the spectrum of its signal with the one asked for.")]
    rows = [_row(band) for band in load["bands"]]
    inside = sum(row[-1] == "yes" for row in rows)
    words = (
        f"{asked}. Over {number(load['seconds'])} s, {inside} of {len(rows)} bands lie within the interval that chance "
        "leaves; one in 20 lies outside where all is as asked for."
    )
    square = "N²" if load["unit"] == "N" else "(m/s²)²"
    title = f"Mean squares of {name} in bands of equal power, {square}"
    return [Words(words), TableBlock(title, HEADER, rows)]


def _row(band: dict[str, Any]) -> tuple[str, float, float, float, str, str]:
    ratio = band["generated"] / band["asked"]
    least, most = band["least_ratio"], band["most_ratio"]
    return (
        f"{number(band['from'])} to {number(band['to'])}",
        band["asked"],
        band["generated"],
        ratio,
        f"{number(least)} to {number(most)}",
        "yes" if least <= ratio <= most else "no",
    )
