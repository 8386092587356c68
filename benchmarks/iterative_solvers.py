"""Comparison of gapbeam's conjugate gradients, multigrid and LOBPCG with PETSc's and SLEPc's, on the same operator.

The operator is K + sigma M of the solid beam of cases/li2013.toml, as a reduced basis needs it. One right side is the
force of the shaker, the others are pressures on the contact faces. PETSc's solver is `benchmarks.petsc_multigrid`;
SLEPc's LOBPCG finds the lowest 30 modes with the products and the V-cycle of gapbeam. Each row is measured in a process
of its own, in processor time. Memory is the peak beyond mesh, M, K and K + sigma M.

    environment/run python3 -m benchmarks.iterative_solvers
    environment/run python3 -m benchmarks.iterative_solvers --large
"""

from __future__ import annotations

import gc
import sys
import time
from collections.abc import Callable
from math import pi
from pathlib import Path

import numpy as np
from mpi4py import MPI

from benchmarks.apart import measured_apart, print_figures
from benchmarks.petsc_multigrid import SMOOTHERS, PetscMultigrid
from benchmarks.size import mesh_overrides
from benchmarks.slepc_modes import slepc_modes
from benchmarks.table import Cell, Table, gigabytes, machine_words, options, seconds
from benchmarks.textbook import shaken
from gapbeam.solver.case.computed_defaults import overhang_frequency
from gapbeam.solver.linear_algebra.iterative.deflation import Deflation
from gapbeam.solver.linear_algebra.iterative.iterative_factor import ConjugateGradients
from gapbeam.solver.linear_algebra.petsc_operators import PetscOperators
from gapbeam.solver.linear_algebra.rigid_body_modes import rigid_body_modes
from gapbeam.solver.models.model import Model, build_model
from gapbeam.solver.models.reduction.lobpcg import lowest_shapes
from gapbeam.solver.system.operators import Array

OURS, SLEPC = "gapbeam", "SLEPc LOBPCG, V-cycle of gapbeam"
CELLS, LARGE = (4,), (4, 8)  # across and through the beam
SMALL = 2  # cells of a first run, which loads and compiles what the second one uses
COLUMNS, MODES = 16, 30
ONE_BY_ONE = 4  # columns that PETSc solves: KSPMatSolve with KSPCG goes through them one after the other
SHAPES, RESIDUAL = 1.0e-7, 2.0e-7  # of modes: error in the energy norm; SLEPc's residual, which leaves about that error
TOLERANCE = 1.0e-9


def measure_solves(cells: int, way: str) -> None:
    """Measure the solves of one way on one mesh in this process and print them."""
    for count in (SMALL, cells):
        model = _model(count)
        figures = _solves(model, way)
    print_figures(figures)


def measure_modes(cells: int, way: str) -> None:
    """Measure the modes of one way on one mesh in this process and print them."""
    for count in (SMALL, cells):
        model = _model(count)
        figures = _modes(model, way)
    print_figures(figures)


def _model(cells: int) -> Model:
    return build_model(shaken(overrides=[*mesh_overrides(cells), "solver.effective=iterative"]), MPI.COMM_SELF)


def _solves(model: Model, way: str) -> dict[str, float]:
    make, right_sides = _factor(model, way), _right_sides(model)
    base = _reset_peak()
    clock = time.process_time()
    factor = make()
    setup = time.process_time() - clock
    times = []
    together = COLUMNS if way == OURS else ONE_BY_ONE
    for count in (1, 1, together):
        before, clock = factor.iterations, time.process_time()
        factor.solve_block(right_sides[:, :count])
        times.append((time.process_time() - clock) / count)
    return {
        "dofs": float(model.dofs),
        "setup": setup,
        "one": min(times[:2]),
        "of_many": times[2],
        "iterations": (factor.iterations - before) / together,
        "peak": _resident("VmHWM") - base,
    }


