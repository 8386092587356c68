"""Where a factorization no longer pays: conjugate gradients with GAMG on the effective operator, a few solves.

The solid beam of cases/li2013.toml, finer and finer; the preconditioner is given the rigid motions. Each size is
measured in a process of its own. `--large` goes up to a million unknowns.

    environment/run python3 -m benchmarks.iterative
    environment/run python3 -m benchmarks.iterative --large
"""

from __future__ import annotations

import sys
import time

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.fem import petsc as fem_petsc
from mpi4py import MPI
from petsc4py import PETSc

from benchmarks.apart import exponent, measured_apart, tell
from benchmarks.size import mesh_overrides
from benchmarks.table import Cell, Table, gigabytes, machine_words, options, seconds
from benchmarks.textbook import shaken
from solver.defaults import rayleigh
from solver.elasticity import elastic_forms
from solver.mesh_of_case import mesh_of_case
from solver.rigid_motions import rigid_motions

CELLS, LARGE = (4, 6), (4, 6, 8, 10, 14)  # across and through the beam
TOLERANCES = (1.0e-6, 1.0e-4)  # of the preconditioned residual
SOLVES = 3


def measure(cells: int) -> None:
    """Measure one size in this process and tell it."""
    case = shaken(overrides=mesh_overrides(cells))
    tagged = mesh_of_case(case, MPI.COMM_SELF)
    mesh = tagged.mesh
    space = fem.functionspace(mesh, ("Lagrange", case.mesh.degree, (3,)))
    faces = ufl.Measure("ds", domain=mesh, subdomain_data=tagged.facets)(
        (tagged.groups["base"], tagged.groups["gland"])
    )
    area = 2.0 * case.support.length * case.beam.width
    restraint = (case.restraint.axial / area, case.restraint.lateral / area)
    forms = elastic_forms(space, case.material, False, 1.0, restraint, faces)
    assert case.time.step != "auto"
    dt, (mass_damping, stiffness_damping) = case.time.step, rayleigh(case)
    mass, stiffness = 2.0 / dt + mass_damping, 0.5 * dt + stiffness_damping
    clock = time.perf_counter()
    matrix = fem_petsc.assemble_matrix(fem.form(mass * forms.mass + stiffness * (forms.stiffness + forms.restraint)))
    matrix.assemble()
    spent = {"assembly": time.perf_counter() - clock}
    matrix.setBlockSize(3)
    matrix.setOption(PETSc.Mat.Option.SPD, True)
    motions = [PETSc.Vec().createWithArray(np.ascontiguousarray(motion)) for motion in rigid_motions(space).T]
    matrix.setNearNullSpace(PETSc.NullSpace().create(vectors=motions, comm=mesh.comm))
    solver = PETSc.KSP().create(mesh.comm)
    solver.setOperators(matrix)
    solver.setType("cg")
    solver.getPC().setType("gamg")
    clock = time.perf_counter()
    solver.setUp()
    spent["setup"] = time.perf_counter() - clock
    # a rigid acceleration, an impact, noise: what steps ask for
    force, motion = matrix.createVecs()
    generator = np.random.default_rng(0)
    for tolerance in TOLERANCES:
        solver.setTolerances(rtol=tolerance, max_it=500)
        clock, iterations = time.perf_counter(), 0
        for _ in range(SOLVES):
            force.array[:] = generator.standard_normal(force.getLocalSize())
            solver.solve(force, motion)
            iterations += solver.getIterationNumber()
        spent[f"solve_{tolerance:g}"] = (time.perf_counter() - clock) / SOLVES
        spent[f"iterations_{tolerance:g}"] = iterations / SOLVES
    tell(spent | {"dofs": float(matrix.getSize()[0])})


def table(cells: tuple[int, ...] = CELLS) -> Table:
    """Return the table over the sizes."""
    found = [measured_apart("benchmarks.iterative", "--one", str(count)) for count in cells]
    rows: list[tuple[Cell, ...]] = [
        (
            int(one["dofs"]),
            seconds(one["assembly"]),
            seconds(one["setup"]),
            *(f"{seconds(one[f'solve_{t:g}'])} ({one[f'iterations_{t:g}']:.0f} iterations)" for t in TOLERANCES),
            gigabytes(one["memory"]),
        )
        for one in found
    ]
    last = found[-1]
    power = exponent([one["dofs"] for one in found], [one[f"solve_{TOLERANCES[0]:g}"] for one in found])
    return Table(
        "iterative",
        "Effective operator solved by conjugate gradients with GAMG",
        ("DOFs", "assembly", "GAMG set-up", *(f"solve to {t:g}" for t in TOLERANCES), "peak memory"),
        tuple(rows),
        (
            machine_words(),
            f"mean of {SOLVES} random right sides; solve = a DOFs^b, b = {power:.2f}",
            f"an estimate, not a run: 10 000 steps at {last['dofs']:.0f} DOFs would take "
            f"{1e4 * last[f'solve_{TOLERANCES[0]:g}'] / 3600.0:.0f} h by one solve to {TOLERANCES[0]:g} each; a "
            "reduced model needs some dozens of such solves once, and marches without them",
        ),
        {"exponent_solve": power, "largest_solve": last[f"solve_{TOLERANCES[0]:g}"]},
    )


if __name__ == "__main__":
    if "--one" in sys.argv:
        measure(int(sys.argv[-1]))
    else:
        chosen = options(__doc__, ("large", "up to a million unknowns"))
        table(LARGE if chosen.large else CELLS).write(chosen.output)
