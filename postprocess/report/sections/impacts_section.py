"""Impacts of a run: rates, and how approach speed, impulse and duration are distributed."""

from __future__ import annotations

from pathlib import Path

from gapbeam.postprocess.report.blocks import Cell, ReportSection, TableBlock, Words
from gapbeam.postprocess.report.number_text import number
from gapbeam.postprocess.results.impacts_of_run import impacts_of
from gapbeam.postprocess.signals.impact_tables import HEADS, QUANTITIES, distributions, rates


def impacts_section(folder: Path, seconds: float, anchor: str = "impacts") -> ReportSection | None:
    """Return the impacts of a run; None where there were none.

    Args:
        folder: Of the run.
        seconds: Its span, s.
        anchor: Of the section.

    Raises:
        ResultsError: The impacts cannot be read.
    """
    impacts = impacts_of(folder)
    if not impacts or not seconds > 0.0:
        return None
    found = ", ".join(f"{face} {number(rate)}" for face, rate in rates(impacts, seconds).items())
    rows: list[tuple[Cell, ...]] = []
    for face, mine in impacts.items():
        for name, values in distributions(mine).items():
            rows.append((face, f"{name} ({QUANTITIES[name][0]})", *values))
    notes = [
        f"{face}: one in {int(mine[0, 4])} impacts was kept for the distributions."
        for face, mine in impacts.items()
        if mine[0, 4] > 1
    ]
    table = TableBlock("Impacts over the whole run", ("face", "figure", *HEADS[2:]), rows, notes=tuple(notes))
    return ReportSection("Impacts", anchor, [Words(f"Impacts in a second: {found}."), table])
