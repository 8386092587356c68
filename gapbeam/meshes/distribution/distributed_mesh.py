"""The gmsh model of rank 0, distributed to all ranks in slices across the beam."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from dolfinx.mesh import Mesh, MeshTags
from mpi4py import MPI

from gapbeam.meshes.distribution.rank_zero import on_rank_zero
from gapbeam.meshes.distribution.slices import slices
from gapbeam.meshes.versions.gmsh_reader import read_model


def mesh_from_gmsh(comm: MPI.Comm, dimension: int, end: Callable[[], float]) -> tuple[Mesh, MeshTags, MeshTags]:
    """Distribute the current gmsh model of rank 0, with ghost cells across shared facets.

    The model has been checked: every cell is tagged once, one cell type, facet groups present.

    Args:
        comm: The ranks.
        dimension: Of the cells.
        end: Called on rank 0; returns where the last support ends, m.

    Returns:
        Mesh, cell tags, facet tags.

    Collective.
    """
    centers: list[npt.NDArray[np.float64]] = []

    def look() -> float:
        from gapbeam.meshes.distribution.cell_positions import cell_centers

        centers.append(cell_centers(dimension))
        return end()

    support = on_rank_zero(comm, look)
    return read_model(comm, dimension, slices(centers[0] if centers else np.empty((0, 3)), support))
