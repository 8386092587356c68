"""A factor on every rank and one between: against whole matrices, and the same bits in every run."""

from __future__ import annotations

import multiprocessing
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from solver.separators import smallest_cover
from tests.command import PROJECT, RATTLE, alone, on_ranks, settings
from tests.interrupted import differing

pytestmark = alone

AGAINST_WHOLE = """
import numpy as np
from mpi4py import MPI
from petsc4py import PETSc
from scipy.sparse import csr_matrix, diags, kron, identity, random
from scipy.sparse.linalg import spsolve
import solver.sliced_factor as module
from solver.errors import RunError
from solver.operators import Interface
from solver.sliced_factor import SlicedFactor, factor_on_ranks

comm = MPI.COMM_WORLD
rng = np.random.default_rng(5)

def distributed(whole, counts, block=1):
    mine = whole[sum(counts[: comm.rank]) : sum(counts[: comm.rank + 1])]
    pattern = mine.indptr.astype(PETSc.IntType), mine.indices.astype(PETSc.IntType), mine.data
    sizes = (counts[comm.rank], sum(counts))
    return PETSc.Mat().createAIJ((sizes, sizes), bsize=block, csr=pattern, comm=comm)

def chain(nodes, reach):
    wide = diags([rng.uniform(0.1, 1.0, nodes) for _ in range(reach)], list(range(1, reach + 1)), (nodes, nodes))
    full = kron(wide + wide.T, np.ones((2, 2))) + 20.0 * reach * identity(2 * nodes)
    return csr_matrix(full)

def ring(nodes):  # every rank beside every other one
    return csr_matrix(chain(nodes, 2) + kron(diags([-0.5, -0.5], [nodes - 1, 1 - nodes], (nodes, nodes)), np.eye(2)))

cases = {
    "chain": (chain(150, 3), [100, 120, 80], 2),
    "ring": (ring(90), [60, 60, 60], 2),
    "no unknowns on a rank": (chain(30, 2), [20, 0, 40], 2),
    "hardly any": (chain(4, 2), [2, 4, 2], 2),
    "uncoupled": (csr_matrix(diags(rng.uniform(1.0, 2.0, 40))), [10, 10, 20], 1),
}
for name, (whole, counts, block) in cases.items():
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
        assert isinstance(factor, SlicedFactor)
        expected, block_expected = spsolve(whole.tocsc(), right), spsolve(whole.tocsc(), spread)
        np.testing.assert_allclose(factor.solve(right[mine]), expected[mine], rtol=0.0, atol=1e-13)
        np.testing.assert_allclose(factor.solve_columns(interface, columns), block_expected[mine], rtol=0.0, atol=1e-13)
        assert factor.keeps(1) == (limit is None)
whole, counts, _ = cases["chain"]
module.MOST_SEPARATORS = 3
assert not isinstance(factor_on_ranks(distributed(whole, counts, 2), "test_", comm.allreduce), SlicedFactor)
module.MOST_SEPARATORS = 4000
try:
    factor_on_ranks(distributed(csr_matrix(whole - 1e3 * identity(300)), counts, 2), "test_", comm.allreduce)
except RunError as error:
    assert "could not be factored" in str(error)
else:
    raise SystemExit("a matrix that is not positive was factored")
"""


def test_covers_are_smallest() -> None:
    """Small graphs: all edges are covered, and by trial of all smaller sets, none of them would do."""
    rng = np.random.default_rng(1)
    for _ in range(40):
        edges = np.unique(np.column_stack([rng.integers(0, 5, 9), 10 + rng.integers(0, 5, 9)]), axis=0)
        found = set(smallest_cover(edges).tolist())
        assert all(one in found or other in found for one, other in edges.tolist())
        for fewer in combinations(np.unique(edges).tolist(), len(found) - 1):
            assert not all(one in fewer or other in fewer for one, other in edges.tolist())
    assert len(smallest_cover(np.empty((0, 2), dtype=np.int64))) == 0


def test_sliced_factor_is_that_of_the_whole_matrix() -> None:
    """Three ranks: chains and rings of nodes, ranks without unknowns, with and without kept columns; faults on all."""
    done = on_ranks(3, program=AGAINST_WHOLE)
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
@pytest.mark.parametrize(("count", "times", "cells"), [(2, 6, 4), (3, 4, 2)])
def test_repeated_runs_are_the_same(count: int, times: int, cells: int, tmp_path: Path) -> None:
    """cases/li2013.toml until it has left and met both faces: no bit differs, whatever else runs.

    29 000 DOFs on two ranks; fewer on three, which wait busily for each other where there are two cores.
    """
    across = (f"mesh.cells_through_thickness={cells}", f"mesh.cells_across_width={cells}")
    keys = (*RATTLE, *across, "time.end=0.012", "output.fields_interval=2e-3")
    for number in range(times):
        load = [multiprocessing.Process(target=_busy, daemon=True) for _ in range(number % 3)]
        for one in load:
            one.start()
        folder = tmp_path / str(number)
        done = on_ranks(count, "run", PROJECT / "cases" / "li2013.toml", "--output", folder, *settings(*keys))
        for one in load:
            one.terminate()
            one.join()
        assert done.returncode == 0, done.stderr
        assert differing(tmp_path / "0", folder) == []


def _busy() -> None:
    while True:
        pass
