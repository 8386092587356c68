"""The gmsh model of rank 0, distributed to all ranks in slices across the beam."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from dolfinx.mesh import Mesh, MeshTags
from mpi4py import MPI

from gapbeam.meshes.beam_geometry import ENDS
from gapbeam.meshes.distribution.rank_zero import on_rank_zero
from gapbeam.meshes.distribution.slices import slices
from gapbeam.meshes.versions.gmsh_reader import read_model


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
    return read_model(comm, dimension, slices(*_places(comm, dimension, groups)))


def _places(comm: MPI.Comm, dimension: int, groups: dict[str, int]) -> tuple[npt.NDArray[np.float64], float]:
    """Return centers of the cells and the end of the last support; on rank 0. Collective."""
    centers: list[npt.NDArray[np.float64]] = []

    def look() -> float:
        from gapbeam.meshes.distribution.cell_positions import cell_centers, end_of

        centers.append(cell_centers(dimension))
        return end_of(dimension, groups, tuple(name for name in groups if name not in ENDS))

    end = on_rank_zero(comm, look)
    return (centers[0] if centers else np.empty((0, 3))), end
