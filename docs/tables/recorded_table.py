"""Print how far the curve through the rows of a recorded sine is off: python3 docs/tables/recorded_table.py."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from gapbeam.solver.loads.point_load import RecordedForce
from gapbeam.solver.loads.recorded_function import signal_of

ROWS = (5, 10, 20, 40)
PERIODS, MARGIN = 40, 5  # the ends of a record, where the spline knows less, are left out


def largest_error(rows: int, interpolation: str) -> float:
    """Return the largest error over the amplitude, with some rows in a period of the sine."""
    times = np.arange(PERIODS * rows + 1) / rows + 0.1
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "sine.csv"
        np.savetxt(file, np.column_stack([times, np.sin(2.0 * np.pi * times)]), delimiter=",")
        load = {"type": "recorded_force", "point": 0.0, "file": str(file), "interpolation": interpolation}
        signal = signal_of(RecordedForce.model_validate(load))
    inner = np.linspace(MARGIN, PERIODS - MARGIN, 100_001)
    return float(np.abs(signal.value(inner) - np.sin(2.0 * np.pi * (inner + times[0]))).max())


def table() -> str:
    """Return the table of docs/how-to/use-a-recorded-load.md."""
    head = ["| rows in a period | " + " | ".join(map(str, ROWS)) + " |", "|---|" + len(ROWS) * "---|"]
    kinds = ("cubic", "monotone")
    lines = [f"| {kind} | " + " | ".join(f"{largest_error(rows, kind):.1g}" for rows in ROWS) + " |" for kind in kinds]
    return "\n".join([*head, *lines])


if __name__ == "__main__":
    print(table())
