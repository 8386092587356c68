"""DOLFINx's meshes from arrays of nodes and cells, and its partitioners, in DOLFINx 0.9 to 0.11 and after."""

from __future__ import annotations

import inspect
from typing import Any

import basix
import basix.ufl
import numpy as np
from dolfinx.mesh import GhostMode, Mesh, create_cell_partitioner, create_mesh
from mpi4py import MPI


def made_mesh(comm: MPI.Comm, points: Any, cells: Any, order: int, divide: Any) -> Mesh:
    """Distribute nodes and four- or eight-cornered cells of rank 0, with ghost cells across shared facets.

    Args:
        comm: The ranks.
        points: Nodes, (n, d), m; (0, d) on other ranks.
        cells: Nodes of each cell, axis after axis, (m, (order + 1)^d); none on other ranks.
        order: Order of the cells.
        divide: Function that divides the dual graph of the cells, see `gapbeam.meshes.distributed_mesh`.

    Collective.
    """
    dimension = points.shape[1]
    cell = (basix.CellType.quadrilateral, basix.CellType.hexahedron)[dimension - 2]
    element = basix.create_element(basix.ElementFamily.P, cell, order, basix.LagrangeVariant.equispaced)
    places = np.rint(order * element.points).astype(int) @ (order + 1) ** np.arange(dimension)[::-1]
    shape = basix.ufl.element("Lagrange", cell.name, order, basix.LagrangeVariant.equispaced, shape=(dimension,))
    options: dict[str, Any] = {"partitioner": partitioner(divide)}
    if "ghost_mode" in inspect.signature(create_mesh).parameters:
        options["ghost_mode"] = GhostMode.shared_facet
    cells = np.ascontiguousarray(cells[:, places])
    return create_mesh(comm=comm, cells=cells, x=np.ascontiguousarray(points), e=shape, **options)


def partitioner(divide: Any) -> Any:
    """Return a partitioner of cells; from 0.10 it wants the largest number of cells at a facet, too."""
    try:
        return create_cell_partitioner(divide, GhostMode.shared_facet)
    except TypeError:
        return create_cell_partitioner(divide, GhostMode.shared_facet, 2)
