"""Cells distributed to the ranks in slices across the beam, the same in every run."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from dolfinx.cpp.graph import AdjacencyList_int32
from scipy.sparse import csr_array
from scipy.sparse.csgraph import reverse_cuthill_mckee


def slices(_comm: Any, parts: int, neighbors: Any, ghosting: bool) -> AdjacencyList_int32:
    """Divide the dual graph of a mesh, whose cells are all on rank 0, into parts of equal size.

    The cells are ordered by the reverse Cuthill-McKee method, which goes from one end of a slender body to
    the other, and cut into consecutive parts. PT-Scotch, the default of DOLFINx, balances as well but does
    not always give the same parts.

    Args:
        parts: Number of parts.
        neighbors: Adjacency list of the cells that share a facet.
        ghosting: Whether a cell goes to the ranks of its neighbors, too.

    Returns:
        Adjacency list: for each cell its rank, then the ranks where it is a ghost.

    Source: Cuthill and McKee (1969); George (1971) for the reverse order.
    """
    offsets = np.asarray(neighbors.offsets, dtype=np.int32)
    links = np.asarray(neighbors.array, dtype=np.int32)
    count = len(offsets) - 1
    if count == 0:
        return AdjacencyList_int32(np.empty(0, dtype=np.int32), np.zeros(1, dtype=np.int32))
    graph = csr_array((np.ones(len(links), dtype=np.int8), links, offsets), shape=(count, count))
    owner = np.empty(count, dtype=np.int32)
    owner[reverse_cuthill_mckee(graph, symmetric_mode=True)] = np.arange(count) * parts // count
    destinations = np.column_stack([np.arange(count), owner])
    if ghosting:
        cells = np.repeat(np.arange(count), np.diff(offsets))
        foreign = owner[links] != owner[cells]
        ghosts = np.unique(np.column_stack([cells[foreign], owner[links[foreign]]]), axis=0)
        destinations = np.concatenate([destinations, ghosts])
    # stable: the owner stays in front of the ghosts
    destinations = destinations[np.argsort(destinations[:, 0], kind="stable")]
    return AdjacencyList_int32(_int32(destinations[:, 1]), _int32(_starts(destinations[:, 0], count)))


def _starts(sorted_cells: npt.NDArray[np.int64], count: int) -> npt.NDArray[np.int64]:
    return np.searchsorted(sorted_cells, np.arange(count + 1))


def _int32(values: npt.NDArray[np.int64]) -> npt.NDArray[np.int32]:
    return np.ascontiguousarray(values, dtype=np.int32)
