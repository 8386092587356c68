"""Tables of measurements: what they stand on, and how they are written, in Markdown and in JSON."""

from __future__ import annotations

import argparse
import json
import os
import platform
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path

from gapbeam.meshes.versions.installed_versions import versions

RESULTS = Path("results/bench")

Cell = str | float | int | None


@dataclass(frozen=True)
class Table:
    """One benchmark's result.

    Attributes:
        name: Of the files.
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
        f"DOLFINx {about['dolfinx']}, {about['date']}"
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
