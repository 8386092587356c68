"""From contact at the quadrature points to resultant springs at places of the faces.

A force on a single node gives a displacement there that grows without bound as cells shrink, so a resultant F_i is
spread over a patch by a hat function N_i around its place, and its gap is the mean of the gap over the same patch:

    g_i = sum_j P_ij g_j,    P_ij = N_i(x_j) w_j / A_i,    A_i = sum_j N_i(x_j) w_j,

with j the quadrature points of the face. That is G -> P G, g0 -> P g0 and, with friction, T -> P T; the areas A_i stand
instead of w, so that a law F(d) is the pressure F(d) / A_i.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.sparse import csr_matrix, identity, kron

from gapbeam.solver.errors import UserError
from gapbeam.solver.supports.support import Face
from gapbeam.solver.system.operators import Array, Springs
from gapbeam.solver.system.semi_discrete import ContactOperator

Place = float | tuple[float, float]
"""x of a patch over the whole width, or x and y of the center of a patch, m."""


@dataclass(frozen=True, kw_only=True)
class ResultantOperator(ContactOperator):
    """G, w and g0 of resultants at places of the faces.

    Attributes:
        distributed: The operator at the quadrature points of the faces, q of them.
        shares: P, (m, q); rows add up to 1.
    """

    distributed: ContactOperator
    shares: csr_matrix

    @property
    def area(self) -> float:
        """Area of all faces, whether in a patch or not, m^2."""
        return self.distributed.area

    def springs(self, stiffness: float | Array) -> Springs:
        """Return springs along the normal of the whole faces, as if there were no patches.

        A quadrature point has the largest stiffness of the points that share it, and the least of all where none does.
        """
        if isinstance(stiffness, np.ndarray):
            least = float(np.min(stiffness))
            shared = self._shared_by.astype(bool).astype(float).multiply(stiffness - least)
            stiffness = least + np.asarray(shared.max(axis=1).todense()).reshape(-1)
        return self.distributed.springs(stiffness)

    def with_gaps_of(self, faces: Sequence[Face]) -> ResultantOperator:
        """Return the operator of the same faces with other gaps."""
        moved = super().with_gaps_of(faces)
        assert isinstance(moved, ResultantOperator)
        return replace(moved, distributed=self.distributed.with_gaps_of(faces))

    def worn(self, depths: Array) -> ResultantOperator:
        """Return the operator with larger gaps, (m,), m, of the quadrature points, too.

        A quadrature point is worn by the mean over the points that share it; one that none shares as the nearest one.
        """
        moved = super().worn(depths)
        assert isinstance(moved, ResultantOperator)
        shared = np.asarray(self.shares.T @ self.weights)
        sums = np.asarray(self.shares.T @ (self.weights * depths))
        below = np.where(shared > 0.0, sums / np.where(shared > 0.0, shared, 1.0), 0.0)
        for point in np.flatnonzero(shared == 0.0):
            mine = np.flatnonzero(self.faces == self.distributed.faces[point])
            apart = np.linalg.norm(self.positions[mine] - self.distributed.positions[point], axis=1)
            below[point] = depths[mine[np.argmin(apart)]]
        return replace(moved, distributed=self.distributed.worn(below))

    def spread(self, forces: Array) -> Array:
        """Return P^T f, the forces at the quadrature points, (q, ...), N, for resultants f, (m, ...), N."""
        return self.distributed.spread(np.asarray(self._shared_by @ forces))

    @cached_property
    def _shared_by(self) -> csr_matrix:
        """P^T, (q, m)."""
        return self.shares.T.tocsr()


@dataclass(frozen=True, kw_only=True)
class StationOperator(ContactOperator):
    """G, w and g0 at points around sections that keep their shape: a rule along supports that is coarser than a mesh.

    Attributes:
        shares: How a force on each is shared among the quadrature points of the faces, (m, q); rows add up to 1.
    """

    shares: csr_matrix

    def spread(self, forces: Array) -> Array:
        """Return the forces at the quadrature points, (q, ...), N, for those at the points, (m, ...), N."""
        return np.asarray(self._shared_by @ forces)

    @cached_property
    def _shared_by(self) -> csr_matrix:
        """The transpose of `shares`, (q, m)."""
        return self.shares.T.tocsr()


def resultant_operator(contact: ContactOperator, places: Sequence[Place], size: float) -> ResultantOperator:
    """Gather contact at quadrature points into resultants, at the same places of every face.

    The position of a resultant is the mean of its patch, so that its moment is that of what it is spread over. At the
    end of a face only half a hat is left, and its mean lies size / 6 inside.

    Args:
        contact: G, w and g0 at the quadrature points.
        places: Where the resultants are.
        size: Length of a patch along x and, for places [x, y], across, m.

    Raises:
        UserError: A patch holds no quadrature point.

    Not collective: the operator is the same on all ranks.
    """
    hats = np.array([_hat(contact.positions, place, size) for place in places])
    faces = range(len(contact.face_names))
    weighted = np.concatenate([np.where(contact.faces == face, hats * contact.weights, 0.0) for face in faces])
    areas = weighted.sum(axis=1)
    owners = np.repeat(faces, len(places))
    _no_patch_is_empty(contact, places, areas.reshape(-1, len(places)), size)
    shares = csr_matrix(weighted / areas[:, None])
    return ResultantOperator(
        interface=contact.interface,
        gap_matrix=csr_matrix(shares @ contact.gap_matrix),
        weights=areas,
        initial_gap=np.asarray(shares @ contact.initial_gap),
        faces=owners,
        support=contact.support,
        positions=np.asarray(shares @ contact.positions),
        tangents=mean_tangents(contact, shares),
        frictionless=contact.frictionless,
        distributed=contact,
        shares=shares,
    )


def mean_tangents(contact: ContactOperator, shares: csr_matrix) -> csr_matrix | None:
    """Return the means of the motion along the face over the patches, direction by direction.

    P T, (m k, interface.size), for shares P, (m, q); None for an operator without T.
    """
    if contact.tangents is None:
        return None
    directions = contact.tangents.shape[0] // contact.size
    return csr_matrix(kron(shares, identity(directions)) @ contact.tangents)


def _hat(positions: Array, place: Place, size: float) -> Array:
    """Return the product of hats (1 - |x - x_i| / (size / 2))+ at positions (q, 3), (q,)."""
    center = np.atleast_1d(place)
    apart = np.abs(positions[:, : len(center)] - center) / (0.5 * size)
    return np.asarray(np.prod(np.maximum(1.0 - apart, 0.0), axis=1))


def _no_patch_is_empty(contact: ContactOperator, places: Sequence[Place], areas: Array, size: float) -> None:
    empty = [
        f"{place} at the {name}"
        for name, row in zip(contact.face_names, areas, strict=True)
        for place, area in zip(places, row, strict=True)
        if not area > 0.0
    ]
    if empty:
        raise UserError(
            f"[contact] points: no quadrature point lies in the patch around {', '.join(empty)}\n"
            f"  found:    patches of {size:g} m, and cells too large for them\n"
            "  expected: several quadrature points of the contact face in every patch\n"
            f"  try:      mesh.support_size = {0.5 * size:g}, or a larger contact.patch"
        )
