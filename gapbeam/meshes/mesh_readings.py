"""Cells, facets and spaces of meshes, of DOLFINx and of arrays, as those that only read them ask for them."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from gapbeam.meshes.mesh_errors import MeshError
from gapbeam.meshes.rank_zero import ONE_RANK
from gapbeam.meshes.reference_cells import Array, LagrangeCell
from gapbeam.meshes.serial_mesh import FacetTags, Indices, SerialMesh, SerialSpace
from gapbeam.meshes.versions.mesh_geometry import coordinate_dofs, geometry_order


def cell_shapes(mesh: Any) -> LagrangeCell:
    """Shapes of the geometry of the cells."""
    return LagrangeCell(mesh.topology.cell_name(), geometry_order(mesh))


def displacement_shapes(space: Any) -> LagrangeCell:
    """Shapes of the displacement in the cells."""
    return LagrangeCell(space.mesh.topology.cell_name(), degree_of(space))


def degree_of(space: Any) -> int:
    """Polynomial degree of a space."""
    return int(space.degree if isinstance(space, SerialSpace) else space.element.basix_element.degree)


def exterior_facets(mesh: Any) -> Indices:
    """Local numbers of the facets on the surface of the cells of this rank, ascending. Collective."""
    if isinstance(mesh, SerialMesh):
        return np.arange(len(mesh.facets[0]))
    from dolfinx.mesh import exterior_facet_indices

    _connect(mesh)
    return np.sort(exterior_facet_indices(mesh.topology)).astype(np.int64)


def facet_cells(mesh: Any, facets: Indices) -> tuple[Indices, Indices]:
    """First cell of each facet, and the place of the facet in that cell, (k,) each."""
    if isinstance(mesh, SerialMesh):
        cells, places = mesh.facets
        return cells[facets], places[facets]
    _connect(mesh)
    dimension = mesh.topology.dim
    to_cells = mesh.topology.connectivity(dimension - 1, dimension)
    to_facets = mesh.topology.connectivity(dimension, dimension - 1)
    first = [int(to_cells.links(facet)[0]) for facet in facets]
    pairs = zip(facets, first, strict=True)
    there = [int(np.flatnonzero(to_facets.links(cell) == facet)[0]) for facet, cell in pairs]
    return np.array(first, dtype=np.int64), np.array(there, dtype=np.int64)


def facet_corners(mesh: Any, facets: Indices) -> Array:
    """Corners of facets, (k, c, d), m."""
    if isinstance(mesh, SerialMesh):
        return np.asarray(mesh.facet_corners[facets])
    from dolfinx.mesh import entities_to_geometry

    dimension = mesh.topology.dim
    count = 4 if mesh.topology.cell_name() == "hexahedron" else dimension  # further nodes of curved facets come behind
    if len(facets) == 0:  # DOLFINx 0.9 divides by this number
        return np.empty((0, count, dimension))
    _connect(mesh)
    nodes = entities_to_geometry(mesh, dimension - 1, np.asarray(facets, dtype=np.int32))[:, :count]
    return np.asarray(mesh.geometry.x[nodes][..., :dimension])


def facet_middles(mesh: Any, facets: Indices) -> Array:
    """Mean places of the corners of facets, (k, 3), m."""
    middles = facet_corners(mesh, facets).mean(axis=1)
    return np.pad(middles, ((0, 0), (0, 3 - middles.shape[1])))


def tagged_facets(mesh: Any, facets: Indices, values: npt.NDArray[np.int32]) -> Any:
    """Tags of facets, whose `find(value)` returns those with a tag."""
    if isinstance(mesh, SerialMesh):
        return FacetTags(facets, values)
    from dolfinx.mesh import meshtags

    return meshtags(mesh, mesh.topology.dim - 1, np.asarray(facets, dtype=np.int32), values)


def vector_space(mesh: Any, degree: int) -> Any:
    """Vector Lagrange space of a degree. Collective."""
    if isinstance(mesh, SerialMesh):
        return SerialSpace(mesh, degree)
    import basix.ufl
    from dolfinx import fem

    element = basix.ufl.element("Lagrange", mesh.basix_cell(), degree, shape=(mesh.geometry.dim,))
    return fem.functionspace(mesh, element)


def as_arrays(space: Any) -> SerialSpace:
    """Copy a space and its mesh, which are all on this rank; nodes and cells keep their numbers."""
    mesh = space.mesh
    cells, order = np.array(coordinate_dofs(mesh)), geometry_order(mesh)
    copied = SerialMesh(ONE_RANK, mesh.topology.cell_name(), order, np.array(mesh.geometry.x), cells)
    nodes = np.array(space.tabulate_dof_coordinates()), np.array(space.dofmap.list)
    return SerialSpace(copied, degree_of(space), nodes)


def _connect(mesh: Any) -> None:
    dimension = mesh.topology.dim
    for first, second in ((dimension - 1, dimension), (dimension - 1, 0), (dimension, dimension - 1)):
        mesh.topology.create_connectivity(first, second)


STRAIGHT = 1.0e-6  # of the size of a cell


def bulge(mesh: Any) -> float:
    """Return the largest distance of nodes from their places in straight-sided cells, over the size of their cell.

    Collective.
    """
    shapes = cell_shapes(mesh)
    cells = mesh.topology.index_map(mesh.topology.dim).size_local
    largest = 0.0
    if shapes.degree > 1 and cells:
        nodes = mesh.geometry.x[coordinate_dofs(mesh)[:cells]]
        linear, _ = LagrangeCell(shapes.cell, 1).tabulate(shapes.places)
        corners = nodes[:, : linear.shape[1]]
        apart = np.linalg.norm(nodes - linear @ corners, axis=2).max(axis=1)
        largest = float(np.max(apart / np.linalg.norm(np.ptp(corners, axis=1), axis=1)))
    return float(max(mesh.comm.allgather(largest)))


def refuse_curved(mesh: Any, degree: int) -> None:
    """Refuse cells that displacements of a degree cannot turn: a rotation would strain them.

    The field of a rotation is linear in the coordinates. On a cell with straight sides it is one of degree 1, on a
    curved one it has the order of the cell.

    Raises:
        MeshError: The cells are curved, and of a higher order than the displacements.

    Collective.
    """
    order = geometry_order(mesh)
    if degree < order and (found := bulge(mesh)) > STRAIGHT:
        raise MeshError(
            "mesh.degree",
            found=f"{degree}, with curved cells of order {order} (sides bulge by {found:.2g} of a cell)",
            expected=f"{order} or more: displacements of degree {degree} strain such cells where the beam only turns",
            hint=f"mesh.degree = {order}, or a mesh file of order {degree}",
        )
