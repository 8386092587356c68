"""Figures of a mesh: for reports, and for defaults that follow from the cell size."""

from __future__ import annotations

import math
from typing import TypedDict

import numpy as np
import numpy.typing as npt
from dolfinx.mesh import entities_to_geometry
from mpi4py import MPI

from gapbeam.meshes.beam_geometry import ENDS
from gapbeam.meshes.tagged_mesh import TaggedMesh
from gapbeam.meshes.versions.mesh_geometry import geometry_order


class Description(TypedDict):
    """The figures of a mesh; lengths in m."""

    cell: str
    geometry_order: int
    cells: int
    vertices: int
    facets: dict[str, int]
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    smallest_cell: float
    largest_cell: float
    mean_contact_facet_length: float


def describe(tagged: TaggedMesh) -> Description:
    """Count and measure a mesh.

    The size of a cell is the largest distance between two of its vertices. The mean contact facet length is
    the mean extent along x of the facets that face a support.

    Returns:
        The same figures on all ranks.

    Collective.
    """
    mesh, comm = tagged.mesh, tagged.mesh.comm
    owned = np.arange(mesh.topology.index_map(tagged.dimension).size_local, dtype=np.int32)
    sizes = mesh.h(tagged.dimension, owned)
    lengths = np.concatenate([_lengths_along_x(tagged, name) for name in tagged.groups if name not in ENDS])
    # gathered and summed alike everywhere: a reduction may round differently on different ranks
    parts = comm.allgather((math.fsum(lengths), len(lengths)))
    return Description(
        cell=mesh.topology.cell_name(),
        geometry_order=geometry_order(mesh),
        cells=tagged.cell_count,
        vertices=tagged.vertex_count,
        facets=dict(tagged.facet_counts),
        lower=tagged.lower,
        upper=tagged.upper,
        smallest_cell=comm.allreduce(float(np.min(sizes, initial=np.inf)), MPI.MIN),
        largest_cell=comm.allreduce(float(np.max(sizes, initial=0.0)), MPI.MAX),
        mean_contact_facet_length=math.fsum(part[0] for part in parts) / sum(part[1] for part in parts),
    )


def _lengths_along_x(tagged: TaggedMesh, group: str) -> npt.NDArray[np.float64]:
    """Extent along x of each facet of a group that this rank owns."""
    mesh, dimension = tagged.mesh, tagged.dimension
    facets = tagged.facets_of(group)
    if len(facets) == 0:  # DOLFINx 0.9 divides by this number
        return np.empty(0)
    mesh.topology.create_connectivity(dimension - 1, dimension)
    x = mesh.geometry.x[entities_to_geometry(mesh, dimension - 1, facets), 0]
    return np.asarray(np.ptp(x, axis=1), dtype=np.float64)
