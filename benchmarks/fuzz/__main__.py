"""Fuzz every reader of gapbeam for some minutes, and report inputs, crashes, hangs and the longest answer.

environment/run python3 -m benchmarks.fuzz --minutes 5 --seed 1
"""

from __future__ import annotations

import argparse
import gc
import importlib
import os
import random
import resource
import shutil
import signal
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

from benchmarks.fuzz.sandbox import Outcome, attempt, make_seeds
from benchmarks.fuzz.targets import TARGETS, Target
from benchmarks.table import Cell, Table

SECRET = "precious, and nobody's business"


@dataclass
class Count:
    """Outcomes of the attempts at one target."""

    kinds: Counter[str] = field(default_factory=Counter)
    longest: float = 0.0
    memory: int = 0


def main() -> int:
    """Fuzz and return 0, or 1 where something was found."""
    options = _options()
    scratch = Path(tempfile.mkdtemp(prefix="gapbeam-fuzz-"))
    try:
        seeds = make_seeds(options.seeds or scratch / "seeds")
        _warm_up()
        counts = _fuzz(options, seeds, scratch)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
    table = _table(counts, options)
    table.write(options.output)
    return 1 if table.figures["findings"] else 0


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=5.0, help="of the wall clock")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", default="", help="targets with this in their name")
    parser.add_argument("--seeds", type=Path, help="folder for the files that are mutated; kept")
    parser.add_argument("--findings", type=Path, help="folder for inputs that crash or hang")
    parser.add_argument("--output", type=Path, default=Path("results/bench"))
    return parser.parse_args()


WARM = (
    "gapbeam.command_line",
    "gapbeam.studies.identification.evaluations",
    "gapbeam.studies.identification.misfit",
    "gapbeam.studies.sweep.sweep_tables",
    "gapbeam.postprocess.plot",
    "gapbeam.postprocess.comparison_report",
    "gapbeam.postprocess.report.html_page",
    "gapbeam.postprocess.report.sections.run_section",
    "gapbeam.postprocess.report.sections.run_section",
    "h5netcdf.legacyapi",
    "xarray.backends.h5netcdf_",
)


def _warm_up() -> None:
    """Import what attempts need, once."""
    for module in WARM:
        importlib.import_module(module)
    gc.freeze()
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)


def _fuzz(options: argparse.Namespace, seeds: Path, scratch: Path) -> dict[str, Count]:
    targets = [target for target in TARGETS if options.only in target.name]
    counts = {target.name: Count() for target in targets}
    weights = [target.weight for target in targets]
    until, number, seen = time.monotonic() + 60.0 * options.minutes, 0, set[str]()
    while time.monotonic() < until:
        chance = random.Random(f"{options.seed} {number}")
        [target] = chance.choices(targets, weights)
        folder = scratch / f"{number}"
        outcome = _one(target, seeds, folder, chance)
        count = counts[target.name]
        count.kinds[outcome.kind] += 1
        count.longest = max(count.longest, outcome.seconds)
        count.memory = max(count.memory, outcome.memory)
        if outcome.is_finding:
            last = outcome.printed.strip().splitlines()[-1:] or [f"status {outcome.status}"]
            mark = f"{target.name}: {outcome.kind} {outcome.status}: {last[0][:200]!r}"
            if mark not in seen and options.findings is not None:
                _keep(folder, options.findings / f"{options.seed}-{number}", outcome)
            seen.add(mark)
            print(f"{number}: {mark}", flush=True)
        shutil.rmtree(folder, ignore_errors=True)
        number += 1
    return counts


def _one(target: Target, seeds: Path, folder: Path, chance: random.Random) -> Outcome:
    """Make an input, try it, and see that nothing was written where nothing may be written."""
    precious = folder / "precious"
    precious.mkdir(parents=True)
    (precious / "secret").write_text(SECRET, encoding="utf-8")
    before = _listing(precious)
    work = target.spoil(seeds, folder, chance)
    os.chdir(folder)
    outcome = attempt(work, folder / "said.txt", target.limits)
    if _listing(precious) != before:
        printed = f"{outcome.printed}\nwritten outside of the results folder: {sorted(_listing(precious))}"
        return Outcome("crash", outcome.status, outcome.seconds, outcome.memory, printed)
    if SECRET in outcome.printed and not target.quotes:
        return Outcome("crash", outcome.status, outcome.seconds, outcome.memory, f"{outcome.printed}\nleaked a secret")
    return outcome


def _listing(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()} | {
        path.name: b"" for path in folder.iterdir() if not path.is_file()
    }


def _keep(folder: Path, kept: Path, outcome: Outcome) -> None:
    """Keep an input that was not answered as it should be."""
    shutil.rmtree(kept, ignore_errors=True)
    pipes = [path.name for path in folder.rglob("*") if path.is_fifo()]
    shutil.copytree(folder, kept, symlinks=True, ignore=shutil.ignore_patterns(*pipes))
    (kept / "printed.txt").write_text(outcome.printed, encoding="utf-8")


def _table(counts: dict[str, Count], options: argparse.Namespace) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for name, count in counts.items():
        findings = [count.kinds[kind] for kind in ("crash", "hang", "escape")]
        printed = (sum(count.kinds.values()), count.kinds["done"], count.kinds["refused"])
        rows.append((name, *printed, *findings, round(count.longest, 2), round(count.memory / 1e6)))
    totals = [sum(int(row[column] or 0) for row in rows) for column in range(1, 7)]
    longest = max(float(row[7] or 0) for row in rows)
    memory = max(int(row[8] or 0) for row in rows)
    rows.append(("all", *totals, longest, memory))
    used = sum(sum(resource.getrusage(who)[:2]) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return Table(
        "fuzz",
        "Hostile input",
        ("input", "tried", "done", "refused", "crashes", "hangs", "escapes", "longest (s)", "peak memory (MB)"),
        tuple(rows),
        (f"seed {options.seed}, {options.minutes:g} minutes of the wall clock, {used / 60:.1f} minutes of CPU",),
        {"tried": totals[0], "findings": sum(totals[3:]), "longest": longest, "cpu_seconds": used},
    )


if __name__ == "__main__":
    sys.exit(main())
