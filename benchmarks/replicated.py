"""Data that every rank holds whole, and work of rank 0 alone, against the number of unknowns.

Only the mesh of the solid beam of cases/li2013.toml and its contact operator are made, finer and finer, on one rank:
what is replicated does not depend on the ranks.

    environment/run python3 -m benchmarks.replicated
    environment/run python3 -m benchmarks.replicated --large
"""

from __future__ import annotations

import sys
import time

from mpi4py import MPI

from benchmarks.apart import exponents, measured_apart, print_figures
from benchmarks.communication import kilobytes
from benchmarks.size import mesh_overrides
from benchmarks.table import Cell, Table, gigabytes, machine_words, options, seconds
from benchmarks.textbook import shaken
from gapbeam.solver.assembly.contact_assembly import contact_operator
from gapbeam.solver.models.body import mesh_beam, mesh_dofs, point_rule

CELLS, LARGE = (2, 4, 6), (4, 6, 8, 10, 14)  # across and through the beam


def measure(cells: int) -> None:
    """Measure one size in this process and report it."""
    case = shaken(overrides=mesh_overrides(cells))
    meshed = mesh_beam(case, MPI.COMM_SELF)
    clock = time.perf_counter()
    contact = contact_operator(meshed.space, meshed.faces, case.layout.faces, meshed.width, point_rule(case))
    operator = time.perf_counter() - clock
    gaps, dofs = contact.gap_matrix, mesh_dofs(meshed)
    print_figures(
        {
            "dofs": float(dofs),
            "cells": float(meshed.tagged.cell_count),
            "points": float(contact.size),
            "interface": float(contact.interface.size),
            "mesh": meshed.seconds,
            "operator": operator,
            "gap_matrix": float(gaps.data.nbytes + gaps.indices.nbytes + gaps.indptr.nbytes),
            "vector": 8.0 * dofs,
        }
    )


def table(cells: tuple[int, ...] = CELLS) -> Table:
    """Return the table over the sizes."""
    found = [measured_apart("benchmarks.replicated", "--one", str(count)) for count in cells]
    rows: list[tuple[Cell, ...]] = [
        (
            int(one["dofs"]),
            int(one["cells"]),
            seconds(one["mesh"]),
            gigabytes(one["memory"]),
            int(one["points"]),
            int(one["interface"]),
            seconds(one["operator"]),
            kilobytes(one["gap_matrix"]),
            kilobytes(8.0 * one["interface"] ** 2),
            kilobytes(8.0 * one["points"] ** 2),
            kilobytes(one["vector"]),
        )
        for one in found
    ]
    growing = ("points", "interface", "mesh", "operator")
    powers = exponents(found, growing)
    last = found[-1]
    return Table(
        "replicated",
        "What every rank holds whole, and what rank 0 does alone",
        (
            "DOFs",
            "cells",
            "mesh, by rank 0",
            "memory with it",
            "contact points",
            "interface DOFs",
            "contact operator",
            "G",
            "interface DOFs squared",
            "points squared",
            "a vector of all DOFs, gathered",
        ),
        tuple(rows),
        (
            machine_words(),
            "growth with DOFs^b: " + ", ".join(f"{name} b = {power:.2f}" for name, power in powers.items()),
        ),
        {f"exponent_{name}": power for name, power in powers.items()}
        | {name: last[name] for name in ("dofs", *growing)},
    )


if __name__ == "__main__":
    if "--one" in sys.argv:
        measure(int(sys.argv[-1]))
    else:
        chosen = options(__doc__, ("large", "up to a million unknowns"))
        table(LARGE if chosen.large else CELLS).write(chosen.output)
