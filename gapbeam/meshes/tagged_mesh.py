"""Mesh of a straight beam with named contact faces, made on rank 0 and distributed: layers, or by gmsh."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
from dolfinx.mesh import Mesh, MeshTags
from mpi4py import MPI

from gapbeam.meshes.beam_geometry import BODY, BeamGeometry, groups_of
from gapbeam.meshes.distribution.distributed_mesh import mesh_from_gmsh
from gapbeam.meshes.distribution.rank_zero import on_rank_zero
from gapbeam.meshes.distribution.slices import slices
from gapbeam.meshes.facet_groups import facet_groups
from gapbeam.meshes.gmsh_models.gmsh_session import gmsh_errors, gmsh_session
from gapbeam.meshes.layered_mesh import LayeredMesh, layered_mesh
from gapbeam.meshes.mesh_errors import MeshError
from gapbeam.meshes.sizing.expected_size import STRUCTURED, expected_cells
from gapbeam.meshes.sizing.mesh_size import BeamSizing
from gapbeam.meshes.versions.mesh_maker import made_mesh


@dataclass(frozen=True)
class TaggedMesh:
    """A distributed mesh with named groups of facets.

    Attributes:
        mesh: the DOLFINx mesh; ghost cells across shared facets.
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


MOST_CELLS = 2_000_000
"""More cells than this are a mistake in a size: a direct solver could not use them."""


def build_beam(comm: MPI.Comm, geometry: BeamGeometry, sizing: BeamSizing) -> TaggedMesh:
    """Build and distribute the mesh of a beam.

    Facets end exactly at the edge of the support, and every point of the geometry is a vertex. Quadrilaterals
    and hexahedra form layers; triangles and tetrahedra are unstructured. Cells of round sections are curved, of
    second order. Two builds give the same mesh. Where the cross-section changes along the beam, the layers of its
    largest one go on through all of it, and those beside the material are taken out.

    Args:
        comm: Communicator over which the mesh is distributed.
        geometry: The beam; the same on all ranks.
        sizing: Cell type and sizes; the same on all ranks.

    Returns:
        Mesh with a group of facets for each face of a support, end (x = 0) and tip (x = length).

    Raises:
        MeshError: on all ranks, for sizes that make no sense or when gmsh fails.

    Collective.
    """
    on_rank_zero(comm, lambda: _refuse_too_many(expected_cells(geometry, sizing)))
    if geometry.section is not None or sizing.cell_of(geometry.dimension) in STRUCTURED:
        mesh = _layered(comm, geometry, sizing)
    else:
        with gmsh_session(comm):
            on_rank_zero(comm, lambda: _draw(geometry, sizing))
            mesh, _, _ = mesh_from_gmsh(comm, geometry.dimension, lambda: geometry.support_length)
    tagged = TaggedMesh(mesh, facet_groups(mesh, geometry), groups_of(geometry))
    for name, count in tagged.facet_counts.items():
        if count == 0:
            raise MeshError(f"mesh of dimension {geometry.dimension}", found=f"no facets in {name}", expected="some")
    return tagged


def _layered(comm: MPI.Comm, geometry: BeamGeometry, sizing: BeamSizing) -> Mesh:
    """Make the layers of a beam on rank 0, and distribute them. Collective."""
    made = list[LayeredMesh]()
    on_rank_zero(comm, lambda: made.append(layered_mesh(geometry, sizing)))
    order, dimension = 2 if geometry.section is not None and geometry.section.curved else 1, geometry.dimension
    layers = made[0] if made else LayeredMesh.empty(dimension, order)
    divide = slices(layers.centers, geometry.support_length)
    return made_mesh(comm, layers.points, layers.cells, order, divide)


def _draw(geometry: BeamGeometry, sizing: BeamSizing) -> None:
    """Fill the beam with triangles or tetrahedra in the current gmsh model."""
    import gmsh

    from gapbeam.meshes.gmsh_models.unstructured import draw_unstructured

    unit = geometry.thickness  # gmsh's tolerances are absolute: it sees a beam of thickness 1
    with gmsh_errors("building the mesh", "a mesh of the beam"):
        draw_unstructured(geometry, sizing.cell_length(geometry), unit)
        bodies = [tag for _, tag in gmsh.model.getEntities(geometry.dimension)]
        gmsh.model.addPhysicalGroup(geometry.dimension, bodies, 1, BODY)
        gmsh.model.mesh.generate(geometry.dimension)
        gmsh.model.mesh.affineTransform([unit, 0, 0, 0, 0, unit, 0, 0, 0, 0, unit, 0])
        gmsh.model.mesh.renumberNodes()


def _refuse_too_many(count: float) -> None:
    if count > MOST_CELLS:
        raise MeshError(
            "mesh sizes",
            found=f"sizes that make about {count:.2g} cells",
            expected=f"at most {MOST_CELLS}",
            hint="Sizes are in m; the layers multiply.",
        )
