"""Mesh of a straight beam with named contact faces, made on rank 0 and distributed, and figures of mesh and section."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import scipy

from gapbeam.meshes.beam_geometry import BODY, ENDS, BeamGeometry, BeamStep, groups_of
from gapbeam.meshes.mesh_errors import MeshError
from gapbeam.meshes.mesh_readings import cell_shapes, exterior_facets, facet_corners, tagged_facets
from gapbeam.meshes.mesh_size import STRUCTURED, BeamSizing, expected_cells
from gapbeam.meshes.rank_zero import on_rank_zero, with_mpi
from gapbeam.meshes.reference_cells import Array, quadrature
from gapbeam.meshes.sections.section_grid import middles
from gapbeam.meshes.serial_mesh import LayeredMesh, SerialMesh, layered_mesh
from gapbeam.meshes.versions.mesh_geometry import coordinate_dofs

if TYPE_CHECKING:
    from mpi4py import MPI

Flags = npt.NDArray[np.bool_]

NEAR = 1.0e-6  # of the thickness


def facet_groups(mesh: Any, geometry: BeamGeometry) -> Any:
    """Return the tags of the facets at the ends of the beam and of those that face a support. Collective."""
    near, facets = NEAR * geometry.thickness, exterior_facets(mesh)
    corners = facet_corners(mesh, facets)
    low, high = corners[..., 0].min(axis=1, initial=np.inf), corners[..., 0].max(axis=1, initial=-np.inf)
    groups, tags = groups_of(geometry), np.zeros(len(facets), dtype=np.int32)
    tags[high < near] = groups["end"]
    tags[low > geometry.length - near] = groups["tip"]
    for step in geometry.steps or (geometry.at(0.0),):
        here = (tags == 0) & (high - low > near) & (low > step.start - near) & (high < step.end + near)
        below, above = _sides(step, corners[here, :, 1:], near)
        for span in geometry.spans:
            met = below | above if span.around else below if span.below else above
            met = met & (span.start - near <= low[here]) & (high[here] <= span.end + near)
            tags[np.flatnonzero(here)[met]] = groups[span.name]
    named = tags > 0
    return tagged_facets(mesh, facets[named], tags[named])


def _sides(step: BeamStep, corners: Array, near: float) -> tuple[Flags, Flags]:
    """Return flags of facets that face supports below and above, by their corners, (k, corners, d - 1)."""
    if step.section is None:
        heights = corners[..., -1]
        below, above = (np.all(np.abs(heights - side * step.thickness) < near, axis=1) for side in (-0.5, 0.5))
        return np.asarray(below), np.asarray(above)
    curves = [(curve.side, middles(curve)) for curve in step.section.curves if curve.side != "inside"]
    sides = np.concatenate([np.full(len(places), side) for side, places in curves])
    distances, nearest = scipy.spatial.KDTree(np.concatenate([places for _, places in curves])).query(
        corners.mean(axis=1)
    )
    touched = np.where(distances < near, sides[nearest], "inside")
    return touched == "below", touched == "above"


@dataclass(frozen=True)
class TaggedMesh:
    """A distributed mesh with named groups of facets.

    Attributes:
        mesh: the DOLFINx mesh, with ghost cells across shared facets, or a serial mesh.
        facets: tags of the facets in `groups`.
        groups: name of a facet group to its tag: those that face a support always, end (x = 0) and tip (x = length)
            perhaps.
        lower: smallest coordinates of all nodes, m.
        upper: largest coordinates of all nodes, m.
        cell_count: cells on all ranks.
        vertex_count: vertices on all ranks.
        facet_counts: facets of each group on all ranks.
    """

    mesh: Any
    facets: Any
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
            "lower": tuple(map(float, np.min(comm.allgather(lower), axis=0))),
            "upper": tuple(map(float, np.max(comm.allgather(upper), axis=0))),
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
        if isinstance(self.mesh, SerialMesh):
            return np.asarray(found, dtype=np.int32)
        owned = self.mesh.topology.index_map(self.dimension - 1).size_local
        return np.asarray(found[found < owned], dtype=np.int32)


MOST_CELLS = 2_000_000
"""More cells than this are a mistake in a size: a direct solver could not use them."""


def build_beam(comm: MPI.Comm, geometry: BeamGeometry, sizing: BeamSizing, assembled: bool = True) -> TaggedMesh:
    """Build and distribute the mesh of a beam.

    Facets end exactly at the edge of the support, and every point of the geometry is a vertex. Quadrilaterals
    and hexahedra form layers; triangles and tetrahedra are unstructured. Cells of round sections are curved, of
    second order. Two builds give the same mesh. Where the cross-section changes along the beam, the layers of its
    largest one go on through all of it, and those beside the material are taken out.

    Args:
        comm: Communicator over which the mesh is distributed.
        geometry: The beam; the same on all ranks.
        sizing: Cell type and sizes; the same on all ranks.
        assembled: Whether finite elements are assembled on the mesh; else layers need no DOLFINx.

    Returns:
        Mesh with a group of facets for each face of a support, end (x = 0) and tip (x = length).

    Raises:
        MeshError: sizes make no sense, or gmsh fails; on all ranks.

    Collective.
    """
    on_rank_zero(comm, lambda: _refuse_too_many(expected_cells(geometry, sizing)))
    if geometry.section is not None or sizing.cell_of(geometry.dimension) in STRUCTURED:
        mesh = _layered(comm, geometry, sizing, assembled)
    else:
        from gapbeam.meshes.distributed_mesh import mesh_from_gmsh
        from gapbeam.meshes.gmsh_model import gmsh_session

        comm = with_mpi(comm)
        with gmsh_session(comm):
            on_rank_zero(comm, lambda: _draw(geometry, sizing))
            mesh, _, _ = mesh_from_gmsh(comm, geometry.dimension, lambda: geometry.support_length)
    tagged = TaggedMesh(mesh, facet_groups(mesh, geometry), groups_of(geometry))
    for name, count in tagged.facet_counts.items():
        if count == 0:
            raise MeshError(f"mesh of dimension {geometry.dimension}", found=f"no facets in {name}", expected="some")
    return tagged


def _layered(comm: MPI.Comm, geometry: BeamGeometry, sizing: BeamSizing, assembled: bool) -> Any:
    """Make the layers of a beam on rank 0, and distribute them. Collective."""
    made = list[LayeredMesh]()
    on_rank_zero(comm, lambda: made.append(layered_mesh(geometry, sizing)))
    order, dimension = 2 if geometry.section is not None and geometry.section.curved else 1, geometry.dimension
    layers = made[0] if made else LayeredMesh.empty(dimension, order)
    if not assembled:
        return SerialMesh.of_layers(comm, layers)
    from gapbeam.meshes.distributed_mesh import slices
    from gapbeam.meshes.versions.mesh_maker import made_mesh

    divide = slices(layers.centers, geometry.support_length)
    return made_mesh(with_mpi(comm), layers.points, layers.cells, order, divide)


def _draw(geometry: BeamGeometry, sizing: BeamSizing) -> None:
    """Fill the beam with triangles or tetrahedra in the current gmsh model."""
    import gmsh

    from gapbeam.meshes.gmsh_model import draw_unstructured, gmsh_errors

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


def contact_facet_length(tagged: TaggedMesh) -> float:
    """Return the mean extent along x of the facets that face a support, m, the same on all ranks. Collective."""
    corners = [facet_corners(tagged.mesh, tagged.facets_of(name)) for name in tagged.groups if name not in ENDS]
    lengths = np.concatenate([np.ptp(one[..., 0], axis=1) for one in corners])
    # gathered and summed alike everywhere: a reduction may round differently on different ranks
    parts = tagged.mesh.comm.allgather((math.fsum(lengths), len(lengths)))
    return float(math.fsum(part[0] for part in parts) / sum(part[1] for part in parts))


DEGREE = 6
"""Degree of quadrature: exact for the second moment of straight cells, close to it for curved ones."""


@dataclass(frozen=True)
class Section:
    """Volume and second moment of area of a meshed body.

    Attributes:
        volume: V = int dV, m^3.
        area: V / length, m^2.
        second_moment: int (h - h_m)^2 dV / length about the mean height h_m, m^4; h is measured along the bending axis.
    """

    volume: float
    area: float
    second_moment: float


def mean_section(tagged: TaggedMesh, width: float) -> Section:
    """Integrate over the cells of a mesh.

    Args:
        tagged: The mesh.
        width: Factor of all integrals: the width of the beam in 2D, 1 in 3D, m.

    Returns:
        The same figures on all ranks.

    Collective.
    """
    moments = np.zeros(3)
    for volume, places in cell_points(tagged.mesh, DEGREE):
        moments += [math.fsum(volume * places[:, -1] ** power) for power in range(3)]
    parts = tagged.mesh.comm.allgather(moments)
    zeroth, first, second = (width * math.fsum(part[power] for part in parts) for power in range(3))
    length = tagged.upper[0] - tagged.lower[0]
    return Section(zeroth, zeroth / length, (second - first**2 / zeroth) / length)


def cell_points(mesh: Any, degree: int) -> Iterator[tuple[Array, Array]]:
    """Yield weight and place of a quadrature point in each cell of this rank, (cells,), and (cells, d), m."""
    dimension, shapes = mesh.topology.dim, cell_shapes(mesh)
    owned = mesh.topology.index_map(dimension).size_local
    nodes = mesh.geometry.x[coordinate_dofs(mesh)[:owned]][:, :, :dimension]
    points, weights = quadrature(shapes.cell, degree)
    values, slopes = shapes.tabulate(points)
    for value, gradients, weight in zip(values, np.moveaxis(slopes, 1, 0), weights, strict=True):
        jacobians = np.einsum("kn,cnd->ckd", gradients, nodes)
        yield weight * np.abs(determinant(jacobians)), np.einsum("n,cnd->cd", value, nodes)


def determinant(matrices: Array) -> Array:
    """Return determinants, (...), of (..., n, n), n at most 3: products, whose digits are the same at every size.

    The determinant of NumPy goes through logarithms, which are not.
    """
    if matrices.shape[-1] == 1:
        return np.asarray(matrices[..., 0, 0])
    first, second = matrices[..., 0, :], matrices[..., 1, :]
    if matrices.shape[-1] == 2:
        return np.asarray(first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0])
    return np.asarray(np.sum(first * np.cross(second, matrices[..., 2, :]), axis=-1))
