"""Comparison of this checkout with another one on the same cases: cost of a step, and difference of the answers.

Each run is a process of its own, old and new in turns, so that a clock that wanders does so for both. Times are the
least of the turns; the ratio is new / old. With `--histories` one run of each shows how far histories are apart. The
other checkout has to run with the packages of this environment, and its history files have to be those of today.

    git clone . ../old && git -C ../old checkout COMMIT
    environment/run python3 -m benchmarks.commits --other ../old
    environment/run python3 -m benchmarks.commits --other ../old --histories
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.fidelity_levels import LEVELS, PERIODIC
from benchmarks.table import RESULTS, Cell, Table, machine_words, seconds
from gapbeam.postprocess.results.results import open_results
from gapbeam.solver.system.operators import Array

HERE = Path(__file__).parents[1]


def run_by(checkout: Path, case: Path, overrides: Sequence[str], results: Path) -> None:
    """Run a case by a checkout, without error estimates, which earlier ones do not have.

    Args:
        checkout: Folder of the checkout.
        case: The case file.
        overrides: Overrides of the case, KEY=VALUE.
        results: Folder of the results, which is not there yet.

    Raises:
        RuntimeError: The run did not end with status 0.
    """
    sets = [word for key in overrides for word in ("--set", key)]
    command = [sys.executable, "-m", "gapbeam", "run", str(case), *sets, "--output", str(results)]
    there = os.environ | {"PYTHONPATH": str(checkout), "GAPBEAM_ERRORS": "none"}
    done = subprocess.run(command, cwd=checkout, env=there, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{' '.join(command)}: status {done.returncode}\n{done.stderr}")


SPANS = {"full": "time.end=0.02", "2D, full": "time.end=0.2", "reduced, all contact DOFs": "time.end=0.1"}
SPAN = "time.end=1.0"
PARTS = {"per_step": "per step", "advance": "step alone"}
WANTED = 1.03


def cost_table(other: Path, levels: Sequence[str], turns: int) -> Table:
    """Return the table of some levels of [model] in this checkout and in another one.

    Args:
        other: Folder of the other checkout.
        levels: Names of `benchmarks.fidelity_levels.LEVELS`.
        turns: Runs of each checkout, of which the least counts; the first runs compile and are not counted.
    """
    rows: list[tuple[Cell, ...]] = []
    figures: dict[str, Cell] = {}
    for level in levels:
        old, new = _in_turns(level, other.resolve(), turns)
        cells: list[Cell] = [level]
        for part, words in PARTS.items():
            least = [min(float(run["wall_time"][part]) for run in runs) for runs in (old, new)]
            cells += [seconds(least[0]), seconds(least[1]), least[1] / least[0]]
            figures[f"{level}: {words}"] = least[1] / least[0]
        cells.append(_peak(new[0]) / _peak(old[0]) - 1.0)
        rows.append(tuple(cells))
        print(rows[-1], file=sys.stderr, flush=True)
    worst = max(float(value) for value in figures.values() if value is not None)
    verdict = "met" if worst <= WANTED else "NOT met"
    return Table(
        "commit_pair",
        "This checkout and another one in turns",
        ("model", "per step, old", "new", "ratio", "step alone, old", "new", "ratio", "peak force, new/old - 1"),
        tuple(rows),
        (machine_words(), f"least of {turns} turns; largest ratio {worst:.3f}, wanted {WANTED:g}: {verdict}"),
        figures,
    )


def _in_turns(level: str, other: Path, turns: int) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    runs: tuple[list[dict[str, Any]], list[dict[str, Any]]] = ([], [])
    for turn in range(turns + 1):
        both = [_summary(checkout, level) for checkout in (other, HERE)]
        if turn:
            for kept, summary in zip(runs, both, strict=True):
                kept.append(summary)
    return runs


def _summary(checkout: Path, level: str) -> dict[str, Any]:
    path, overrides = LEVELS[level]
    with tempfile.TemporaryDirectory() as folder:
        results = Path(folder) / "results"
        keys = (*PERIODIC, SPANS.get(level, SPAN), *overrides)
        run_by(checkout, checkout / path.relative_to(HERE), keys, results)
        summary: dict[str, Any] = json.loads((results / "summary.json").read_text(encoding="utf-8"))
    return summary


def _peak(summary: dict[str, Any]) -> float:
    return max(map(float, summary["peak_contact_force"].values()))


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


def history_table(other: Path, cases: Sequence[str]) -> Table:
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
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--other", type=Path, required=True, help="folder of the other checkout")
    parser.add_argument("--output", type=Path, default=RESULTS, help="folder of the table")
    parser.add_argument("--levels", nargs="+", default=list(LEVELS), choices=list(LEVELS), help="levels of [model]")
    parser.add_argument("--turns", type=int, default=5, help="runs of each checkout")
    parser.add_argument("--histories", nargs="*", metavar="'FILE KEY=VALUE ...'", help="compare histories")
    chosen = parser.parse_args()
    if chosen.histories is None:
        cost_table(chosen.other, chosen.levels, chosen.turns).write(chosen.output)
    else:
        history_table(chosen.other, chosen.histories or CASES).write(chosen.output)
