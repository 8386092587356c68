"""DOLFINx's index maps from the owners of ghosts, by the one call that 0.9 to 0.11 share.

The shorter call, which finds out by itself who needs what, takes a tag from 0.10 on and refuses it before.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from dolfinx.common import IndexMap
from mpi4py import MPI


def index_map(comm: MPI.Comm, owned: int, ghosts: npt.NDArray[np.integer], owners: npt.NDArray[np.integer]) -> IndexMap:
    """Return the index map of indices that are numbered rank by rank.

    Args:
        comm: The ranks.
        owned: Number of indices that this rank owns.
        ghosts: Global numbers of the indices of other ranks that this rank uses, (ghosts,).
        owners: The rank that owns each of them, (ghosts,).

    Collective.
    """
    sources = np.unique(owners).astype(np.int32)
    uses = [rank in sources for rank in range(comm.size)]
    destinations = np.flatnonzero(comm.alltoall(uses)).astype(np.int32)
    return IndexMap(comm, owned, [sources, destinations], ghosts.astype(np.int64), owners.astype(np.int32))
