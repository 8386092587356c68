"""Coverage of the error estimates of runs: cases drawn by hypothesis against a second method, class by class.

    environment/run python3 -m benchmarks.drawn_cases 500
    environment/run python3 -m benchmarks.drawn_cases 240 --chatter

A case of a number is always the same. Rows are kept in a file, each as soon as it is known: the command goes on where
it ended, however it did, and other numbers join the table. Status 1: a promise is missed.
"""

from __future__ import annotations

import argparse
import json
import logging
import sys
import tempfile
from dataclasses import asdict
from pathlib import Path

from benchmarks.drawn_cases.attempts import Attempt, Figure, attempted, coverage, missed

SIGNALS = 128  # a status above: a signal ended a run, and with it the benchmark


def kept(file: Path) -> dict[int, Attempt]:
    """Return the attempts of a file by the number of their case, and drop a last line that is not whole."""
    if not file.exists():
        return {}
    text = file.read_text(encoding="utf-8")
    if not text.endswith("\n"):
        text = text[: text.rfind("\n") + 1]
        file.write_text(text, encoding="utf-8")
    lines = [json.loads(line) for line in text.splitlines()]
    found = [Attempt(**line | {"figures": tuple(Figure(**figure) for figure in line["figures"])}) for line in lines]
    return {one.number: one for one in found}


def main() -> int:
    """Draw cases, and return 0, or 1 where a promise is missed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("count", type=int, nargs="?", default=500, help="cases (default 500)")
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    parser.add_argument("--output", type=Path, default=Path("results/bench"), help="folder of the table and the rows")
    parser.add_argument("--again", action="store_true", help="draw what the file has anew")
    parser.add_argument("--chatter", action="store_true", help="draw beams that chatter in stiff stops")
    options = parser.parse_args()
    logging.getLogger("gapbeam").setLevel(logging.ERROR)
    options.output.mkdir(parents=True, exist_ok=True)
    name = "drawn_chatter" if options.chatter else "drawn_cases"
    file = options.output / f"{name}.jsonl"
    found = kept(file)
    for number in range(options.first, options.first + options.count):
        if number in found and not options.again:
            continue
        with tempfile.TemporaryDirectory() as folder:
            one = attempted(number, Path(folder), options.chatter)
        if max(one.status, one.second_status or 0) > SIGNALS:
            return one.status
        found[number] = one
        with file.open("a", encoding="utf-8") as rows:
            rows.write(json.dumps(asdict(one)) + "\n")
        worst = max((figure.error / max(figure.estimate, 1e-300) for figure in one.figures), default=0.0)
        words = f"status {one.status}, second way {one.second_status}, {one.seconds:.1f} s, {len(one.figures)} figures"
        print(f"{number:4d} {one.kind}, {one.stiffness}: {words}, at most {worst:.2g} E", file=sys.stderr, flush=True)
    table = coverage(list(found.values()), name)
    table.write(options.output)
    return 1 if any(missed(list(found.values()))) else 0


if __name__ == "__main__":
    sys.exit(main())
