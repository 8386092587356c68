"""Two checkouts on the same cases: how far their histories are apart.

The cases are those of the other checkout, each with overrides. The other checkout has to run with the packages of this
environment, and its history files have to be those of today.

    git clone . ../old && git -C ../old checkout COMMIT
    environment/run python3 -m benchmarks.commit_histories --other ../old
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.other_checkout import HERE, options_with_other, run_by
from benchmarks.table import Cell, Table, machine_words
from gapbeam.postprocess.results.results import open_results
from gapbeam.solver.system.operators import Array

CASES = (
    "demo.toml",
    "demo.toml model.type=reduced time.end=0.1",
    "demo.toml model.type=rigid time.end=0.1",
    "demo.toml time.scheme=newmark time.end=0.1",
    "clamped.toml",
    "exciter.toml",
    "li2013.toml time.end=0.01",
    "li2013-2d.toml time.end=0.1",
    "li2013-2d.toml model.type=reduced time.end=0.1",
    "li2013-2d.toml model.type=beam time.end=0.1",
    "li2013-2d.toml time.scheme=generalized-alpha time.end=0.1",
    "li2013-adams.toml time.end=0.01",
    "periodic.toml",
    "recorded.toml",
)
QUANTITIES = ("displacement", "contact_force", "impulse", "penetration")


def table(other: Path, cases: Sequence[str]) -> Table:
    """Return the table of some cases.

    Args:
        other: Folder of the other checkout.
        cases: Files in its cases/, each with overrides after a space.
    """
    rows: list[tuple[Cell, ...]] = []
    for words in cases:
        file, *overrides = words.split()
        with tempfile.TemporaryDirectory() as folder:
            places = [Path(folder) / name for name in ("old", "new")]
            for checkout, place in zip((other.resolve(), HERE), places, strict=True):
                run_by(checkout, other.resolve() / "cases" / file, overrides, place)
            old, new = (open_results(place).history for place in places)
            apart = [_apart(old[name].values, new[name].values) for name in QUANTITIES]
        rows.append((words, len(old["time"].values), *apart))
        print(rows[-1], file=sys.stderr, flush=True)
    return Table(
        "commit_histories",
        "Histories of this checkout and of another one",
        ("case", "records", *QUANTITIES),
        tuple(rows),
        (machine_words(), "the largest difference over the largest value; 0: every bit is the same"),
    )


def _apart(old: Array, new: Array) -> float:
    return float(np.max(np.abs(new - old)) / (np.max(np.abs(old)) or 1.0))


if __name__ == "__main__":
    parser = options_with_other(__doc__)
    parser.add_argument("--cases", nargs="+", default=CASES, metavar="'FILE KEY=VALUE ...'", help="cases to run")
    chosen = parser.parse_args()
    table(chosen.other, chosen.cases).write(chosen.output)
