"""Two checkouts in turns on the same cases: cost of a step, and whether the answers agree.

Each run is a process of its own, old and new in turns, so that a clock that wanders does so for both. Figures are the
least of the turns; the ratio is new / old. The other checkout has to run with the packages of this environment.

    git clone . ../old && git -C ../old checkout COMMIT
    environment/run python3 -m benchmarks.commit_pair --other ../old
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.fidelity_levels import LEVELS, PERIODIC
from benchmarks.other_checkout import HERE, options_with_other, run_by
from benchmarks.table import Cell, Table, machine_words, seconds

SPANS = {"full": "time.end=0.02", "2D, full": "time.end=0.2", "reduced, all contact DOFs": "time.end=0.1"}
SPAN = "time.end=1.0"
PARTS = {"per_step": "per step", "advance": "step alone"}
WANTED = 1.03


def table(other: Path, levels: Sequence[str], turns: int) -> Table:
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


if __name__ == "__main__":
    parser = options_with_other(__doc__)
    parser.add_argument("--levels", nargs="+", default=list(LEVELS), choices=list(LEVELS), help="levels of [model]")
    parser.add_argument("--turns", type=int, default=5, help="runs of each checkout")
    chosen = parser.parse_args()
    table(chosen.other, chosen.levels, chosen.turns).write(chosen.output)
