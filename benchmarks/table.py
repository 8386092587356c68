"""Tables of measurements, in Markdown and JSON, and measurements in processes of their own with fits of their cost."""

from __future__ import annotations

import argparse
import json
import os
import platform
import resource
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np

from gapbeam.meshes.versions.installed_versions import versions

RESULTS = Path("results/bench")

Cell = str | float | int | None


@dataclass(frozen=True)
class Table:
    """One benchmark's result.

    Attributes:
        name: Name of the files.
        title: The measured quantity.
        columns: Headings, with units.
        rows: Cells in the order of the columns.
        notes: Conditions, verdicts and what is missing.
        figures: Numbers that others want to read, by name.
    """

    name: str
    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    notes: tuple[str, ...] = ()
    figures: Mapping[str, Cell] = field(default_factory=dict)

    def markdown(self) -> str:
        """Return the table in Markdown."""
        lines = [f"## {self.title}", "", _line(self.columns), _line(["---"] * len(self.columns))]
        lines += [_line([_text(cell) for cell in row]) for row in self.rows]
        return "\n".join([*lines, "", *(f"* {note}" for note in self.notes), ""])

    def write(self, folder: Path) -> None:
        """Write NAME.md and NAME.json, which also reports the machine, and print the table."""
        folder.mkdir(parents=True, exist_ok=True)
        (folder / f"{self.name}.md").write_text(self.markdown(), encoding="utf-8")
        words = asdict(self) | {"machine": machine()}
        (folder / f"{self.name}.json").write_text(json.dumps(words, indent=2) + "\n", encoding="utf-8")
        print(self.markdown(), flush=True)


def machine() -> dict[str, str]:
    """Return the conditions of the times: processor, cores, load, versions, date; no names of machines."""
    model = platform.processor() or platform.machine()
    described = Path("/proc/cpuinfo")
    if described.is_file():
        names = [line for line in described.read_text(encoding="utf-8").splitlines() if line.startswith("model name")]
        model = names[0].partition(":")[2].strip() if names else model
    return {
        "processor": model,
        "cores": str(os.cpu_count()),
        "threads": os.environ.get("OMP_NUM_THREADS", "not set"),
        "load": f"{os.getloadavg()[0]:.2f}",
        "date": time.strftime("%Y-%m-%d %H:%M"),
        **versions(),
    }


def machine_words() -> str:
    """Return the machine in one line."""
    about = machine()
    return (
        f"{about['processor']}, {about['cores']} cores, one thread (load {about['load']} when written), "
        f"DOLFINx {about.get('dolfinx', 'not loaded')}, {about['date']}"
    )


def options(about: str | None, *switches: tuple[str, str]) -> argparse.Namespace:
    """Return the options of a benchmark: --output, and switches given as (name, what it does)."""
    parser = argparse.ArgumentParser(description=(about or "").split("\n")[0])
    parser.add_argument("--output", type=Path, default=RESULTS, help=f"folder of the tables (default {RESULTS})")
    for name, purpose in switches:
        parser.add_argument(f"--{name}", action="store_true", help=purpose)
    return parser.parse_args()


def seconds(value: float) -> str:
    """Return a duration with a unit and three digits."""
    for unit, size in (("s", 1.0), ("ms", 1.0e-3)):
        if value >= size:
            return f"{value / size:.3g} {unit}"
    return f"{value / 1.0e-6:.3g} us"


def gigabytes(value: float) -> str:
    """Return a memory in GB, of 1e9 bytes."""
    return f"{value / 1.0e9:.2f} GB"


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"


def _text(cell: Cell) -> str:
    if cell is None:
        return "-"
    return f"{cell:.3g}" if isinstance(cell, float) else str(cell)


Figures = dict[str, float]
LONGEST = 3600.0  # s for a process that measures


def measured_apart(module: str, *arguments: str) -> Figures:
    """Run a module with arguments in a process of its own and return the figures that it printed last.

    Raises:
        RuntimeError: The module failed; the message holds the end of its output.
    """
    command = [sys.executable, "-m", module, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, timeout=LONGEST, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(command)} failed:\n{(done.stdout + done.stderr)[-2000:]}")
    found: Figures = json.loads(done.stdout.strip().splitlines()[-1])
    return found


def print_figures(figures: Figures) -> None:
    """Print figures, with the peak of resident memory of this process, for `measured_apart`."""
    print(json.dumps(figures | {"memory": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024.0}))


def exponents(found: Sequence[Figures], names: Sequence[str]) -> dict[str, float]:
    """Return b of the fit cost = a DOFs^b for some figures of processes that also printed their DOFs."""
    dofs = [one["dofs"] for one in found]
    return {name: exponent(dofs, [one[name] for one in found]) for name in names}


def exponent(sizes: Sequence[float], costs: Sequence[float]) -> float:
    """Return b of the least-squares fit cost = a size^b."""
    return float(np.polyfit(np.log(sizes), np.log(costs), 1)[0])
