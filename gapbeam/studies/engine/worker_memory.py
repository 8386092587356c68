"""Memory of a worker: the libraries, and the largest model of the study by the estimate that `run` uses."""

from __future__ import annotations

from collections.abc import Iterable

from gapbeam.meshes.mesh_errors import MeshError
from gapbeam.solver.case.case import Case
from gapbeam.solver.memory.memory_check import expected_dofs, memory_of

LIBRARIES = 0.5e9  # bytes: DOLFINx, PETSc, numba and the rest, and a small model
RECORDS = 0.25e9  # bytes: histories and bases, which the estimate leaves out


def worker_memory(cases: Iterable[Case]) -> float | None:
    """Return the approximate memory of one worker for the largest case, bytes; None where a mesh file decides it."""
    largest, seen = 0.0, set[str]()
    for case in cases:
        key = repr((case.mesh, case.beam, case.model, case.segment))
        if key in seen:
            continue
        seen.add(key)
        try:
            dofs = expected_dofs(case)
        except MeshError:  # the point itself will say so
            continue
        if dofs is None:
            return None
        largest = max(largest, sum(memory_of(case, dofs).values()))
    return LIBRARIES + RECORDS + largest
