"""Memory that a finite element model needs, from the number of its DOFs.

    factor: 11.5 GB (n / 1e6)^1.1 in 3D, 0.05 kB n log2(n) in 2D; mesh and matrices: 8 kB n in 3D, 3 kB n in 2D;
    what iterations need beside them, a preconditioner instead of the factor: 6 kB n in 3D, 2 kB n in 2D

Fitted to what MUMPS and whole runs took for beams of 28 000 to 1 000 000 DOFs with cells of degree 2
(docs/benchmarks/large-models.md).
Stout bodies need more of a factor than slender ones.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import log2

FACTOR_OF_MILLION, GROWTH = 11.5e9, 1.1
FACTOR_2D = 50.0
MATRICES = {2: 3.0e3, 3: 8.0e3}
COPIES, SHAPES = 5, 1000  # of the shapes of beam elements that are held at once, and how many there are at most
PRECONDITIONER = {2: 2.0e3, 3: 6.0e3}


@dataclass(frozen=True)
class MemoryNeeds:
    """Memory that a model needs over all ranks, bytes.

    Attributes:
        matrices: Mesh, M, K and an effective operator.
        factor: The Cholesky factor of an effective operator.
        preconditioner: Preconditioner of conjugate gradients instead.
    """

    matrices: float
    factor: float
    preconditioner: float


def beam_needs(dofs: float) -> float:
    """Return the memory of beam elements of so many DOFs, bytes: the shapes of a basis, of at most as many columns."""
    return 8.0 * COPIES * dofs * min(dofs, SHAPES)


def memory_needs(dofs: float, dimension: int) -> MemoryNeeds:
    """Return the memory that a model of so many DOFs needs, 2D or 3D."""
    factor = FACTOR_OF_MILLION * (dofs / 1.0e6) ** GROWTH if dimension == 3 else FACTOR_2D * dofs * log2(dofs + 1.0)
    return MemoryNeeds(MATRICES[dimension] * dofs, factor, PRECONDITIONER[dimension] * dofs)
