"""DOLFINx's reader of gmsh models in DOLFINx 0.9 to 0.11 and after."""

from __future__ import annotations

import importlib
import inspect
from types import ModuleType
from typing import Any

from dolfinx.mesh import GhostMode, Mesh, MeshTags
from mpi4py import MPI

from gapbeam.meshes.versions.mesh_maker import partitioner


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
