"""Names of DOLFINx 0.9 to 0.11: coordinates of a mesh, lists of lists of partitioners, matrices with room for cells."""

from __future__ import annotations

from copy import copy
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from dolfinx.cpp.graph import AdjacencyList_int32
    from dolfinx.mesh import Mesh
    from petsc4py import PETSc

    from gapbeam.meshes.serial_mesh import SerialMesh

    Adjacency: TypeAlias = AdjacencyList_int32


def coordinate_element(mesh: Mesh | SerialMesh) -> Any:
    """Map from the reference cell to the cells; 0.11 warns about the name that 0.9 knows."""
    geometry = mesh.geometry
    return geometry.cmaps[0] if hasattr(geometry, "cmaps") else geometry.cmap


def coordinate_dofs(mesh: Mesh | SerialMesh) -> npt.NDArray[np.int32]:
    """Rows of `mesh.geometry.x` of each cell; 0.11 warns about the name that 0.9 knows."""
    geometry = mesh.geometry
    return np.asarray(geometry.dofmaps[0] if hasattr(geometry, "dofmaps") else geometry.dofmap)


def geometry_order(mesh: Mesh | SerialMesh) -> int:
    """Polynomial order of the cells' shape."""
    return int(coordinate_element(mesh).degree)


def adjacency(values: npt.NDArray[np.integer], starts: npt.NDArray[np.integer]) -> Adjacency:
    """Return a list of lists.

    Args:
        values: All lists, one after the other.
        starts: Index of the begin of each list, and of the end of the last one, (lists + 1,).
    """
    from dolfinx.cpp.graph import AdjacencyList_int32

    return AdjacencyList_int32(np.ascontiguousarray(values, np.int32), np.ascontiguousarray(starts, np.int32))


def cell_matrix(space: Any, cells: Any = None) -> Any:
    """Return an empty matrix on the DOFs of a space.

    Args:
        space: Blocked space.
        cells: The cells whose DOFs meet; None: all that this rank owns.

    Collective.
    """
    from dolfinx import cpp
    from dolfinx.cpp.la.petsc import create_matrix

    mesh, dofmap = space.mesh, space.dofmap
    chosen = np.arange(mesh.topology.index_map(mesh.topology.dim).size_local) if cells is None else np.unique(cells)
    pattern = cpp.la.SparsityPattern(mesh.comm, [dofmap.index_map] * 2, [dofmap.index_map_bs] * 2)
    for nodes in dofmap.list[chosen]:
        pattern.insert(nodes, nodes)
    pattern.finalize()
    return let_go(create_matrix(mesh.comm, pattern))


def let_go(made: PETSc.Mat) -> PETSc.Mat:
    """Return a matrix that DOLFINx made as one that is freed with its last name: DOLFINx never frees its own.

    Not collective.
    """
    matrix = copy(made)
    made.destroy()
    return matrix
