"""Factors on three ranks, one factor a rank and one between, against whole matrices; faults on all ranks."""

from __future__ import annotations

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc
from scipy.sparse import csr_matrix, diags, identity, kron, random
from scipy.sparse.linalg import spsolve

import gapbeam.solver.linear_algebra.substructured_factor as module
from gapbeam.solver.linear_algebra.substructured_factor import SubstructuredFactor, factor_on_ranks
from gapbeam.solver.messages.errors import RunError
from gapbeam.solver.system.operators import Interface

comm = MPI.COMM_WORLD
rng = np.random.default_rng(5)


def distributed(whole: csr_matrix, counts: list[int], block: int = 1) -> PETSc.Mat:
    """Return the rows of this rank of a matrix, as PETSc's."""
    mine = whole[sum(counts[: comm.rank]) : sum(counts[: comm.rank + 1])]
    pattern = mine.indptr.astype(PETSc.IntType), mine.indices.astype(PETSc.IntType), mine.data
    sizes = (counts[comm.rank], sum(counts))
    return PETSc.Mat().createAIJ((sizes, sizes), bsize=block, csr=pattern, comm=comm)


def chain(nodes: int, reach: int) -> csr_matrix:
    """Return a matrix of nodes in a row, each beside some others."""
    wide = diags([rng.uniform(0.1, 1.0, nodes) for _ in range(reach)], list(range(1, reach + 1)), (nodes, nodes))
    full = kron(wide + wide.T, np.ones((2, 2))) + 20.0 * reach * identity(2 * nodes)
    return csr_matrix(full)


def ring(nodes: int) -> csr_matrix:
    """Return a chain that is closed: every rank beside every other one."""
    return csr_matrix(chain(nodes, 2) + kron(diags([-0.5, -0.5], [nodes - 1, 1 - nodes], (nodes, nodes)), np.eye(2)))


cases = {
    "chain": (chain(150, 3), [100, 120, 80], 2),
    "ring": (ring(90), [60, 60, 60], 2),
    "no unknowns on a rank": (chain(30, 2), [20, 0, 40], 2),
    "hardly any": (chain(4, 2), [2, 4, 2], 2),
    "uncoupled": (csr_matrix(diags(rng.uniform(1.0, 2.0, 40))), [10, 10, 20], 1),
}
for _name, (whole, counts, block) in cases.items():
    first, size = sum(counts[: comm.rank]), sum(counts)
    mine = slice(first, first + counts[comm.rank])
    right = rng.standard_normal(size)
    held = np.sort(rng.permutation(size)[: size // 2])
    here = np.flatnonzero((held >= mine.start) & (held < mine.stop))
    interface = Interface(len(held), held[here] - first, here)
    columns = csr_matrix(random(len(held), 70, 0.3, random_state=3))
    spread = np.zeros((size, 70))
    spread[held] = columns.toarray()
    for limit in (None, 0.0):
        factor = factor_on_ranks(distributed(whole, counts, block), "test_", comm.allreduce, limit)
        assert isinstance(factor, SubstructuredFactor)
        expected, block_expected = spsolve(whole.tocsc(), right), spsolve(whole.tocsc(), spread)
        np.testing.assert_allclose(factor.solve(right[mine]), expected[mine], rtol=0.0, atol=1e-13)
        np.testing.assert_allclose(factor.solve_columns(interface, columns), block_expected[mine], rtol=0.0, atol=1e-13)
        assert factor.keeps(1) == (limit is None)
whole, counts, _ = cases["chain"]
module.MOST_INTERFACE = 3
assert not isinstance(factor_on_ranks(distributed(whole, counts, 2), "test_", comm.allreduce), SubstructuredFactor)
module.MOST_INTERFACE = 4000
try:
    factor_on_ranks(distributed(csr_matrix(whole - 1e3 * identity(300)), counts, 2), "test_", comm.allreduce)
except RunError as error:
    assert "could not be factored" in str(error)
else:
    raise SystemExit("a matrix that is not positive was factored")
