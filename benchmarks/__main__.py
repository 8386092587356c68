"""All benchmarks in turn, each in a process of its own, and their tables on one page: what `make bench` calls.

environment/run python3 -m benchmarks [--large] [--output results/bench]
"""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path

from benchmarks.table import options

DEFAULT = ("textbook", "fidelity_levels", "getfem_peer", "calculix_peer", "costs", "predictions", "study_workers")
LARGE = {
    "predictions": ["--large"],
    "fidelity": [],
    "costs": ["--large"],
}
PAGE = "README.md"


def main() -> int:
    """Run the benchmarks and return 0, or 1 where one failed."""
    chosen = options(__doc__, ("large", f"only {' and '.join(LARGE)}, up to a million unknowns and whole cases"))
    folder: Path = chosen.output / "large" if chosen.large else chosen.output
    wanted: dict[str, list[str]] = LARGE if chosen.large else {name: [] for name in DEFAULT}
    folder.mkdir(parents=True, exist_ok=True)
    failed = []
    for name, switches in wanted.items():
        clock = time.perf_counter()
        print(f"benchmarks.{name} ...", flush=True)
        command = [sys.executable, "-m", f"benchmarks.{name}", "--output", str(folder), *switches]
        if subprocess.run(command, check=False).returncode != 0:
            failed.append(name)
        print(f"benchmarks.{name}: {time.perf_counter() - clock:.0f} s\n", flush=True)
    pages = sorted(path for path in folder.glob("*.md") if path.name != PAGE)
    text = "\n".join(path.read_text(encoding="utf-8") for path in pages)
    (folder / PAGE).write_text(f"# Benchmarks\n\n{text}", encoding="utf-8")
    print(f"tables: {folder / PAGE}" + (f"; FAILED: {', '.join(failed)}" if failed else ""))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
