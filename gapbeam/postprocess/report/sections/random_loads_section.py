"""The spectra of random loads: what was asked for, and what the signal of the run holds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from gapbeam.postprocess.report.blocks import Block, Cell, ReportSection, TableBlock, Words
from gapbeam.postprocess.report.number_text import number

COHERENCE_HEADER = ("x (m)", "distance (m)", "coherence there", "asked", "generated", "95 % interval", "within")
CROSS_HEADER = ("band (Hz)", "asked", "generated", "95 % interval", "phase error (degrees)", "within")
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
    """Return spectrum, coherence of a load along the beam, and what a load has in common with another one."""
    return [*_spectrum(load), *_coherence(load), *_cross_spectrum(load)]


def _cross_spectrum(load: dict[str, Any]) -> list[Block]:
    """Return the coherence with another load; nothing for loads that name none, and of earlier releases."""
    found = load.get("cross_spectrum")
    if not found:
        return []
    both = f"`{load['name']}` and `{found['load']}`"
    before = f"Coherence of {both} at the phase asked for"
    behind = "The phase error is the phase generated less the one asked for."
    return _compared(both, CROSS_HEADER, [_cross_row(band) for band in found["bands"]], before, behind)


def _cross_row(band: dict[str, Any]) -> tuple[Cell, ...]:
    low, value, high = band["low"], band["generated"], band["high"]
    return (
        f"{number(band['from'])} to {number(band['to'])}", band["asked"], value, f"{low:.3f} to {high:.3f}",
        band["phase_error"], _within(low, value, high),
    )  # fmt: skip


def _coherence(load: dict[str, Any]) -> list[Block]:
    """Return the coherence generated beside that asked for; nothing for loads at one place, and of earlier releases."""
    found = load.get("coherence")
    if not found:
        return []
    name, rows = f"`{load['name']}`", [_coherence_row(one) for one in found["places"]]
    before = f"{name} acts as forces at {len(rows) + 1} stations. Their correlation with the one at x = "
    before += f"{number(found['from'])} m over {number(found['independent'])} independent pairs" if rows else ""
    behind = "What is asked of two stations is the coherence spread over the reach of both, beside it that at their "
    return _compared(name, COHERENCE_HEADER, rows, before, f"{behind}distance.")


def _compared(what: str, header: tuple[str, ...], rows: Sequence[tuple[Cell, ...]], *words: str) -> list[Block]:
    """Return a table of coherences; `words` stand before and behind how many of them lie in their intervals."""
    if not rows:
        return [Words(f"The run is too short to compare the coherence of {what} with the one asked for.")]
    inside = sum(row[-1] == "yes" for row in rows)
    counted = f"{inside} of {len(rows)} lie within the interval that chance leaves"
    return [Words(f"{words[0]}: {counted}. {words[1]}"), TableBlock(f"Coherence of {what}", header, rows)]


def _coherence_row(one: dict[str, Any]) -> tuple[float, float, float, float, float, str, str]:
    low, high = one["low"], one["high"]
    found = one["generated"]
    return (
        one["x"], one["distance"], one["curve"], one["asked"], found, f"{low:.3f} to {high:.3f}",
        _within(low, found, high),
    )  # fmt: skip


def _spectrum(load: dict[str, Any]) -> list[Block]:
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
    square = {"N": "N²", "N/m": "(N/m)²"}.get(load["unit"], "(m/s²)²")
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
        _within(least, ratio, most),
    )


def _within(low: float, value: float, high: float) -> str:
    return "yes" if low <= value <= high else "no"
