"""The mean motions of the surface of a round beam at stations along each support around it.

The quadrature points (x_j, w_j) of the surface within a support make a discrete measure along the beam. The nodes x_s
of its Gauss rule are the stations. The mean motions of the sections, along y and z, are a polynomial in x that fits the
motions u_j of the surface best,

    s_s = sum_a pi_a(x_s) c_a,    c_a = sum_j w_j pi_a(x_j) u_j,    a < 4

with pi_a the orthonormal polynomials of the measure. A force at a station is spread over the surface likewise: its
resultant and its moments are those of a force at x_s, and around the section it is the same everywhere.

How the surface of a section moves along its support is that of a rigid section, too: u_x = U + a y + b z along the
beam, and r t around it. U, a, b and t are fitted along x likewise, to u_x, 2 y u_x / r^2, 2 z u_x / r^2 and
(y u_z - z u_y) / r^2, whose means around a circle they are.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import block_diag, csr_matrix, vstack

from gapbeam.solver.assembly.contact_assembly import NO_ENTRY, dof_interface
from gapbeam.solver.assembly.face_quadrature import FacePoints, PointRule, face_points, gather_points
from gapbeam.solver.assembly.gauss_rule import gauss_rule
from gapbeam.solver.supports.regions.around_face import BoreFace
from gapbeam.solver.supports.support import Face
from gapbeam.solver.system.operators import Array, Indices, Interface

ACROSS = np.array([1, 2])  # components of displacement
EVERY = np.array([0, 1, 2])
FITTED = 4  # polynomials along a support


@dataclass(frozen=True)
class RingRows:
    """Stations, and what gives their motions.

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
        """Return where the DOFs of another interface are in this one, (its size,). Collective.

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
    rule: PointRule,
    count: int,
    follows: bool = False,
) -> RingRows:
    """Return the stations of supports around a beam.

    Args:
        space: Blocked vector Lagrange space of a solid.
        faces: Local facets by the name of the face that they touch: all those around the beam.
        supported: These faces.
        rule: Where the points of a facet lie.
        count: Stations along each support; fewer where the mesh has fewer places.
        follows: Whether motion along the faces is needed.

    Collective.
    """
    comm, block = space.mesh.comm, space.dofmap.index_map_bs
    surfaces = [
        gather_points(comm, face_points(space, faces[face.name], rule, 1.0, BoreFace(face.name, 0.0)))
        for face in supported
    ]
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
        gauss = gauss_rule(x, points.weights, count)
        places.append(gauss.rows @ x)
        areas.append(gauss.areas)
        owners.append(np.full(len(gauss.areas), face))
        nodal = [_values(points, used[face], slots, block, axis, interface.size) for axis in ACROSS]
        fits += [csr_matrix(gauss.moments[:FITTED] @ along) for along in nodal]
        # y and z of one station after the other, all c of y before those of z
        values.append(
            np.einsum("as,yz->syza", gauss.at_nodes[:FITTED], np.identity(2)).reshape(2 * len(gauss.areas), -1)
        )
        if follows:
            axial = _values(points, used[face], slots, block, 0, interface.size)
            surface.append(_surface(points, gauss.at_nodes[:FITTED].T @ gauss.moments[:FITTED], [axial, *nodal]))
    return RingRows(
        interface,
        listed,
        np.concatenate(places),
        np.concatenate(areas),
        np.concatenate(owners),
        csr_matrix(vstack(fits, format="csr")),
        csr_matrix(block_diag(values)),
        csr_matrix(vstack(surface, format="csr")) if follows else None,
    )


def _surface(points: FacePoints, fit: Array, motions: Sequence[csr_matrix]) -> csr_matrix:
    """Return U, a, b and t of the stations of a face one after the other, (4k, size).

    Args:
        points: Of the face, all around the beam.
        fit: From values at the points to those at the stations, (k, points).
        motions: Of the points along x, y and z, (points, size) each.
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
