"""From tagged faces to the contact operator G, H, T, w, g0.

Contact points are the quadrature points of the facets that face a support. Planes are met along the bending
axis: a plane stands the gap of its face away from the outermost point of the facets, so faces that are not flat start
with their own gaps. Weights are areas projected on the bending axis. Friction acts across it, along the other axes. The
faces of holes are met along the radii of the section, and friction acts along the beam and around it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.sparse import csr_matrix

from gapbeam.solver.assembly.face_quadrature import FacePoints, PointRule, along_beam, face_points, gather_points
from gapbeam.solver.assembly.nitsche_terms import Nitsche, correction, stress_rows, trace_bounds
from gapbeam.solver.supports.support import Face, Support, along_faces
from gapbeam.solver.system.operators import Array, Indices, Interface, Springs
from gapbeam.solver.system.semi_discrete import ContactOperator

NO_ENTRY = 1.0e-12  # basis functions that are zero but for round-off


@dataclass(frozen=True)
class NitscheContact:
    """A contact operator that contains stress, and what comes with it.

    Attributes:
        operator: G_N, H_N, w, g0.
        gamma: Nitsche's parameter at each point, (m,), Pa/m.
        correction: What is added to K.
    """

    operator: ContactOperator
    gamma: Array
    correction: Springs


def contact_operator(
    space: Any,
    faces: Mapping[str, Indices],
    supported: Sequence[Face],
    width: float,
    rule: PointRule,
    follows: bool = False,
) -> ContactOperator:
    """Build G, w and g0: the gap is gap + u at a face below the beam, gap - u at one above it, gap - u_r in a hole.

    Args:
        space: Blocked vector Lagrange space.
        faces: Local facets by the name of the face that they touch.
        supported: These faces, with their sides and gaps.
        width: Factor of the weights in 2D, 1 in 3D, m.
        rule: Where the contact points of a facet lie.
        follows: Whether T is needed: the interface then holds all components of the nodes on the faces.

    Collective.
    """
    axis, block = space.mesh.geometry.dim - 1, space.dofmap.index_map_bs
    points, _ = _points(space, faces, supported, width, rule)
    used = np.abs(points.merged.values) > NO_ENTRY
    numbers = points.merged.nodes * block
    touched = []
    for face, rows in zip(supported, points.rows, strict=True):
        held = np.arange(0 if follows else 1 if face.around else axis, block)
        touched.append((numbers[rows][used[rows]][:, None] + held).reshape(-1))
    interface, slots = dof_interface(space, touched, block)
    row, local = np.nonzero(used)
    values, nodes = points.merged.values[row, local], numbers[row, local]

    def rows_of(directions: Sequence[Array]) -> csr_matrix:
        """Return the motions of all points along k directions, point by point, (m k, interface.size)."""
        entries, places, columns = [], [], []
        for number, along in enumerate(directions):
            for component in range(block):
                acting = np.flatnonzero(along[row, component])
                entries.append(along[row[acting], component] * values[acting])
                places.append(len(directions) * row[acting] + number)
                columns.append(slots(nodes[acting] + component))
        shape = (len(directions) * len(used), interface.size)
        return csr_matrix((np.concatenate(entries), (np.concatenate(places), np.concatenate(columns))), shape)

    operator = points.operator(interface, rows_of([points.opening]))
    return replace(operator, tangents=rows_of(points.tangents())) if follows else operator


def nitsche_operator(
    space: Any,
    faces: Mapping[str, Indices],
    supported: Sequence[Face],
    width: float,
    rule: PointRule,
    settings: Nitsche,
) -> NitscheContact:
    """Build G_N, H_N, w, g0, gamma and the correction of K; arguments as in `contact_operator`. Collective."""
    dimension, block = space.mesh.geometry.dim, space.dofmap.index_map_bs
    points, local_points = _points(space, faces, supported, width, rule)
    bounds = trace_bounds(space, local_points, settings)
    gamma = settings.factor * np.array([bounds[int(cell)] for cell in points.merged.cells])
    numbers = points.merged.nodes[:, :, None] * block + np.arange(dimension)
    interface, slots = dof_interface(space, [numbers[rows].reshape(-1) for rows in points.rows], block)
    count = numbers[0].size
    rows, columns = np.repeat(np.arange(len(numbers)), count), slots(numbers.reshape(-1))
    shape = (len(numbers), interface.size)
    gap = np.zeros(numbers.shape)
    gap[..., -1] = points.opening[:, -1, None] * points.merged.values
    geometry = csr_matrix((gap.reshape(-1), (rows, columns)), shape)
    geometry.eliminate_zeros()
    stress = csr_matrix((stress_rows(points.merged, settings.lame).reshape(-1), (rows, columns)), shape)
    scaled = csr_matrix(stress.multiply((1.0 / gamma)[:, None]))
    force = None if settings.theta == 1.0 else csr_matrix(geometry + settings.theta * scaled)
    operator = points.operator(interface, csr_matrix(geometry + scaled), force, geometry)
    added = correction(stress, points.merged.weights, gamma, settings.theta)
    return NitscheContact(operator, gamma, Springs(interface, added))


@dataclass(frozen=True)
class _Points:
    """The points of all faces, one face after the other: the faces, the rows of each, and what opens the gaps."""

    merged: FacePoints
    supported: tuple[Face, ...]
    rows: list[slice]
    opening: Array

    def tangents(self) -> list[Array]:
        """Return unit vectors along the faces, (m, dimension) each: along the beam and, in 3D, across or around it."""
        around = np.zeros(len(self.opening), dtype=bool)
        for face, rows in zip(self.supported, self.rows, strict=True):
            around[rows] = face.around
        return along_faces(self.opening, around)

    def operator(
        self,
        interface: Interface,
        gap_matrix: csr_matrix,
        force_matrix: csr_matrix | None = None,
        geometry_matrix: csr_matrix | None = None,
    ) -> ContactOperator:
        support = Support(self.supported, float(self.merged.weights.sum()))
        places = self.merged.positions[:, : self.opening.shape[1]]
        gaps = np.empty(len(places))
        for face, rows in zip(support.faces, self.rows, strict=True):
            gaps[rows] = face.gaps(places[rows])
        return ContactOperator(
            interface=interface,
            gap_matrix=gap_matrix,
            weights=self.merged.weights,
            initial_gap=gaps,
            faces=np.concatenate([np.full(rows.stop - rows.start, face) for face, rows in enumerate(self.rows)]),
            support=support,
            positions=self.merged.positions,
            force_matrix=force_matrix,
            geometry_matrix=geometry_matrix,
        )


def _points(
    space: Any, faces: Mapping[str, Indices], supported: Sequence[Face], width: float, rule: PointRule
) -> tuple[_Points, dict[str, FacePoints]]:
    """Return the points of all ranks, and those of this rank by face. Collective."""
    mine = {face.name: face_points(space, faces[face.name], rule, width, face) for face in supported}
    gathered = [gather_points(space.mesh.comm, points, merged=rule.nodal) for points in mine.values()]
    ends = np.cumsum([len(points.weights) for points in gathered])
    rows = [slice(int(end) - len(points.weights), int(end)) for end, points in zip(ends, gathered, strict=True)]
    dimension = space.mesh.geometry.dim
    opening = [face.opening(points.positions[:, :dimension]) for face, points in zip(supported, gathered, strict=True)]
    return _Points(FacePoints.join(gathered), tuple(supported), rows, np.concatenate(opening)), mine


def dof_interface(space: Any, numbers: list[Indices], block: int) -> tuple[Interface, Callable[[Indices], Indices]]:
    """Return the interface DOFs in the order along the beam, face by face, and their slots by global number."""
    coordinates = _node_coordinates(space)
    order: dict[int, None] = {}
    for face in numbers:
        wanted = np.unique(face)
        order.update(dict.fromkeys(int(dof) for dof in wanted[along_beam(coordinates(wanted // block))]))
    listed = np.array(list(order), dtype=np.int64)
    first, end = (block * bound for bound in space.dofmap.index_map.local_range)
    mine = np.flatnonzero((listed >= first) & (listed < end))
    by_number = np.argsort(listed)

    def slots(wanted: Indices) -> Indices:
        return np.asarray(by_number[np.searchsorted(listed, wanted, sorter=by_number)])

    return Interface(size=len(listed), owned=listed[mine] - first, slots=mine), slots


def _node_coordinates(space: Any) -> Callable[[Indices], Array]:
    """Return a function from global node numbers to coordinates, the same on all ranks. Collective."""
    comm, index_map = space.mesh.comm, space.dofmap.index_map
    first, end = index_map.local_range
    local = space.tabulate_dof_coordinates()[: index_map.size_local]

    def look_up(nodes: Indices) -> Array:
        found = np.zeros((len(nodes), 3))
        mine = (nodes >= first) & (nodes < end)
        found[mine] = local[nodes[mine] - first]
        return np.asarray(comm.allreduce(found))

    return look_up
