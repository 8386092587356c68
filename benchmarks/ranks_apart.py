"""Differences between runs on several ranks and the run on one rank, history by history.

environment/run python3 -m benchmarks.ranks_apart --output results/bench
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

from benchmarks.apart import output_of
from benchmarks.messages import on_ranks
from benchmarks.table import Cell, Table, machine_words, options
from gapbeam.postprocess.results.results import open_results

CASE = Path(__file__).parents[1] / "cases" / "demo.toml"
RANKS = (2, 3, 5)
HISTORIES = ("displacement", "velocity", "acceleration_absolute", "contact_force")
MOTIONS = {
    "near rest": ("time.end=0.05",),
    "rattling": ("time.end=0.05", "load.shaker.amplitude=500.0", "load.shaker.frequency=100.0", "load.shaker.ramp=0.0"),
}


def histories(folder: Path, ranks: int, settings: tuple[str, ...]) -> dict[str, np.ndarray]:
    """Run the demo on some ranks and return its histories; errors as in `output_of`."""
    words = [word for one in settings for word in ("--set", one)]
    command = ["-m", "gapbeam", "run", str(CASE), *words, "--error", "none", "--output", str(folder)]
    output_of([sys.executable, *command] if ranks == 1 else on_ranks(ranks, *command))
    found = open_results(folder).history
    return {name: np.asarray(found[name]) for name in HISTORIES}


def measured() -> Table:
    """Return the table: largest difference from one rank over the largest value, for each history."""
    rows: list[tuple[Cell, ...]] = []
    for motion, settings in MOTIONS.items():
        with tempfile.TemporaryDirectory() as folder:
            alone = histories(Path(folder) / "1", 1, settings)
            for ranks in RANKS:
                found = histories(Path(folder) / str(ranks), ranks, settings)
                apart = [np.abs(found[name] - alone[name]).max() / np.abs(alone[name]).max() for name in HISTORIES]
                rows.append((motion, ranks, *(f"{value:.1e}" for value in apart)))
    return Table(
        "ranks_apart",
        "Largest difference from the run on one rank, over the largest value",
        ("motion", "ranks", *HISTORIES),
        tuple(rows),
        (machine_words(),),
    )


def main() -> None:
    """Measure, and write the table."""
    measured().write(options(__doc__).output)


if __name__ == "__main__":
    main()
