"""Differences between DOLFINx 0.9, 0.10 and 0.11 that meshes meet, and nowhere else in this folder."""

from __future__ import annotations

import importlib
import inspect
from types import ModuleType
from typing import Any

import numpy as np
import numpy.typing as npt
from dolfinx.mesh import GhostMode, Mesh, MeshTags, create_cell_partitioner
from mpi4py import MPI

from meshes.groups import CONTACT_FACES
from meshes.rank_zero import on_rank_zero
from meshes.slices import slices


def mesh_from_gmsh(comm: MPI.Comm, dimension: int, groups: dict[str, int]) -> tuple[Mesh, MeshTags, MeshTags]:
    """Distribute the current gmsh model of rank 0, with ghost cells across shared facets.

    The model has been checked: every cell is tagged once, one cell type, facet groups present.

    Args:
        comm: The ranks.
        dimension: Of the cells.
        groups: Tags of the facet groups by name.

    Returns:
        Mesh, cell tags, facet tags.

    Collective.
    """
    import gmsh

    read = _reader().model_to_mesh
    options: dict[str, Any] = {"partitioner": _partitioner(*_places(comm, dimension, groups))}
    if "ghost_mode" in inspect.signature(read).parameters:  # after 0.11 the reader hands it to the partitioner
        options = {"ghost_mode": GhostMode.shared_facet}
    # the fields after the third differ between the releases
    mesh, cells, facets = read(gmsh.model, comm, 0, gdim=dimension, **options)[:3]
    return mesh, cells, facets


def coordinate_element(mesh: Mesh) -> Any:
    """Map from the reference cell to the cells; 0.11 warns about the name that 0.9 knows."""
    geometry = mesh.geometry
    return geometry.cmaps[0] if hasattr(geometry, "cmaps") else geometry.cmap


def coordinate_dofs(mesh: Mesh) -> npt.NDArray[np.int32]:
    """Rows of `mesh.geometry.x` of each cell; 0.11 warns about the name that 0.9 knows."""
    geometry = mesh.geometry
    return np.asarray(geometry.dofmaps[0] if hasattr(geometry, "dofmaps") else geometry.dofmap)


def geometry_order(mesh: Mesh) -> int:
    """Polynomial order of the cells' shape."""
    return int(coordinate_element(mesh).degree)


def _reader() -> ModuleType:
    """The gmsh reader: dolfinx.io.gmshio in 0.9, dolfinx.io.gmsh from 0.10."""
    try:
        return importlib.import_module("dolfinx.io.gmsh")
    except ModuleNotFoundError:
        return importlib.import_module("dolfinx.io.gmshio")


def _places(comm: MPI.Comm, dimension: int, groups: dict[str, int]) -> tuple[npt.NDArray[np.float64], float]:
    """Return centers of the cells and the end of the support; on rank 0. Collective."""
    centers: list[npt.NDArray[np.float64]] = []

    def look() -> float:
        from meshes.cell_places import cell_centers, end_of

        centers.append(cell_centers(dimension))
        return end_of(dimension, groups, CONTACT_FACES)

    end = on_rank_zero(comm, look)
    return (centers[0] if centers else np.empty((0, 3))), end


def _partitioner(centers: npt.NDArray[np.float64], support: float) -> Any:
    """Slices across the beam; from 0.10 the largest number of cells at a facet may be wanted, too."""
    divide = slices(centers, support)
    try:
        return create_cell_partitioner(divide, GhostMode.shared_facet)
    except TypeError:
        return create_cell_partitioner(divide, GhostMode.shared_facet, 2)
