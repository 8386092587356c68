"""Several slices of fuzzing, with seeds of their own, in one table."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.table import Cell, Table

ADDED, LARGEST = slice(1, 7), slice(7, 9)  # columns: numbers of inputs, and what is largest


def added(folders: Sequence[Path]) -> Table:
    """Return the sum of the tables that slices have written.

    Args:
        folders: Their `--output`.
    """
    slices = [json.loads((folder / "fuzz.json").read_text(encoding="utf-8")) for folder in folders]
    rows: dict[str, list[Any]] = {}
    for printed in slices:
        for name, *cells in printed["rows"]:
            before = rows.setdefault(name, [name, *[0] * len(cells)])
            before[ADDED] = [one + other for one, other in zip(before[ADDED], cells[:6], strict=True)]
            before[LARGEST] = [max(pair) for pair in zip(before[LARGEST], cells[6:], strict=True)]
    total = rows.pop("all")
    all_rows: tuple[tuple[Cell, ...], ...] = tuple(tuple(row) for row in [*rows.values(), total])
    used = sum(printed["figures"]["cpu_seconds"] for printed in slices)
    figures = {"tried": total[1], "findings": sum(total[4:7]), "longest": total[7], "cpu_seconds": used}
    notes = (
        "; ".join(printed["notes"][0].split(",")[0] for printed in slices) + f": {used / 60.0:.1f} minutes of CPU",
        *dict.fromkeys(note for printed in slices for note in printed["notes"][1:]),
    )
    return Table("fuzz", "Hostile input", tuple(slices[0]["columns"]), all_rows, notes, figures)
