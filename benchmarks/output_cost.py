"""Wall time of a compiled march with all its output, with few fields, and of its time loop alone.

    environment/run python3 -m benchmarks.output_cost

`cases/li2013.toml` as a reduced model: 20 000 steps, a record of each, with the 400 fields of the case and with two.
Nine runs of each in turns, each with a results folder of its own.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from statistics import median

import gapbeam
from benchmarks.table import Cell, Table, machine_words, options, seconds

CASE = Path(__file__).parents[1] / "cases" / "li2013.toml"
REDUCED: dict[str, object] = {"model.type": "reduced"}
MANY, FEW = "400 fields", "2 fields"
FIELDS: dict[str, dict[str, object]] = {MANY: {}, FEW: {"output.fields_interval": 1.0}}
RUNS = 9


def table() -> Table:
    """Return the table of both."""
    marches: dict[str, list[float]] = {name: [] for name in FIELDS}
    loops: dict[str, list[float]] = {name: [] for name in FIELDS}
    for _ in range(RUNS):
        for name, keys in FIELDS.items():
            with tempfile.TemporaryDirectory() as folder:
                spent = gapbeam.run(CASE, REDUCED | keys, Path(folder) / "run").summary["wall_time"]
            marches[name].append(spent["per_step"])
            loops[name].append(spent["advance"])
    rows: list[tuple[Cell, ...]] = [
        (name, *(seconds(of(values[name])) for values in (marches, loops) for of in (min, median))) for name in FIELDS
    ]
    share = median(1.0 - few / many for many, few in zip(marches[MANY], marches[FEW], strict=True))
    return Table(
        "output_cost",
        "A step of a compiled march with its output",
        ("output", "march, least", "march, median", "time loop, least", "time loop, median"),
        tuple(rows),
        (machine_words(), f"fields take {100.0 * share:.0f} % of a march, by the median of pairs"),
    )


if __name__ == "__main__":
    table().write(options(__doc__).output)
