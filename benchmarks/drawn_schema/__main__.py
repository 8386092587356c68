"""Draw valid small cases from the whole schema, run them, and compare each with another way to compute it.

environment/run python3 -m benchmarks.drawn_schema --cases 500 --lines results/bench/drawn.jsonl
"""

from __future__ import annotations

import argparse
import importlib
import json
import shutil
import sys
import tempfile
from pathlib import Path

from benchmarks.drawn_schema.attempts import NoCaseError, attempted, table_of

WARM = (
    "gapbeam.command_line",
    "gapbeam.studies.error_estimate.run_errors",
    "gapbeam.solver.march.simulation",
    "gapbeam.solver.models.model",
    "gapbeam.solver.run.run_case",
    "gmsh",
)


def main() -> int:
    """Draw and run cases, and return 0, or 1 where something was found."""
    options = _options()
    for name in WARM:
        importlib.import_module(name)
    lines = []
    scratch = Path(tempfile.mkdtemp(prefix="gapbeam-drawn-"))
    try:
        for seed in options.seeds or range(options.first, options.first + options.cases):
            folder = scratch / str(seed)
            try:
                lines.append(attempted(seed, folder))
            except NoCaseError as error:
                print(f"seed {seed}: {error}", file=sys.stderr, flush=True)
                continue
            text = json.dumps(lines[-1])
            if options.lines is not None:
                with options.lines.open("a", encoding="utf-8") as file:
                    file.write(text + "\n")
            else:
                print(text, file=sys.stderr, flush=True)
            if options.keep is not None and lines[-1]["findings"]:
                shutil.copytree(folder, options.keep / str(seed), dirs_exist_ok=True)
            shutil.rmtree(folder, ignore_errors=True)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
    table = table_of(lines)
    table.write(options.output)
    return 1 if table.figures["findings"] else 0


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=100)
    parser.add_argument("--first", type=int, default=0, help="seed of the first case")
    parser.add_argument("--seeds", type=int, nargs="+", help="these seeds alone")
    parser.add_argument("--lines", type=Path, help="file to append a line of JSON to for each case")
    parser.add_argument("--keep", type=Path, help="folder for the cases with findings")
    parser.add_argument("--output", type=Path, default=Path("results/bench"))
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
