"""Choice of the linear solver of an effective operator: a factor as long as it fits in memory, iterations beyond.

A factor costs most when it is made and solves in milliseconds; conjugate gradients need a fraction of its memory and
dozens of products for every solve (docs/benchmarks/large-models.md). Between the two lies a factor without the columns
A^-1 G^T: it needs less memory, and a step takes two back-substitutions instead of one.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

from gapbeam.solver.case.solution_tables import SolverTable
from gapbeam.solver.memory.memory_estimate import MemoryNeeds

GIGABYTE = 1.0e9
OF_SQUARES = 1.0e-3  # of the tolerance, that squares of errors keep to
USED = 0.9  # of the memory that is free: the rest is for what is written and for other processes


@dataclass(frozen=True)
class LinearSolver:
    """Choice of the solver for effective operators.

    Attributes:
        iterative: By conjugate gradients; otherwise by a factor.
        tolerance: Of conjugate gradients: the error over the solution, in the energy norm of the operator.
        columns_limit: Bytes that the columns A^-1 G^T may take over all ranks; None: no limit.
        reason: Why, in a few words.
    """

    iterative: bool = False
    tolerance: float = 1.0e-9
    columns_limit: float | None = None
    reason: str = "given"

    @property
    def basis_tolerance(self) -> float:
        """Tolerance for vectors of a basis: an error of 1e-6 in them is one of 1e-12 in the energies they span."""
        return max(self.tolerance, sqrt(OF_SQUARES * self.tolerance))


FACTORED = LinearSolver()


def linear_solver(
    settings: SolverTable, needs: MemoryNeeds, free: float, needs_factor: str | None = None
) -> LinearSolver:
    """Return the linear solver of a model.

    Args:
        settings: The table [solver] of the case.
        needs: Memory that the model needs.
        free: Memory that is free over all machines, bytes.
        needs_factor: Part of the case that needs a factor, or None.
    """
    room = settings.memory * GIGABYTE if settings.memory is not None else USED * free
    left = room - needs.matrices - needs.factor
    columns = {"keep": None, "drop": 0.0, "auto": max(left, 0.0)}[settings.columns]
    words = (
        f"a factor of about {needs.factor / GIGABYTE:.2g} GB besides {needs.matrices / GIGABYTE:.2g} GB of mesh and "
        f"matrices, {room / GIGABYTE:.3g} GB may be used"
    )
    if settings.effective == "iterative" or (settings.effective == "auto" and needs_factor is None and left < 0.0):
        reason = "given" if settings.effective == "iterative" else words
        return LinearSolver(True, settings.tolerance, columns, reason)
    reason = "given" if settings.effective == "factor" else words
    if needs_factor is not None and left < 0.0:
        reason += f"; {needs_factor} needs a factor all the same"
    return LinearSolver(False, settings.tolerance, columns, reason)
