"""Quadrature points on the contact faces and points within the body, with basis functions and their gradients.

The gradient of a vector field at the corners of the cells of a mesh is a mean over the cells that meet at each:

    H(corner) = mean over the cells at the corner of sum_k u_k (dN_k/dX) J^-1,   H = du/dx,  J = dx/dX

Gradients of finite elements jump from cell to cell. Ghost cells are left out, and the shares of all ranks are summed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from gapbeam.meshes import reference_cells
from gapbeam.meshes.mesh_readings import cell_shapes, displacement_shapes, facet_cells
from gapbeam.meshes.reference_cells import corners as corners_of
from gapbeam.meshes.serial_mesh import SerialMesh
from gapbeam.meshes.versions.mesh_geometry import coordinate_dofs
from gapbeam.solver.assembly.section_rows import PointFinder
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.supports.support import Face
from gapbeam.solver.system.operators import Array, Indices

if TYPE_CHECKING:
    from mpi4py import MPI

STEEPEST = 1.0e-6  # component of the unit normal along the bending axis, of faces that can be met along it


@dataclass(frozen=True)
class PointRule:
    """Rule for the contact points of a facet.

    Attributes:
        degree: Degree of the quadrature; of the nodes if nodal.
        nodal: The points are nodes of a Lagrange space, with the areas that a uniform pressure gives them: all nodes
            but the corners of quadratic triangles, whose areas are 0.
    """

    degree: int
    nodal: bool = False


@dataclass(frozen=True)
class FacePoints:
    """Quadrature points of the facets of one face.

    Attributes:
        nodes: Global numbers of the nodes of the cell of each point, (m, k).
        values: Basis functions of these nodes at the point, (m, k).
        weights: Projected areas, (m,), m^2 (m times the width in 2D).
        positions: (m, 3), m.
        gradients: Gradients of the basis functions at the point, (m, k, dimension), 1/m.
        normals: Normal of the face over its component along the bending axis, (m, dimension): that axis if it is flat.
        cells: Number of the cell of each point among all cells of all ranks, (m,).
    """

    nodes: Indices
    values: Array
    weights: Array
    positions: Array
    gradients: Array
    normals: Array
    cells: Indices

    @classmethod
    def join(cls, parts: Sequence[FacePoints]) -> FacePoints:
        """Return the points of several parts, one after the other."""
        return cls(
            **{field.name: np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(cls)}
        )

    def taken(self, rows: Indices) -> FacePoints:
        """Return some of the points."""
        return FacePoints(**{field.name: getattr(self, field.name)[rows] for field in fields(FacePoints)})


@dataclass(frozen=True)
class _Rule:
    """Basis functions and weights that all facets at one place of the reference cell share.

    Attributes:
        basis: Basis functions at the points, (q, k).
        derivatives: Their derivatives on the reference cell, (dimension, q, k).
        shape: Shape functions of the geometry, (q, c).
        shape_derivatives: Their derivatives on the reference cell, (dimension, q, c).
        tangents: Tangents of the facet on the reference cell, (t, dimension).
        factors: Quadrature weights, (q,).
    """

    basis: Array
    derivatives: Array
    shape: Array
    shape_derivatives: Array
    tangents: Array
    factors: Array


def face_points(space: Any, facets: Indices, rule: PointRule, width: float, face: Face | None = None) -> FacePoints:
    """Tabulate a scalar or blocked Lagrange space at the quadrature points of facets of this rank.

    Planes are met along the bending axis (the last one), so weights are areas projected on it, and points where
    the face is parallel to it are left out. A face around the beam is met along its radii.

    Args:
        space: The space; its nodes (blocks) are meant, not its components.
        facets: Local numbers of exterior facets.
        rule: Rule for the points of a facet.
        width: Factor of the weights.
        face: The face that the facets meet; None: a plane.

    Not collective; facets of ghost cells are left out, so every facet counts on one rank only.
    """
    mesh = space.mesh
    topology, dimension = mesh.topology, mesh.topology.dim
    owned_cells = topology.index_map(dimension).size_local
    rules = _rules(space, rule)
    coordinates, cell_coordinates = mesh.geometry.x, coordinate_dofs(mesh)
    count = rules[0].basis.shape[1]
    first_cell = topology.index_map(dimension).local_range[0]
    parts = [
        FacePoints(
            np.empty((0, count), dtype=np.int64),
            np.empty((0, count)),
            np.empty(0),
            np.empty((0, 3)),
            np.empty((0, count, dimension)),
            np.empty((0, dimension)),
            np.empty(0, dtype=np.int64),
        )
    ]
    for cell, place in zip(*facet_cells(mesh, facets), strict=True):
        if cell >= owned_cells:
            continue
        here = rules[place]
        corners = coordinates[cell_coordinates[cell]]
        cell_nodes = space.dofmap.index_map.local_to_global(space.dofmap.cell_dofs(cell).astype(np.int32))
        jacobian = np.einsum("dqc,cx->qdx", here.shape_derivatives, corners[:, :dimension])
        normals = _normals(np.einsum("td,qdx->tqx", here.tangents, jacobian))
        places = here.shape @ corners
        toward = normals[:, -1]
        if face is not None and face.around:
            toward = np.einsum("qx,qx->q", normals, face.opening(places[:, :dimension]))
        met = np.abs(toward) > STEEPEST * np.linalg.norm(normals, axis=1)
        if face is not None:
            met &= face.meets(places[:, :dimension])
        points = FacePoints(
            np.broadcast_to(cell_nodes, here.basis.shape).astype(np.int64),
            here.basis,
            here.factors * width * np.abs(toward),
            places,
            np.einsum("qxd,dqk->qkx", np.linalg.inv(jacobian), here.derivatives),
            normals / np.where(met, toward, 1.0)[:, None],
            np.full(len(here.factors), first_cell + cell),
        )
        parts.append(points if np.all(met) else points.taken(np.flatnonzero(met)))
    return FacePoints.join(parts)


def gather_points(comm: MPI.Comm, points: FacePoints, merged: bool = False) -> FacePoints:
    """Return the points of all ranks, ordered along the beam and across it.

    Args:
        comm: The ranks.
        points: Points of this rank.
        merged: Make one of the points at the same node, with the sum of their weights: for points at nodes.

    Collective.
    """
    points = FacePoints.join(comm.allgather(points))
    points = points.taken(along_beam(points.positions))
    if not merged:
        return points
    rows, weights = at_nodes(points)
    return replace(points.taken(rows), weights=weights)


def at_nodes(points: FacePoints) -> tuple[Indices, Array]:
    """Return one of the points at each node, and the sum of the weights there; for points at nodes of their space."""
    # by number: rounded places of the same node can differ between two cells
    own = np.take_along_axis(points.nodes, np.argmax(points.values, axis=1)[:, None], axis=1)[:, 0]
    _, first, which = np.unique(own, return_index=True, return_inverse=True)
    weights = np.bincount(which, weights=points.weights)
    order = np.argsort(first)
    return first[order], np.asarray(weights[order], dtype=float)


def _rounded(positions: Array) -> Array:
    span = float(np.ptp(positions[:, 0])) if len(positions) else 1.0
    return np.asarray(np.round(positions / max(span, 1e-300) * 1e7))


def along_beam(positions: Array) -> Indices:
    """Return the order by x, then y, then z, insensitive to round-off."""
    rounded = _rounded(positions)
    return np.asarray(np.lexsort((rounded[:, 2], rounded[:, 1], rounded[:, 0])), dtype=np.int64)


def _normals(tangents: Array) -> Array:
    """Return the normal to the tangents (t, q, dimension), (q, dimension), of the length or area that they span."""
    if len(tangents) == 1:
        return np.stack([-tangents[0, :, 1], tangents[0, :, 0]], axis=1)
    return np.asarray(np.cross(tangents[0], tangents[1]))


def _rules(space: Any, rule: PointRule) -> list[_Rule]:
    """Return one rule for each facet of the reference cell."""
    element, geometry = displacement_shapes(space), cell_shapes(space.mesh)
    place = reference_cells.nodal_rule if rule.nodal else reference_cells.quadrature
    points, factors = place(reference_cells.FACETS[element.cell], rule.degree)
    rules = []
    for facet in reference_cells.facets(element.cell):
        corners = corners_of(element.cell)[list(facet)]
        tangents = corners[1 : corners.shape[1]] - corners[0]
        on_cell = corners[0] + points @ tangents
        rules.append(_Rule(*element.tabulate(on_cell), *geometry.tabulate(on_cell), tangents, factors))
    return rules


COARSE = 0.05  # of a cell: how far a point on the surface may lie outside of curved cells, which do not follow an arc


def body_points(space: Any, places: Sequence[tuple[str, Array]]) -> tuple[FacePoints, Indices]:
    """Return the points in all cells that hold them, on all ranks: gradients jump from cell to cell.

    Args:
        space: Blocked vector Lagrange space.
        places: Name of each point in errors, and the point, (3,), m.

    Returns:
        A point for each cell, and the number of the place that it belongs to, ascending.

    Raises:
        UserError: A point lies outside the mesh; on all ranks.

    Collective.
    """
    mesh, finder = space.mesh, PointFinder(space)
    dimension, element, geometry = mesh.topology.dim, displacement_shapes(space), cell_shapes(mesh)
    first_cell = mesh.topology.index_map(dimension).local_range[0]
    mine = list[tuple[int, FacePoints]]()
    for number, (_, place) in enumerate(places):
        for _, cell, reference in finder.cells_at(place, COARSE if finder.curved else 0.0):
            (values, derivatives), (_, slopes) = element.tabulate(reference), geometry.tabulate(reference)
            corners = mesh.geometry.x[coordinate_dofs(mesh)[cell]][:, :dimension]
            jacobian = np.einsum("dqc,cx->qdx", slopes, corners)
            nodes = space.dofmap.index_map.local_to_global(space.dofmap.cell_dofs(cell).astype(np.int32))
            point = FacePoints(
                nodes[None].astype(np.int64),
                values,
                np.ones(1),
                np.asarray(place, dtype=float)[None],
                np.einsum("qxd,dqk->qkx", np.linalg.inv(jacobian), derivatives),
                np.zeros((1, dimension)),
                np.array([first_cell + cell]),
            )
            mine.append((number, point))
    found = sorted((part for rank in mesh.comm.allgather(mine) for part in rank), key=lambda part: part[0])
    numbers = np.array([number for number, _ in found], dtype=np.int64)
    for number, (name, place) in enumerate(places):
        if number not in numbers:
            where = ", ".join(f"{x:.6g}" for x in place[:dimension])
            raise UserError(f"{name}: the point ({where}) m is not in the mesh: no stress there")
    return FacePoints.join([point for _, point in found]), numbers


@dataclass(frozen=True)
class CornerGradients:
    """Averaged gradients at the corners of a mesh.

    Attributes:
        nodes: Nodes of each cell of this rank, local, (cells, k).
        corners: Its corners, local, (cells, c).
        slopes: Gradients of the basis functions in the reference cell at its corners, (d, c, k).
        inverse: Inverse of the Jacobians at the corners, (cells, c, d, d).
        linear: Linear space, whose nodes are the corners.
        counts: Number of cells of all ranks that meet at each corner that this rank owns, (n,).
    """

    nodes: Indices
    corners: Indices
    slopes: Array
    inverse: Array
    linear: Any
    counts: Array

    @classmethod
    def of_spaces(cls, space: Any, linear: Any) -> CornerGradients:
        """Return the gradients of a space.

        Args:
            space: Blocked vector Lagrange space.
            linear: Blocked linear Lagrange space on the same mesh.

        Collective.
        """
        mesh = space.mesh
        dimension = mesh.topology.dim
        cells = mesh.topology.index_map(dimension).size_local
        at = corners_of(mesh.topology.cell_name())
        (_, slopes), (_, shapes) = displacement_shapes(space).tabulate(at), cell_shapes(mesh).tabulate(at)
        places = mesh.geometry.x[coordinate_dofs(mesh)[:cells]][:, :, :dimension]
        jacobians = np.einsum("eka,bck->ecab", places, shapes)
        corners = np.asarray(linear.dofmap.list[:cells], dtype=np.int64)
        nodes = np.asarray(space.dofmap.list[:cells], dtype=np.int64)
        ones = np.ones((*corners.shape, 1))
        counts = _summed(linear, corners, ones)[:, 0]
        return cls(nodes, corners, slopes, np.linalg.inv(jacobians), linear, counts)

    def mean(self, field: Array) -> Array:
        """Return the gradient du_i / dx_j at the corners that this rank owns, (n, d, d).

        Args:
            field: DOFs in the space, ghosts among them.

        Collective.
        """
        dimension = self.inverse.shape[-1]
        values = field.reshape(-1, dimension)[self.nodes]
        reference = np.einsum("bck,eki->ecib", self.slopes, values, optimize=True)
        gradients = (reference @ self.inverse).reshape(*self.corners.shape, dimension**2)
        summed = _summed(self.linear, self.corners, gradients) / self.counts[:, None]
        return summed.reshape(-1, dimension, dimension)


def _summed(linear: Any, corners: Indices, values: Array) -> Array:
    """Return sums over the cells of all ranks of values at their corners (cells, c, m), on owned corners (n, m)."""
    index_map, width = linear.dofmap.index_map, values.shape[-1]
    if isinstance(linear.mesh, SerialMesh):
        found = np.zeros((index_map.size_local, width))
        np.add.at(found, corners.reshape(-1), values.reshape(-1, width))
        return found
    from dolfinx import la

    vector = la.vector(index_map, width, np.float64)
    whole = vector.array.reshape(-1, width)
    whole[:] = 0.0
    np.add.at(whole, corners.reshape(-1), values.reshape(-1, width))
    vector.scatter_reverse(la.InsertMode.add)
    return np.array(whole[: index_map.size_local])
