"""A mesh whose contact faces have names."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
from dolfinx.mesh import Mesh, MeshTags
from mpi4py import MPI


@dataclass(frozen=True)
class TaggedMesh:
    """A distributed mesh with named groups of facets.

    Attributes:
        mesh: the DOLFINx mesh; ghost cells across shared facets.
        cells: tags of the cells; None when they are all alike.
        facets: tags of the facets in `groups`.
        groups: name of a facet group to its tag: those that face a support always, end (x = 0) and tip (x = length)
            perhaps.
        lower: smallest coordinates of all nodes, m.
        upper: largest coordinates of all nodes, m.
        cell_count: cells on all ranks.
        vertex_count: vertices on all ranks.
        facet_counts: facets of each group on all ranks.
    """

    mesh: Mesh
    cells: MeshTags | None
    facets: MeshTags
    groups: dict[str, int]
    lower: tuple[float, ...] = field(init=False)
    upper: tuple[float, ...] = field(init=False)
    cell_count: int = field(init=False)
    vertex_count: int = field(init=False)
    facet_counts: dict[str, int] = field(init=False)

    def __post_init__(self) -> None:
        """Count and measure. Collective."""
        mesh, dimension = self.mesh, self.dimension
        x = mesh.geometry.x[:, :dimension]
        lower = np.min(x, axis=0, initial=np.inf)
        upper = np.max(x, axis=0, initial=-np.inf)
        comm = mesh.comm
        counts = {name: comm.allreduce(len(self.facets_of(name))) for name in self.groups}
        found = {
            "lower": tuple(comm.allreduce(float(value), MPI.MIN) for value in lower),
            "upper": tuple(comm.allreduce(float(value), MPI.MAX) for value in upper),
            "cell_count": mesh.topology.index_map(dimension).size_global,
            "vertex_count": mesh.topology.index_map(0).size_global,
            "facet_counts": counts,
        }
        for name, value in found.items():
            object.__setattr__(self, name, value)

    @property
    def dimension(self) -> int:
        """2 or 3, of the mesh and of the space that it is in."""
        return int(self.mesh.topology.dim)

    def facets_of(self, group: str) -> npt.NDArray[np.int32]:
        """Indices of the facets of a group that this rank owns."""
        found = self.facets.find(self.groups[group])
        owned = self.mesh.topology.index_map(self.dimension - 1).size_local
        return np.asarray(found[found < owned], dtype=np.int32)
