"""Cost of set-up, steps and memory of condensed models against the number of unknowns.

The solid beam of cases/li2013.toml with all cells finer or coarser alike, shaken so hard that it rattles. Each size is
measured in a process of its own.

    environment/run python3 -m benchmarks.size
"""

from __future__ import annotations

import sys

from benchmarks.table import (
    Cell,
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

CELLS = (2, 3, 4, 5, 6, 8)  # across and through the beam
STEPS = 40
FITTED = 10_000.0  # DOFs; below it a step costs mostly what does not depend on them
SETUP = ("mesh", "assembly", "factorization", "delassus", "seat")
COSTS = ("assembly", "factorization", "delassus", "step", "back_substitution", "memory")


def mesh_overrides(cells: int) -> list[str]:
    """Return the mesh of cases/li2013.toml, which has 4 cells across, with all sizes scaled to this number."""
    scale = 4.0 / cells
    return [
        f"mesh.size={0.0115 * scale:.6g}",
        f"mesh.support_size={4.2e-3 * scale:.6g}",
        f"mesh.cells_through_thickness={cells}",
        f"mesh.cells_across_width={cells}",
    ]


def measure(cells: int) -> None:
    """Measure one size in this process and report it."""
    start = seated(shaken(overrides=mesh_overrides(cells)))
    done = marched(start, STEPS)
    contact = start.model.system.contact
    print_figures(
        {name: start.seconds[name] for name in SETUP}
        | {
            "dofs": float(start.model.dofs),
            "points": float(contact.size),
            "interface": float(contact.interface.size),
            "step": done.per_step,
            "back_substitution": done.back_substitution,
        }
    )


def table(cells: tuple[int, ...] = CELLS) -> Table:
    """Return the table over the sizes."""
    found = [measured_apart("benchmarks.size", "--one", str(count)) for count in cells]
    rows: list[tuple[Cell, ...]] = [
        (
            int(one["dofs"]),
            int(one["points"]),
            int(one["interface"]),
            *(seconds(one[name]) for name in SETUP),
            seconds(one["step"]),
            seconds(one["back_substitution"]),
            gigabytes(one["memory"]),
        )
        for one in found
    ]
    fitted = [one for one in found if one["dofs"] >= FITTED] if len(found) > 2 else found
    dofs = [one["dofs"] for one in fitted]
    powers = exponents(fitted, COSTS)
    return Table(
        "size",
        "Cost against unknowns: the condensed way, 3D, degree 2",
        ("DOFs", "contact points", "interface DOFs", *SETUP, "step", "back-substitution", "peak memory"),
        tuple(rows),
        (
            machine_words(),
            f"{STEPS} steps of a rattling beam; contact points and interface DOFs grow with the mesh",
            f"cost = a DOFs^b, fitted from {min(dofs):.0f} DOFs on: "
            + ", ".join(f"{name.replace('_', '-')} b = {power:.2f}" for name, power in powers.items()),
        ),
        {f"exponent_{name}": power for name, power in powers.items()},
    )


if __name__ == "__main__":
    if "--one" in sys.argv:
        measure(int(sys.argv[-1]))
    else:
        chosen = options(__doc__)
        table().write(chosen.output)
