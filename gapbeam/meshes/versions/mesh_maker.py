"""DOLFINx's meshes from arrays or from gmsh models, and its partitioners, in DOLFINx 0.9 to 0.11 and after."""

from __future__ import annotations

import importlib
import inspect
from types import ModuleType
from typing import Any

import basix
import basix.ufl
import numpy as np
from dolfinx.mesh import GhostMode, Mesh, MeshTags, create_cell_partitioner, create_mesh
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


def read_model(comm: MPI.Comm, dimension: int, divide: Any) -> tuple[Mesh, MeshTags, MeshTags]:
    """Distribute the current gmsh model of rank 0, with ghost cells across shared facets.

    Args:
        comm: The ranks.
        dimension: Dimension of the cells.
        divide: Function that divides the dual graph of the cells, see `gapbeam.meshes.distributed_mesh`.

    Returns:
        Mesh, cell tags, facet tags.

    Collective.
    """
    import gmsh

    read = _reader().model_to_mesh
    options: dict[str, Any] = {"partitioner": partitioner(divide)}
    if "ghost_mode" in inspect.signature(read).parameters:  # after 0.11 the reader hands it to the partitioner
        options = {"ghost_mode": GhostMode.shared_facet}
    # the fields after the third differ between the releases
    mesh, cells, facets = read(gmsh.model, comm, 0, gdim=dimension, **options)[:3]
    return mesh, cells, facets


def _reader() -> ModuleType:
    """Return the module that reads gmsh models: dolfinx.io.gmshio in 0.9, dolfinx.io.gmsh from 0.10."""
    try:
        return importlib.import_module("dolfinx.io.gmsh")
    except ModuleNotFoundError:
        return importlib.import_module("dolfinx.io.gmshio")
