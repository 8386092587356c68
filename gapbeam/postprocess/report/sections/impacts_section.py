"""Impacts of a run: rates, and how approach speed, impulse and duration are distributed."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gapbeam.postprocess.report.blocks import Cell, ReportSection, TableBlock, Words
from gapbeam.postprocess.report.number_text import number
from gapbeam.postprocess.signals.impact_tables import HEADS, QUANTITIES, distributions, rates


def impacts_section(
    impacts: Mapping[str, np.ndarray], seconds: float, span: str = "over the whole run", anchor: str = "impacts"
) -> ReportSection | None:
    """Return the impacts of a run, or of a part of it; None where there were none.

    Args:
        impacts: By face, as `impacts_of` has them.
        seconds: Span of time, s.
        span: Which one, in words.
        anchor: Of the section.
    """
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
    table = TableBlock(f"Impacts {span}", ("face", "figure", *HEADS[2:]), rows, notes=tuple(notes))
    return ReportSection("Impacts", anchor, [Words(f"Impacts in a second: {found}."), table])
