"""Assembly of the contact operator G, H, T, w, g0 from tagged faces, at points or at stations.

Contact points are the quadrature points of the facets that face a support. Planes are met along the bending
axis: a plane stands the gap of its face away from the outermost point of the facets, so faces that are not flat start
with their own gaps. Weights are areas projected on the bending axis. Friction acts across it, along the other axes. The
faces of holes are met along the radii of the section, and friction acts along the beam and around it.

Stations x_s along a support around a round beam (`gauss_rule.stations_along`) take the mean motions of its surface. The
quadrature points (x_j, w_j) of the surface within a support make a discrete measure along the beam. The mean motions of
the sections, along y and z, are a polynomial in x that fits the motions u_j of the surface best,

    s_s = sum_a pi_a(x_s) c_a,    c_a = sum_j w_j pi_a(x_j) u_j,    a < 4

with pi_a the orthonormal polynomials of the measure. A force at a station is spread over the surface likewise: its
resultant and its moments are those of a force at x_s, and around the section it is the same everywhere.

Along its support, the surface of a section moves like a rigid section, too: u_x = U + a y + b z along the
beam, and r t around it. U, a, b and t are fitted along x likewise, to u_x, 2 y u_x / r^2, 2 z u_x / r^2 and
(y u_z - z u_y) / r^2, whose means around a circle they are.

Nitsche's method for unilateral contact: no penalty, the contact pressure is the stress of the body.

    p = gamma <d - sigma_n(u) / gamma>,    a(u, v) - int theta/gamma sigma_n(u) sigma_n(v)
                                           - int p (G v + theta/gamma sigma_n(v)) = l(v)

With S the operator of the normal stress at the contact points this is penalty contact with other operators:
G_N = G + S/gamma, H_N = G + theta S/gamma and K_N = K - theta S^T (w/gamma) S, stiffness gamma. The method is
consistent: gamma need not go to infinity. theta = 1 is symmetric (it has a potential, so that discrete gradients and
energy balances work), 0 incomplete, -1 skew.

gamma has to exceed (1 + theta)^2 / 4 of the largest eigenvalue of the trace problem on each contact cell,

    int_facets sigma_n(u)^2 <= lambda int_cell sigma(u) : eps(u)     for all u,

over all its contact facets; it is computed here, cell by cell, instead of guessed. Above that the problem is strongly
monotone, and has one solution: for every gamma where theta = -1.

sigma_n is the force on the face along the bending axis per projected area, e . sigma n / (e . n): faces that are
not flat are met along that axis without friction.

Source: Chouly, Hild and Renard (2015), Math. Comp. 84, 1089-1112.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.sparse import block_diag, csr_matrix, vstack

from gapbeam.meshes.versions.mesh_geometry import coordinate_dofs
from gapbeam.solver.assembly.elasticity import CellStiffness
from gapbeam.solver.assembly.face_quadrature import FacePoints, PointRule, along_beam, face_points, gather_points
from gapbeam.solver.assembly.gauss_rule import gauss_rule, stations_along
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.supports.regions.around_face import BoreFace
from gapbeam.solver.supports.support import Face, Support, along_faces
from gapbeam.solver.system.operators import Array, Indices, Interface, Springs
from gapbeam.solver.system.semi_discrete import ContactOperator

NO_ENTRY = 1.0e-12  # basis functions that are zero but for round-off


@dataclass(frozen=True)
class NitscheContact:
    """Contact operator of Nitsche's method, whose pressure contains the stress of the body.

    Attributes:
        operator: G_N, H_N, w, g0.
        gamma: Nitsche's parameter at each point, (m,), Pa/m.
        correction: Matrix added to K.
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
        supported: Faces of the supports, with their sides and gaps.
        width: Factor of the weights in 2D, 1 in 3D, m.
        rule: Rule for the contact points of a facet.
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
    """The points of all faces, one face after the other, with the rows of each and their gaps."""

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


ACROSS = np.array([1, 2])  # components of displacement
EVERY = np.array([0, 1, 2])
FITTED = 4  # polynomials along a support


