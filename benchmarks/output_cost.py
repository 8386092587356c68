"""Wall time of a compiled march with all its output, with few fields, and of its time loop alone.

    environment/run python3 -m benchmarks.output_cost [runs]

`cases/li2013.toml` as a reduced model: 20 000 steps, a record of each, with the 400 fields of the case and with two.
Runs in turns, each with a results folder of its own.
"""

from __future__ import annotations

import statistics
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import gapbeam

CASE = Path(__file__).parents[1] / "cases" / "li2013.toml"
REDUCED: dict[str, object] = {"model.type": "reduced"}
FIELDS: dict[str, dict[str, object]] = {"400 fields": {}, "2 fields": {"output.fields_interval": 1.0}}
RUNS = 7


def main(words: Sequence[str]) -> None:
    """Print the table."""
    runs = int(words[0]) if words else RUNS
    found: dict[str, list[tuple[float, float]]] = {name: [] for name in FIELDS}
    for _ in range(runs):
        for name, keys in FIELDS.items():
            with tempfile.TemporaryDirectory() as folder:
                outcome = gapbeam.run(CASE, REDUCED | keys, Path(folder) / "run")
            spent = outcome.summary["wall_time"]
            found[name].append((1.0e6 * spent["per_step"], 1.0e6 * spent["advance"]))
    print(f"us a step, the least and the median of {runs} runs\n")
    print("| output | march with output | time loop |\n|---|---|---|")
    for name, spent in found.items():
        print(f"| {name} | {' | '.join(_least_and_median(column) for column in zip(*spent, strict=True))} |")
    shares = [1.0 - few[0] / many[0] for many, few in zip(*found.values(), strict=True)]
    print(f"\nfields take {100.0 * statistics.median(shares):.0f} % of a march, by the median of pairs")


def _least_and_median(values: Sequence[float]) -> str:
    return f"{min(values):.1f}, {statistics.median(values):.1f}"


if __name__ == "__main__":
    main(sys.argv[1:])
