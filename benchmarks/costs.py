"""Cost of set-up, steps and memory of the solid beam of cases/li2013.toml, shaken so hard that it rattles.

Against the number of unknowns, with all cells finer or coarser alike; against the number of contact points, by finer
quadrature on one mesh; and by the way to solve with the effective operator: a factor with the responses of the body to
forces at the faces kept, a factor without them, conjugate gradients, and a reduced basis, which is made with a factor
or by conjugate gradients and marched alone. Each is measured in a process of its own.

    environment/run python3 -m benchmarks.costs
    environment/run python3 -m benchmarks.costs --large
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

from benchmarks.table import (
    Cell,
    Figures,
    Table,
    exponent,
    exponents,
    gigabytes,
    machine_words,
    measured_apart,
    options,
    print_figures,
    seconds,
)
from benchmarks.textbook import marched, seated, shaken

CELLS = (2, 3, 4, 5, 6, 8)  # across and through the beam
DEGREES = (1, 3, 5, 7, 9, 11)  # of the quadrature on the faces
FITTED = 10_000.0  # DOFs; below it a step costs mostly what does not depend on them
SETUP = ("mesh", "assembly", "factorization", "delassus", "seat")
COSTS = ("assembly", "factorization", "delassus", "step", "back_substitution", "memory")
WAYS = {
    "factor, responses kept": ("solver.effective=factor", "solver.columns=keep"),
    "factor": ("solver.effective=factor", "solver.columns=drop"),
    "iterations": ("solver.effective=iterative",),
    "basis by a factor": ("model.type=reduced", "solver.effective=factor"),
    "basis by iterations": ("model.type=reduced", "solver.effective=iterative"),
}
STEPS = {"iterations": 5, "basis by a factor": 400, "basis by iterations": 400}
FEW = 20  # steps of the other ways
Sizes = dict[str, tuple[int, ...]]
COARSE: Sizes = {"factor, responses kept": (4, 6), "factor": (4, 6), "iterations": (4, 6)}
LARGE: Sizes = {
    "factor, responses kept": (4, 6, 8),
    "factor": (4, 8, 10, 14),
    "iterations": (4, 8),
    "basis by a factor": (4, 8, 10, 14),
    "basis by iterations": (4, 8),
}


def mesh_overrides(cells: int) -> list[str]:
    """Return the mesh of cases/li2013.toml, which has 4 cells across, with all sizes scaled to this number."""
    scale = 4.0 / cells
    return [
        f"mesh.size={0.0115 * scale:.6g}",
        f"mesh.support_size={4.2e-3 * scale:.6g}",
        f"mesh.cells_through_thickness={cells}",
        f"mesh.cells_across_width={cells}",
    ]


def measured(steps: int, overrides: Sequence[str]) -> Figures:
    """Return the cost of a beam, measured over some steps in a process of its own."""
    return measured_apart("benchmarks.costs", "--one", str(steps), *overrides)


def measure(steps: int, overrides: Sequence[str]) -> None:
    """Measure a beam in this process and report it."""
    start = seated(shaken(overrides=list(overrides)))
    done, contact = marched(start, steps), start.model.system.contact
    print_figures(
        {name: start.seconds.get(name, 0.0) for name in SETUP}
        | {
            "dofs": float(start.model.mesh_dofs),
            "marched": float(start.model.dofs),
            "points": float(contact.size),
            "interface": float(contact.interface.size),
            "setup": sum(start.seconds.values()),
            "step": done.per_step,
            "back_substitution": done.back_substitution,
            "iterations": done.iterations,
        }
    )


def size_table(cells: tuple[int, ...] = CELLS) -> Table:
    """Return the table over the number of unknowns."""
    found = [measured(40, mesh_overrides(count)) for count in cells]
    times = (*SETUP, "step", "back_substitution")
    rows: list[tuple[Cell, ...]] = [
        (
            *(int(one[name]) for name in ("dofs", "points", "interface")),
            *(seconds(one[name]) for name in times),
            gigabytes(one["memory"]),
        )
        for one in found
    ]
    fitted = [one for one in found if one["dofs"] >= FITTED] if len(found) > 2 else found
    powers = exponents(fitted, COSTS)
    return Table(
        "size",
        "Cost against unknowns: the condensed way, 3D, degree 2",
        ("DOFs", "contact points", "interface DOFs", *SETUP, "step", "back-substitution", "peak memory"),
        tuple(rows),
        (
            machine_words(),
            "40 steps of a rattling beam; contact points and interface DOFs grow with the mesh",
            f"cost = a DOFs^b, fitted from {min(one['dofs'] for one in fitted):.0f} DOFs on: {_words(powers)}",
        ),
        {f"exponent_{name}": power for name, power in powers.items()},
    )


def points_table(degrees: tuple[int, ...] = DEGREES) -> Table:
    """Return the table over the number of contact points."""
    found = [measured(200, [f"contact.quadrature_degree={degree}"]) for degree in degrees]
    rows: list[tuple[Cell, ...]] = [
        (
            int(one["points"]),
            *(seconds(one[name]) for name in ("delassus", "step", "back_substitution")),
            one["step"] / one["back_substitution"],
            f"{one['iterations']:.1f}",
            gigabytes(one["memory"]),
        )
        for one in found
    ]
    power = exponent([one["points"] for one in found], [one["step"] - one["back_substitution"] for one in found])
    return Table(
        "contact_points",
        f"Cost against contact points at {found[0]['dofs']:.0f} DOFs",
        ("contact points", "delassus", "step", "back-substitution", "ratio", "iterations", "peak memory"),
        tuple(rows),
        (
            machine_words(),
            f"200 steps of a rattling beam; the step without its back-substitution = a points^b, b = {power:.2f}",
        ),
        {"exponent": power},
    )


def ways_table(sizes: Sizes = COARSE) -> Table:
    """Return the table over ways to solve with the effective operator, and sizes."""
    rows: list[tuple[Cell, ...]] = []
    figures: dict[str, Cell] = {}
    notes = [machine_words(), f"mean of {FEW} rattling steps, {STEPS['iterations']} by iterations, 400 in a basis"]
    for way, counts in sizes.items():
        ones = [measured(STEPS.get(way, FEW), [*mesh_overrides(count), *WAYS[way]]) for count in counts]
        for one in ones:
            times = (seconds(one[name]) for name in ("setup", "seat", "step"))
            rows.append((way, int(one["dofs"]), int(one["marched"]), *times, gigabytes(one["memory"])))
            figures |= {f"{way}, {one['dofs']:.0f}: {name}": one[name] for name in ("step", "memory")}
        if len(ones) > 1:
            powers = exponents(ones, ("setup", "step", "memory"))
            figures |= {f"{way}: exponent of {name}": power for name, power in powers.items()}
            notes.append(f"{way}, cost = a DOFs^b: {_words(powers)}")
    return Table(
        "ways",
        "Ways to solve with the effective operator",
        ("way", "DOFs of the mesh", "marched", "set-up", "its seat", "step", "peak memory"),
        tuple(rows),
        tuple(notes),
        figures,
    )


def _words(powers: dict[str, float]) -> str:
    return ", ".join(f"{name.replace('_', '-')} b = {power:.2f}" for name, power in powers.items())


if __name__ == "__main__":
    if "--one" in sys.argv:
        _, _, count, *keys = sys.argv
        measure(int(count), keys)
    else:
        chosen = options(__doc__, ("large", "ways to solve, up to a million unknowns: some 40 minutes"))
        for table in [ways_table(LARGE)] if chosen.large else [size_table(), points_table()]:
            table.write(chosen.output)
