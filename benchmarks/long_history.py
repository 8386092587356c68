"""Cost of a checkpoint late in a long run: of the history that it adds, and of one more field in the series.

    environment/run python3 -m benchmarks.long_history

It writes a history of a million records, with a checkpoint every 65 536, and names 10 000 fields in fields.xdmf.
"""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from gapbeam.solver.run.output.hdf5_files import GrowingSeries
from gapbeam.solver.run.output.history_file import HistoryWriter
from gapbeam.solver.schema.record_table import FIELDS_FILE, HISTORY
from gapbeam.solver.system.operators import Array

RECORDS, BETWEEN, AT_ONCE = 2**20, 2**16, 2**12
FIELDS = 10_000
GRID = 1200  # bytes that one takes in fields.xdmf
LABELS: dict[str, tuple[str, ...]] = {
    **{dimension: () for record in HISTORY for dimension in record.dims[1:]},
    "probe": ("test", "tip"),
    "component": ("x", "y"),
    "face": ("base", "gland"),
    "load": ("gravity", "shaker"),
}


def main() -> None:
    """Measure and print."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        commits, gathering = _history(folder)
        size = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
        print(f"history of {RECORDS} records, {size / 1e6:.0f} MB; checkpoints with {BETWEEN} new ones each:")
        print(f"  the first {commits[0]:.2g} s, the others {min(commits[1:]):.2g} to {max(commits[1:]):.2g} s")
        print(f"  the last {commits[-1]:.2g} s; gathering all at the end {gathering:.2g} s")
        print(f"  written and synced to the disk alone, {size // len(commits)} bytes take {_disk(folder, size):.2g} s")
        early, late = _series(folder)
        print(f"fields.xdmf: a field takes {early:.2g} s up to number 100, {late:.2g} s up to number {FIELDS}")


def _history(folder: Path) -> tuple[list[float], float]:
    """Return the seconds of each checkpoint, and those of the gathering at the end."""
    writer, commits = HistoryWriter(folder, LABELS), []
    for first in range(0, RECORDS, AT_ONCE):
        writer.append(_rows(first))
        if (first + AT_ONCE) % BETWEEN == 0:
            commits.append(_seconds(writer.commit))
    return commits, _seconds(writer.close)


def _rows(first: int) -> dict[str, Array]:
    shapes = {record.name: tuple(len(LABELS[dimension]) for dimension in record.dims[1:]) for record in HISTORY}
    rows = {name: np.full((AT_ONCE, *shape), float(first)) for name, shape in shapes.items() if 0 not in shape}
    return rows | {"time": first + np.arange(AT_ONCE, dtype=float)}


def _disk(folder: Path, size: int) -> float:
    """Return the seconds that the disk takes for as many bytes as a checkpoint adds."""
    data = b"\0" * (size * BETWEEN // RECORDS)

    def write() -> None:
        with (folder / "plain").open("wb") as file:
            file.write(data)
            os.fsync(file.fileno())

    return _seconds(write)


def _series(folder: Path) -> tuple[float, float]:
    """Return the mean seconds a field takes among the first and the last hundred."""
    grids = ["x" * GRID]
    series, seconds = GrowingSeries(folder / FIELDS_FILE), []
    series.write(grids)
    for _ in range(1, FIELDS):
        grids.append(grids[0])
        seconds.append(_seconds(lambda: series.add(grids)))
    return float(np.mean(seconds[:100])), float(np.mean(seconds[-100:]))


def _seconds(work: Callable[[], object]) -> float:
    started = time.perf_counter()
    work()
    return time.perf_counter() - started


if __name__ == "__main__":
    main()
