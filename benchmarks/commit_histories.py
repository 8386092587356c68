"""Two checkouts on the same cases: how far their histories are apart.

The cases are those of the other checkout, each with overrides. The other checkout has to run with the packages of this
environment, and its history files have to be those of today.

    git clone . ../old && git -C ../old checkout COMMIT
    environment/run python3 -m benchmarks.commit_histories --other ../old
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.table import RESULTS, Cell, Table, machine_words
from gapbeam.postprocess.results.results import open_results
from gapbeam.solver.system.operators import Array

HERE = Path(__file__).parents[1]
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
        with tempfile.TemporaryDirectory() as folder:
            places = [Path(folder) / name for name in ("old", "new")]
            for checkout, place in zip((other.resolve(), HERE), places, strict=True):
                _run(checkout, other.resolve(), words, place)
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


def _run(checkout: Path, cases: Path, words: str, place: Path) -> None:
    file, *sets = words.split()
    options = [word for key in sets for word in ("--set", key)]
    command = [sys.executable, "-m", "gapbeam", "run", str(cases / "cases" / file), *options, "--output", str(place)]
    there = os.environ | {"PYTHONPATH": str(checkout), "GAPBEAM_ERRORS": "none"}
    done = subprocess.run(command, cwd=checkout, env=there, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{' '.join(command)}: status {done.returncode}\n{done.stderr}")


def _apart(old: Array, new: Array) -> float:
    return float(np.max(np.abs(new - old)) / (np.max(np.abs(old)) or 1.0))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--other", type=Path, required=True, help="folder of the other checkout")
    parser.add_argument("--cases", nargs="+", default=CASES, metavar="'FILE KEY=VALUE ...'", help="cases to run")
    parser.add_argument("--output", type=Path, default=RESULTS, help="folder of the table")
    chosen = parser.parse_args()
    table(chosen.other, chosen.cases).write(chosen.output)