def _modes(model: Model, way: str) -> dict[str, float]:
    make, operators = _factor(model, OURS), model.system.operators
    base = _reset_peak()
    factor = make()
    assert isinstance(factor, ConjugateGradients)

    def multiply_mass(x: Array) -> Array:
        return np.stack([operators.apply_mass(np.ascontiguousarray(column)) for column in x.T], axis=1)

    clock = time.process_time()
    if way == OURS:
        values, shapes, _ = lowest_shapes(factor, multiply_mass, MODES, SHAPES)
    else:
        values, shapes = slepc_modes(factor, multiply_mass, MODES, RESIDUAL)
    spent, peak = time.process_time() - clock, _resident("VmHWM")
    shapes = shapes * np.sqrt(1.0 / (values * np.einsum("ij,ij->j", shapes, multiply_mass(shapes))))
    residual = factor.multiply(shapes) - multiply_mass(shapes) * values
    errors = np.sqrt(np.maximum(factor.dots(residual, factor.precondition(residual)), 0.0))
    return {"dofs": float(model.dofs), "modes": spent, "error": float(errors.max()), "peak": peak - base}


def _factor(model: Model, way: str) -> Callable[[], ConjugateGradients | PetscMultigrid]:
    """Return a function that makes the solver for K + sigma M; the matrix is assembled before."""
    operators, space = model.system.operators, model.space
    assert isinstance(operators, PetscOperators)
    shift = (2.0 * pi * overhang_frequency(model.case)) ** 2
    mass, matrix = operators.matrices()
    matrix.axpy(shift, mass)
    mass.destroy()
    modes = rigid_body_modes(space)
    images = np.stack(
        [shift * operators.apply_mass(mode) + operators.apply_restraint(mode) for mode in modes.T], axis=1
    )
    if way == OURS:
        return lambda: ConjugateGradients(matrix, space, modes, operators, "ours_", TOLERANCE, None, images)
    return lambda: PetscMultigrid(matrix, space, Deflation(modes, images, operators.sum), way, TOLERANCE)


def _right_sides(model: Model) -> Array:
    """Return the force of the shaker and waves of pressure on the contact faces, (n, `COLUMNS`)."""
    contact = model.system.contact
    result = np.zeros((model.system.operators.size, COLUMNS))
    result[:, 0] = next(load.pattern for load in model.system.loads if not load.static)
    along = np.linspace(0.0, pi, contact.size)
    for number in range(1, COLUMNS):
        contact.interface.add(result[:, number], contact.resultant(contact.weights * np.cos(number * along)))
    return result


def _reset_peak() -> float:
    """Set the peak of resident memory to what is resident now, and return that, bytes."""
    gc.collect()
    Path("/proc/self/clear_refs").write_text("5")
    return _resident("VmRSS")


def _resident(name: str) -> float:
    lines = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text().splitlines())
    return 1024.0 * float(lines[name].split()[0])


def table(cells: tuple[int, ...] = CELLS, with_modes: bool = True) -> Table:
    """Return the table over sizes and ways."""
    rows: list[tuple[Cell, ...]] = []
    figures: dict[str, Cell] = {}
    for count in cells:
        for way in (OURS, *SMOOTHERS):
            found = measured_apart("benchmarks.iterative_solvers", "--solves", str(count), way)
            label = way if way == OURS else f"KSPCG, PCMG: {way}"
            times = (seconds(found[name]) for name in ("setup", "one", "of_many"))
            rows.append((int(found["dofs"]), label, *times, round(found["iterations"], 1), gigabytes(found["peak"])))
            figures |= {f"{way}, {found['dofs']:.0f}: {name}": found[name] for name in ("one", "of_many", "peak")}
    notes = [
        machine_words(),
        "processor time; error 1e-9 in the energy norm",
    ]
    for way in (OURS, SLEPC) if with_modes else ():
        found = measured_apart("benchmarks.iterative_solvers", "--modes", str(cells[0]), way)
        notes.append(
            f"{MODES} modes of {found['dofs']:.0f} DOFs, {way}: {seconds(found['modes'])}, "
            f"{gigabytes(found['peak'])}, largest error {found['error']:.1e}"
        )
        figures |= {f"{way}: {name}": found[name] for name in ("modes", "peak", "error")}
    return Table(
        "iterative_solvers",
        "Iterative solvers of gapbeam and of PETSc",
        ("DOFs", "solver", "set-up", "one column", f"each of {COLUMNS} columns", "iterations of each", "peak memory"),
        tuple(rows),
        tuple(notes),
        figures,
    )


if __name__ == "__main__":
    if "--solves" in sys.argv:
        measure_solves(int(sys.argv[-2]), sys.argv[-1])
    elif "--modes" in sys.argv:
        measure_modes(int(sys.argv[-2]), sys.argv[-1])
    else:
        chosen = options(__doc__, ("large", "195 075 DOFs as well: some 20 minutes"))
        table(LARGE if chosen.large else CELLS).write(chosen.output)
