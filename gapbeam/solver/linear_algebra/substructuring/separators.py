"""Interface unknowns of a distributed matrix: without them the unknowns of two ranks are not coupled.

Entries between nodes of two ranks are the edges of a bipartite graph. Its smallest vertex cover separates the two
ranks. For a mesh that is cut into slices the cover is the cross-section of nodes at each cut.

Source: König (1931): in a bipartite graph the smallest cover and the largest matching have the same size.
"""

from __future__ import annotations

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import breadth_first_order, maximum_bipartite_matching

from gapbeam.meshes.distribution.rank_zero import on_rank_zero
from gapbeam.solver.system.operators import Indices

Edges = NDArray[np.int64]


def interface_unknowns(comm: MPI.Comm, rows: csr_matrix, starts: Indices, block: int) -> Indices:
    """Return the unknowns that separate the ranks, by number over all ranks, ascending, the same in every call.

    Args:
        comm: The ranks.
        rows: The rows of this rank of a symmetric matrix, (n, N).
        starts: First row of each rank and the number of all, (ranks + 1,).
        block: Unknowns per node, which are kept together.

    Collective.
    """
    first, end = starts[comm.rank : comm.rank + 2]
    owner = np.repeat(np.arange(comm.size), np.diff(starts))
    # edges to higher ranks only: the lower ranks report the others
    later = np.flatnonzero(rows.indices >= end)
    here = np.searchsorted(rows.indptr, later, side="right") - 1 + first
    edges = np.unique(np.column_stack([here, rows.indices[later]]).astype(np.int64) // block, axis=0)
    parts = comm.gather(edges)

    def cover() -> Indices:
        assert parts is not None
        chosen = np.zeros(int(starts[-1]) // block, dtype=bool)
        whole = np.concatenate(parts)
        ranks = owner[whole * block]
        for pair in np.unique(ranks, axis=0):
            between = whole[np.all(ranks == pair, axis=1)]
            chosen[smallest_cover(between[~np.any(chosen[between], axis=1)])] = True
        return np.flatnonzero(chosen)

    nodes = on_rank_zero(comm, cover)
    return np.asarray((nodes[:, None] * block + np.arange(block)).reshape(-1))


def smallest_cover(edges: Edges) -> Indices:
    """Return the fewest vertices that touch all edges, (edges, 2), between vertices of two kinds."""
    left, one = np.unique(edges[:, 0], return_inverse=True)
    right, other = np.unique(edges[:, 1], return_inverse=True)
    graph = csr_matrix((np.ones(len(edges)), (one, other)), (len(left), len(right)))
    matched = maximum_bipartite_matching(graph, perm_type="row")  # of each right vertex, or -1
    free = np.setdiff1d(np.arange(len(left)), matched)
    # König: alternating paths from unmatched left vertices, to the right by any edge, to the left by matched edges.
    pairs, root = np.flatnonzero(matched >= 0), len(left) + len(right)
    paths = np.concatenate(
        [
            np.column_stack([np.full(len(free), root), free]),
            np.column_stack([one, len(left) + other]),
            np.column_stack([len(left) + pairs, matched[pairs]]),
        ]
    )
    directed = csr_matrix((np.ones(len(paths)), (paths[:, 0], paths[:, 1])), (root + 1, root + 1))
    reached = np.zeros(root + 1, dtype=bool)
    reached[breadth_first_order(directed, root, return_predecessors=False)] = True
    return np.concatenate([left[~reached[: len(left)]], right[reached[len(left) : root]]])