@dataclass(frozen=True)
class RingRows:
    """Stations and the rows of their motions.

    Attributes:
        interface: The DOFs of all surfaces.
        numbers: Their global numbers, (interface.size,).
        places: x of the stations, face by face, (k,), m.
        areas: Surface that belongs to each, (k,), m^2.
        faces: Index of the face of each, (k,).
        fits: c of each face along y and z, on the interface DOFs, (c, interface.size).
        values: The motion of each station along y and z by c, (2k, c).
        surface: U, a, b and t of each station on the interface DOFs, (4k, interface.size); None: not needed.
    """

    interface: Interface
    numbers: Indices
    places: Array
    areas: Array
    faces: Indices
    fits: csr_matrix
    values: csr_matrix
    surface: csr_matrix | None = None

    @property
    def motions(self) -> csr_matrix:
        """The motion of each station along y and z, on the interface DOFs, (2k, interface.size)."""
        return csr_matrix(self.values @ self.fits)

    def slots_of(self, space: Any, interface: Interface) -> Indices:
        """Return the places of the DOFs of another interface in this one, (its size,). Collective.

        Args:
            space: The space of both.
            interface: Some of the DOFs of this one.
        """
        first = space.dofmap.index_map_bs * space.dofmap.index_map.local_range[0]
        wanted = np.zeros(interface.size, dtype=np.int64)
        wanted[interface.slots] = interface.owned + first
        order = np.argsort(self.numbers)
        everywhere = space.mesh.comm.allreduce(wanted)
        return np.asarray(order[np.searchsorted(self.numbers, everywhere, sorter=order)])


def ring_rows(
    space: Any,
    faces: Mapping[str, Indices],
    supported: Sequence[Face],
    spans: Sequence[tuple[float, float]],
    rule: PointRule,
    count: int,
    follows: bool = False,
) -> RingRows:
    """Return the stations of supports around a beam.

    Args:
        space: Blocked vector Lagrange space of a solid.
        faces: Local facets by the name of the face that they touch; those of a span go all around the beam.
        supported: Faces of the supports.
        spans: First and last x of each, m.
        rule: Rule for the points of a facet.
        count: Stations along each support.
        follows: Whether motion along the faces is needed.

    Collective.
    """
    comm, block = space.mesh.comm, space.dofmap.index_map_bs
    surfaces = list[FacePoints]()
    for span in spans:
        around = np.concatenate([faces[one.name] for one, own in zip(supported, spans, strict=True) if own == span])
        surfaces.append(gather_points(comm, face_points(space, around, rule, 1.0, BoreFace("section", 0.0))))
    used = [np.abs(points.values) > NO_ENTRY for points in surfaces]
    held = EVERY if follows else ACROSS
    numbers = [(points.nodes[which] * block)[:, None] + held for points, which in zip(surfaces, used, strict=True)]
    interface, slots = dof_interface(space, [found.reshape(-1) for found in numbers], block)
    listed = np.zeros(interface.size, dtype=np.int64)
    found = np.unique(np.concatenate([each.reshape(-1) for each in numbers]))
    listed[slots(found)] = found
    places, areas, owners = list[Array](), list[Array](), list[Indices]()
    fits, values, surface = list[csr_matrix](), list[Array](), list[csr_matrix]()
    for face, points in enumerate(surfaces):
        x = points.positions[:, 0]
        stations, shares = stations_along(*spans[face], count)
        places.append(stations)
        areas.append(points.weights.sum() * shares)
        owners.append(np.full(count, face))
        fitted = gauss_rule(x, points.weights, min(count, FITTED))
        at_stations = fitted.values(x, stations)
        nodal = [_values(points, used[face], slots, block, axis, interface.size) for axis in ACROSS]
        fits += [csr_matrix(fitted.moments @ along) for along in nodal]
        # y and z of one station after the other, all c of y before those of z
        values.append(np.einsum("as,yz->syza", at_stations, np.identity(2)).reshape(2 * count, -1))
        if follows:
            axial = _values(points, used[face], slots, block, 0, interface.size)
            surface.append(_surface(points, at_stations.T @ fitted.moments, [axial, *nodal]))
    return RingRows(
        interface,
        listed,
        np.concatenate(places),
        np.concatenate(areas),
        np.concatenate(owners),
        csr_matrix(vstack(fits, format="csr")),
        csr_matrix(block_diag([csr_matrix(one) for one in values])),
        csr_matrix(vstack(surface, format="csr")) if follows else None,
    )


