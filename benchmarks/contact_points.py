"""Cost of a condensed step against the number of contact points, by finer quadrature on one mesh.

environment/run python3 -m benchmarks.contact_points
"""

from __future__ import annotations

import sys

from benchmarks.table import (
    Cell,
    Table,
    exponent,
    gigabytes,
    machine_words,
    measured_apart,
    options,
    print_figures,
    seconds,
)
from benchmarks.textbook import shaken
from benchmarks.textbook_newton import marched, seated

DEGREES = (1, 3, 5, 7, 9, 11)  # of the quadrature on the faces
STEPS = 200


def measure(degree: int) -> None:
    """Measure one quadrature in this process and report it."""
    start = seated(shaken(overrides=[f"contact.quadrature_degree={degree}"]))
    done = marched(start, STEPS)
    print_figures(
        {
            "dofs": float(start.model.dofs),
            "points": float(start.model.system.contact.size),
            "delassus": start.seconds["delassus"],
            "step": done.per_step,
            "back_substitution": done.back_substitution,
            "iterations": done.iterations,
        }
    )


def table(degrees: tuple[int, ...] = DEGREES) -> Table:
    """Return the table over the quadratures."""
    found = [measured_apart("benchmarks.contact_points", "--one", str(degree)) for degree in degrees]
    rows: list[tuple[Cell, ...]] = [
        (
            int(one["points"]),
            seconds(one["delassus"]),
            seconds(one["step"]),
            seconds(one["back_substitution"]),
            one["step"] / one["back_substitution"],
            f"{one['iterations']:.1f}",
            gigabytes(one["memory"]),
        )
        for one in found
    ]
    rest = [one["step"] - one["back_substitution"] for one in found]
    power = exponent([one["points"] for one in found], rest)
    return Table(
        "contact_points",
        f"Cost against contact points at {found[0]['dofs']:.0f} DOFs",
        ("contact points", "delassus", "step", "back-substitution", "ratio", "iterations", "peak memory"),
        tuple(rows),
        (
            machine_words(),
            f"{STEPS} steps of a rattling beam; the step without its back-substitution = a points^b, b = {power:.2f}",
        ),
        {"exponent": power},
    )


if __name__ == "__main__":
    if "--one" in sys.argv:
        measure(int(sys.argv[-1]))
    else:
        chosen = options(__doc__)
        table().write(chosen.output)
