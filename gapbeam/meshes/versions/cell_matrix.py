"""PETSc matrices with room for the DOFs of cells that meet, in DOLFINx 0.9 to 0.11."""

from __future__ import annotations

from typing import Any

import numpy as np
from dolfinx import cpp
from dolfinx.cpp.la.petsc import create_matrix


def cell_matrix(space: Any, cells: Any = None) -> Any:
    """Return an empty matrix on the DOFs of a space.

    Args:
        space: Blocked space.
        cells: The cells whose DOFs meet; None: all that this rank owns.

    Collective.
    """
    mesh, dofmap = space.mesh, space.dofmap
    chosen = np.arange(mesh.topology.index_map(mesh.topology.dim).size_local) if cells is None else np.unique(cells)
    pattern = cpp.la.SparsityPattern(mesh.comm, [dofmap.index_map] * 2, [dofmap.index_map_bs] * 2)
    for nodes in dofmap.list[chosen]:
        pattern.insert(nodes, nodes)
    pattern.finalize()
    return create_matrix(mesh.comm, pattern)