def _surface(points: FacePoints, fit: Array, motions: Sequence[csr_matrix]) -> csr_matrix:
    """Return U, a, b and t of the stations of a face one after the other, (4k, size).

    Args:
        points: Points of the face, all around the beam.
        fit: Map from values at the points to those at the stations, (k, points).
        motions: Motions of the points along x, y and z, (points, size) each.
    """
    y, z = points.positions[:, 1:].T
    squares, total = y**2 + z**2, points.weights.sum()
    shares = [float(points.weights @ (part**2 / squares) / total) for part in (y, z)]  # 1/2 around a circle
    along, sideways, up = motions
    fields = (
        along,
        along.multiply((y / (shares[0] * squares))[:, None]),
        along.multiply((z / (shares[1] * squares))[:, None]),
        up.multiply((y / squares)[:, None]) - sideways.multiply((z / squares)[:, None]),
    )
    rows = vstack([csr_matrix(fit @ csr_matrix(each)) for each in fields], format="csr")
    return csr_matrix(rows[np.arange(rows.shape[0]).reshape(len(fields), -1).T.reshape(-1)])


def _values(points: FacePoints, used: Any, slots: Any, block: int, axis: int, size: int) -> csr_matrix:
    """Return the motions of points along an axis, (points, size)."""
    row, local = np.nonzero(used)
    columns = slots(points.nodes[row, local] * block + axis)
    return csr_matrix((points.values[row, local], (row, columns)), (len(points.weights), size))


RIGID_MOTIONS = {2: 3, 3: 6}


@dataclass(frozen=True)
class Nitsche:
    """Settings of Nitsche's method.

    Attributes:
        theta: 1, 0 or -1.
        factor: gamma relative to the eigenvalue of the trace problem.
        lame: (lambda, mu), Pa; in plane stress the reduced lambda.
        width: Factor of the cell integrals in 2D, 1 in 3D, m.
    """

    theta: float
    factor: float
    lame: tuple[float, float]
    width: float

    def __post_init__(self) -> None:
        """Refuse a gamma for which the problem need not have a solution."""
        least = 0.25 * (1.0 + self.theta) ** 2
        if self.factor <= least:
            raise UserError(
                f"contact.formulation: found factor = {self.factor:g}; nitsche with theta = {self.theta:g} needs more "
                f"than {least:g}, and 2 is enough for every theta"
            )


def stress_rows(points: FacePoints, lame: tuple[float, float]) -> Array:
    """Return the normal stress at the points per unit nodal displacement, (m, k, dimension), Pa/m.

    sigma_n = lambda div u + mu (du_e/dn + n . du/de) along the bending axis e, the last one, with n . e = 1.
    """
    first, second = lame
    rows: Array = first * points.gradients
    rows[..., -1] += second * np.einsum("qkx,qx->qk", points.gradients, points.normals)
    rows += second * points.gradients[..., -1:] * points.normals[:, None, :]
    return rows


def trace_bounds(space: Any, faces: Mapping[str, FacePoints], settings: Nitsche) -> dict[int, float]:
    """Return the eigenvalue of the trace problem of every contact cell, Pa/m, by global cell number.

    Args:
        space: Blocked vector Lagrange space.
        faces: Points of each face on this rank.
        settings: Material and width.

    Collective.
    """
    mesh = space.mesh
    first_cell = mesh.topology.index_map(mesh.topology.dim).local_range[0]
    joined = FacePoints.join(list(faces.values()))  # a cell may have facets of both faces
    rows = np.sqrt(joined.weights)[:, None, None] * stress_rows(joined, settings.lame)
    cells = np.unique(joined.cells)
    first, second = (np.full(len(coordinate_dofs(mesh)), modulus) for modulus in settings.lame)
    stiffness = CellStiffness(space, first, second, settings.width).of_cells(cells - first_cell)
    bounds: dict[int, float] = {}
    for cell, of_cell in zip(cells, stiffness, strict=True):
        mine = joined.cells == cell
        values, vectors = np.linalg.eigh(of_cell)
        elastic = slice(RIGID_MOTIONS[mesh.topology.dim], None)
        scaled = rows[mine].reshape(np.count_nonzero(mine), -1) @ vectors[:, elastic] / np.sqrt(values[elastic])
        bounds[int(cell)] = float(np.linalg.norm(scaled, 2) ** 2)
    return {cell: bound for part in mesh.comm.allgather(bounds) for cell, bound in part.items()}


def correction(stress: csr_matrix, weights: Array, gamma: Array, theta: float) -> csr_matrix:
    """Return -theta S^T (w/gamma) S on the interface DOFs, N/m."""
    return csr_matrix(-theta * (stress.T @ stress.multiply((weights / gamma)[:, None])))
