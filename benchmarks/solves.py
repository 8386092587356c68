"""Solves by conjugate gradients with multigrid in the degree, and a step of a march with contact that is made of them.

The solid beam of cases/li2013.toml, finer and finer, up to a million unknowns; right sides are the force of the shaker
and a pressure on the contact faces. In the step the undeformed beam lands flat on its base, at 0.1 m/s: the contact
solve iterates most where all points meet at once. Each size is measured in a process of its own.

    environment/run python3 -m benchmarks.solves
    environment/run python3 -m benchmarks.solves --large
"""

from __future__ import annotations

import sys
import time

import numpy as np
from mpi4py import MPI

from benchmarks.apart import exponents, measured_apart, print_figures
from benchmarks.size import mesh_overrides
from benchmarks.table import Cell, Table, gigabytes, machine_words, options, seconds
from benchmarks.textbook import shaken
from gapbeam.solver.contact.solve.condensation import MatrixFreeOperator
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.models.model import Model
from gapbeam.solver.system.semi_discrete import State, imaged

CELLS, LARGE = (2, 4, 6), (4, 8, 14)  # across and through the beam
COSTS = ("assembly", "preconditioner", "solve", "step", "memory")
LANDING = -0.1  # m/s


def measure(cells: int) -> None:
    """Measure one size in this process and report it."""
    case = shaken(overrides=[*mesh_overrides(cells), "solver.effective=iterative"])
    simulation = Simulation.of_case(case, MPI.COMM_SELF)
    model, scheme, plan = simulation.model, simulation.scheme, simulation.plan
    system = model.system
    clock = time.perf_counter()
    condensed = plan.operators.at(plan.dt)
    preconditioner = time.perf_counter() - clock
    assert isinstance(condensed, MatrixFreeOperator)
    factor = condensed.factor
    shaker = next(load.pattern for load in system.loads if not load.static)
    pressed = np.zeros(system.operators.size)
    system.contact.interface.add(pressed, system.contact.resultant(system.contact.weights))
    clock = time.perf_counter()
    for right_side in (shaker, pressed):
        factor.solve(right_side)
    solve, solves, iterations = (time.perf_counter() - clock) / factor.solves, factor.solves, factor.iterations
    start = _landing(model)
    clock = time.perf_counter()
    step = scheme.advance(system, condensed, model.law, start, plan.dt)
    print_figures(
        {
            "step": time.perf_counter() - clock,
            "step_solves": float(factor.solves - solves),
            "pressed": float(np.count_nonzero(step.new.pressure)),
            "dofs": float(model.dofs),
            "assembly": model.seconds["assembly"],
            "preconditioner": preconditioner,
            "solve": solve,
            "iterations": iterations / solves,
        }
    )


def _landing(model: Model) -> State:
    """Return the undeformed beam as it lands on its base."""
    operators, contact, dimension = model.system.operators, model.system.contact, model.case.mesh.dimension
    u, v = np.zeros(operators.size), np.zeros(operators.size)
    v[dimension - 1 :: dimension] = LANDING
    depth = contact.depth(np.zeros(contact.interface.size))
    return State(0.0, imaged(operators, u), imaged(operators, v), depth, np.zeros(contact.size))


def table(cells: tuple[int, ...] = CELLS) -> Table:
    """Return the table over the sizes."""
    found = [measured_apart("benchmarks.solves", "--one", str(count)) for count in cells]
    rows: list[tuple[Cell, ...]] = [
        (
            int(one["dofs"]),
            seconds(one["assembly"]),
            seconds(one["preconditioner"]),
            seconds(one["solve"]),
            round(one["iterations"], 1),
            f"{seconds(one['step'])} ({one['step_solves']:.0f} solves, {one['pressed']:.0f} points pressed)",
            gigabytes(one["memory"]),
        )
        for one in found
    ]
    powers = exponents(found, COSTS)
    return Table(
        "solves",
        "Conjugate gradients with multigrid in the degree: a solve, and a step with contact",
        ("DOFs", "assembly", "preconditioner", "solve to 1e-9", "iterations", "a step with contact", "peak memory"),
        tuple(rows),
        (
            machine_words(),
            "cost = a DOFs^b: " + ", ".join(f"{name} b = {power:.2f}" for name, power in powers.items()),
        ),
        {f"exponent_{name}": power for name, power in powers.items()} | {"largest_solve": found[-1]["solve"]},
    )


if __name__ == "__main__":
    if "--one" in sys.argv:
        measure(int(sys.argv[-1]))
    else:
        chosen = options(__doc__, ("large", "up to a million unknowns"))
        table(LARGE if chosen.large else CELLS).write(chosen.output)
