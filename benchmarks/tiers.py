"""Ways to solve with the effective operator against the number of unknowns: set-up, steps, memory, where they cross.

The solid beam of cases/li2013.toml, shaken so hard that it rattles, finer and finer: a factor with the responses of the
body to forces at the faces kept, a factor without them, conjugate gradients, and a reduced basis, which is made with
a factor or by conjugate gradients and marched alone. Each in a process of its own.

    environment/run python3 -m benchmarks.tiers
    environment/run python3 -m benchmarks.tiers --large
"""

from __future__ import annotations

import sys

from benchmarks.size import mesh_overrides
from benchmarks.table import (
    Cell,
    Figures,
    Table,
    exponents,
    gigabytes,
    machine_words,
    measured_apart,
    options,
    print_figures,
    seconds,
)
from benchmarks.textbook import shaken
from benchmarks.textbook_newton import marched, seated

TIERS = {
    "factor, responses kept": ("solver.effective=factor", "solver.columns=keep"),
    "factor": ("solver.effective=factor", "solver.columns=drop"),
    "iterations": ("solver.effective=iterative",),
    "basis by a factor": ("model.type=reduced", "solver.effective=factor"),
    "basis by iterations": ("model.type=reduced", "solver.effective=iterative"),
}
STEPS = {"iterations": 5, "basis by a factor": 400, "basis by iterations": 400}
FEW = 20  # steps of the others
Sizes = dict[str, tuple[int, ...]]
CELLS: Sizes = {"factor, responses kept": (4, 6), "factor": (4, 6), "iterations": (4, 6)}
LARGE: Sizes = {
    "factor, responses kept": (4, 6, 8),
    "factor": (4, 8, 10, 14),
    "iterations": (4, 8),
    "basis by a factor": (4, 8, 10, 14),
    "basis by iterations": (4, 8),
}


def measure(cells: int, tier: str) -> None:
    """Measure one size solved in one way in this process and report it."""
    start = seated(shaken(overrides=[*mesh_overrides(cells), *TIERS[tier]]))
    done = marched(start, STEPS.get(tier, FEW))
    print_figures(
        {
            "dofs": float(start.model.mesh_dofs),
            "marched": float(start.model.dofs),
            "setup": sum(start.seconds.values()),
            "seat": start.seconds["seat"],
            "step": done.per_step,
        }
    )


def table(sizes: Sizes = CELLS) -> Table:
    """Return the table over ways and sizes."""
    found: dict[str, list[Figures]] = {
        tier: [measured_apart("benchmarks.tiers", "--one", str(count), tier) for count in counts]
        for tier, counts in sizes.items()
    }
    return table_of(found)


def table_of(found: dict[str, list[Figures]]) -> Table:
    """Return the table of what was measured, by way."""
    rows: list[tuple[Cell, ...]] = []
    figures: dict[str, Cell] = {}
    notes = [machine_words(), f"mean of {FEW} rattling steps, {STEPS['iterations']} by iterations, 400 in a basis"]
    for tier, ones in found.items():
        rows += [
            (
                tier,
                int(one["dofs"]),
                int(one["marched"]),
                seconds(one["setup"]),
                seconds(one["seat"]),
                seconds(one["step"]),
                gigabytes(one["memory"]),
            )
            for one in ones
        ]
        figures |= {f"{tier}, {one['dofs']:.0f}: {name}": one[name] for one in ones for name in ("step", "memory")}
        if len(ones) > 1:
            powers = exponents(ones, ("setup", "step", "memory"))
            figures |= {f"{tier}: exponent of {name}": power for name, power in powers.items()}
            notes.append(
                f"{tier}, cost = a DOFs^b: " + ", ".join(f"{name} b = {power:.2f}" for name, power in powers.items())
            )
    return Table(
        "tiers",
        "Ways to solve with the effective operator",
        ("way", "DOFs of the mesh", "marched", "set-up", "its seat", "step", "peak memory"),
        tuple(rows),
        tuple(notes),
        figures,
    )


if __name__ == "__main__":
    if "--one" in sys.argv:
        measure(int(sys.argv[-2]), sys.argv[-1])
    else:
        chosen = options(__doc__, ("large", "up to a million unknowns: some 40 minutes"))
        table(LARGE if chosen.large else CELLS).write(chosen.output)
