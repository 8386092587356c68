"""Differences between DOLFINx 0.9, 0.10 and 0.11 that meshes meet, and nowhere else in this folder."""

from __future__ import annotations

import inspect
from types import ModuleType
from typing import Any

from dolfinx.mesh import GhostMode, Mesh, MeshTags, create_cell_partitioner
from mpi4py import MPI


def mesh_from_gmsh(comm: MPI.Comm, dimension: int) -> tuple[Mesh, MeshTags, MeshTags]:
    """Distribute the current gmsh model of rank 0, with ghost cells across shared facets.

    The model has been checked: every cell is tagged once, one cell type, facet groups present.

    Returns:
        Mesh, cell tags, facet tags.

    Collective.
    """
    import gmsh

    read = _reader().model_to_mesh
    options: dict[str, Any] = {"partitioner": _partitioner()}
    if "ghost_mode" in inspect.signature(read).parameters:  # after 0.11 the reader hands it to the partitioner
        options = {"ghost_mode": GhostMode.shared_facet}
    # the fields after the third differ between the releases
    mesh, cells, facets = read(gmsh.model, comm, 0, gdim=dimension, **options)[:3]
    return mesh, cells, facets


def _reader() -> ModuleType:
    """The gmsh reader: dolfinx.io.gmshio in 0.9, dolfinx.io.gmsh from 0.10."""
    try:
        from dolfinx.io import gmsh as reader
    except ImportError:
        from dolfinx.io import gmshio as reader
    return reader


def _partitioner() -> Any:
    """The default partitioner; from 0.10 it may want the largest number of cells at a facet too."""
    try:
        return create_cell_partitioner(GhostMode.shared_facet)
    except TypeError:
        return create_cell_partitioner(GhostMode.shared_facet, 2)
