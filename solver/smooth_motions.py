"""Motions of a slender body that vary slowly along it, and what stiffness makes of them, to more digits than K has.

Bending, stretching and twisting that follow polynomials P along the beam's axis x, rigid motions among them:

    u_t = P(x), u_x = -t P'(x);      u_x = P(x);      u_y = -z P(x), u_z = y P(x)

Elasticity hardly feels them, so in K z large numbers cancel, and round-off of the stiffest entries of K is what low
frequencies would see: in K itself, in every product with it, and in its factor. So K z is found here once, from what
the nodes of a short stretch of the beam do beside moving together,

    (K z)_i = sum_j K_ij (z_j - r_j),    r the rigid motion of the stretch that node i lies in,

and with a = Z^T x and P = 1 - Z Z^T, K x = P K P x + (K Z) a + Z (K Z)^T P x. Neither depends on the order in which
K was assembled, but for round-off of strains; rigid motions do nothing at all.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial.legendre import legder, legval
from petsc4py import PETSc
from scipy.linalg import solve_triangular
from scipy.sparse import csr_matrix

from solver.operators import Array, Indices

BENDING, AXIAL, TWIST = 16, 4, 4  # polynomials of each kind
STRETCHES = 64  # along the beam
DEPENDENT = 1.0e-3  # squared: what the nodes of a coarse mesh cannot tell from the motions before

Sum = Callable[[Array], Array]


@dataclass(frozen=True)
class SmoothMotions:
    """Motions that K nearly annihilates.

    Attributes:
        shapes: Z, (n, k), orthonormal over all ranks.
        images: K Z, (n, k).
        total: Sums an array over the ranks.
    """

    shapes: Array
    images: Array
    total: Sum

    def product(self, stiffness: Callable[[Array], Array], x: Array) -> Array:
        """Return K x, (n,), with a product for the rest of x. Collective."""
        shares = self.total(self.shapes.T @ x)
        rest = x - self.shapes @ shares
        force = stiffness(rest)
        force += self.shapes @ self.total(self.images.T @ rest - self.shapes.T @ force)
        return np.asarray(force + self.images @ shares)


def smooth_motions(space: Any, stiffness: PETSc.Mat, total: Sum) -> SmoothMotions:
    """Return the smooth motions on a blocked vector Lagrange space.

    Args:
        space: The space.
        stiffness: K, which does not feel rigid motions, distributed like vectors of that space.
        total: Sums an array over the ranks.

    Collective.
    """
    block, owned = space.dofmap.index_map_bs, space.dofmap.index_map.size_local
    places = np.ascontiguousarray(space.tabulate_dof_coordinates()[:owned, :block])
    frame = _Frame.of(places, total)
    shapes = raw = frame.shapes(places)
    scale = np.eye(raw.shape[1])
    for _ in range(3):
        scale = scale @ space.mesh.comm.bcast(_orthonormal(total(shapes.T @ shapes)))
        shapes = raw @ scale
    images = _images(stiffness, places, shapes)
    rigid = shapes[:, : 3 * block - 3]
    images[:, : rigid.shape[1]] = 0.0
    images -= rigid @ total(rigid.T @ images)
    return SmoothMotions(shapes, images, total)


def _orthonormal(products: Array) -> Array:
    """Return the combinations, (k, r), of vectors with these scalar products, (k, k), that are orthonormal.

    One after the other; those that depend on the ones before are left out: what cancels would have few digits.
    """
    lengths = np.sqrt(np.maximum(np.diagonal(products), np.finfo(float).tiny))
    cosines = products / np.outer(lengths, lengths)
    kept: list[int] = []
    factor = np.empty((0, 0))
    for one in range(len(cosines)):
        along = solve_triangular(factor, cosines[kept, one], lower=True) if kept else np.empty(0)
        rest = cosines[one, one] - along @ along
        if rest > DEPENDENT:
            kept.append(one)
            factor = np.block([[factor, np.zeros((len(factor), 1))], [along, np.sqrt(rest)]])
    combinations = np.zeros((len(cosines), len(kept)))
    combinations[kept] = solve_triangular(factor, np.eye(len(kept)), lower=True).T
    return np.asarray(combinations / lengths[:, None])


@dataclass(frozen=True)
class _Frame:
    """Where a body is: its mean place, (d,), m, and half its length, m."""

    center: Array
    half: float

    @classmethod
    def of(cls, places: Array, total: Sum) -> _Frame:
        count = total(np.array([float(len(places))]))[0]
        center = total(places.sum(axis=0)) / count
        spread = total(((places[:, 0] - center[0]) ** 2).sum(keepdims=True))[0] / count
        return cls(center, float(np.sqrt(3.0 * spread)))

    def shapes(self, places: Array) -> Array:
        """Return all motions at some places (m, d), node by node, (m d, k); rigid ones first."""
        block = places.shape[1]
        along, *across = (places - self.center).T
        along = along / self.half
        waves, count = np.eye(max(BENDING, AXIAL, TWIST)), len(places)
        values, slopes = legval(along, waves), legval(along, legder(waves)) / self.half
        kinds = []
        for axis in range(1, block):
            bending = np.zeros((BENDING, count, block))
            bending[..., axis], bending[..., 0] = values[:BENDING], -across[axis - 1] * slopes[:BENDING]
            kinds.append(bending)
        axial = np.zeros((AXIAL, count, block))
        axial[..., 0] = values[:AXIAL]
        kinds.append(axial)
        if block == 3:
            twist = np.zeros((TWIST, count, block))
            twist[..., 1], twist[..., 2] = -across[1] * values[:TWIST], across[0] * values[:TWIST]
            kinds.append(twist)
        rigid = [*(bending[:2] for bending in kinds[: block - 1]), *(other[:1] for other in kinds[block - 1 :])]
        others = [*(bending[2:] for bending in kinds[: block - 1]), *(other[1:] for other in kinds[block - 1 :])]
        return np.ascontiguousarray(np.concatenate([*rigid, *others]).reshape(-1, count * block).T)


def _images(stiffness: PETSc.Mat, places: Array, shapes: Array) -> Array:
    """Return K Z, (n, k). Collective."""
    block = places.shape[1]
    rows, needed = _rows(stiffness)
    around = _elsewhere(stiffness, np.column_stack([places.reshape(-1), shapes]), needed)
    images = np.zeros_like(shapes)
    first, length = places[:, 0].min(initial=np.inf), np.ptp(places[:, 0]) if len(places) else 1.0
    stretch = np.floor((places[:, 0] - first) / max(length, np.finfo(float).tiny) * STRETCHES)
    for one in np.unique(stretch):
        dofs = _dofs(np.flatnonzero(stretch == one), block)
        part = rows[dofs]
        columns = _touched(part.indices, len(needed), block)
        part = part[:, columns]
        images[dofs] = part @ _deformed(around[columns, 1:], around[columns, 0].reshape(-1, block))
    return images


def _touched(columns: Indices, count: int, block: int) -> Indices:
    """Return the DOFs of all nodes that some columns belong to, of `count` columns, ascending."""
    nodes = np.zeros(count // block, dtype=bool)
    nodes[columns // block] = True
    return _dofs(np.flatnonzero(nodes), block)


def _dofs(nodes: Indices, block: int) -> Indices:
    return np.asarray((nodes[:, None] * block + np.arange(block)).reshape(-1))


def _deformed(moved: Array, places: Array) -> Array:
    """Return motions (m d, k) of nodes near each other, at places (m, d), without how these move as one body."""
    block = places.shape[1]
    middle = int(np.argmin(np.sum((places - places.mean(axis=0)) ** 2, axis=1)))
    # differences of neighbors have all their digits
    rest = moved.reshape(len(places), block, -1) - moved.reshape(len(places), block, -1)[middle]
    arms = places - places[middle]
    turns = []
    for first in range(block):
        for second in range(first + 1, block):
            turn = np.zeros_like(places)
            turn[:, first], turn[:, second] = -arms[:, second], arms[:, first]
            turns.append(turn.reshape(-1))
    turning, rest = np.stack(turns, axis=1), rest.reshape(len(places) * block, -1)
    return np.asarray(rest - turning @ np.linalg.lstsq(turning, rest)[0])


def _rows(stiffness: PETSc.Mat) -> tuple[csr_matrix, Indices]:
    """Return the rows of this rank without columns of nodes that they do not know, and the numbers of the others."""
    starts, columns, values = stiffness.getValuesCSR()
    block, count = stiffness.getBlockSize(), stiffness.getSize()[1]
    needed = _touched(columns, count, block)
    number = np.empty(count, dtype=PETSc.IntType)
    number[needed] = np.arange(len(needed))
    return csr_matrix((values, number[columns], starts), (len(starts) - 1, len(needed))), needed


def _elsewhere(stiffness: PETSc.Mat, vectors: Array, needed: Indices) -> Array:
    """Return rows of distributed vectors (n, k) by their numbers over all ranks, bit by bit. Collective."""
    whole = stiffness.createVecRight()
    wanted = PETSc.IS().createGeneral(needed.astype(PETSc.IntType), comm=PETSc.COMM_SELF)
    found = PETSc.Vec().createSeq(len(needed), comm=PETSc.COMM_SELF)
    scatter = PETSc.Scatter().create(whole, wanted, found, None)
    result = np.empty((len(needed), vectors.shape[1]))
    for place in range(vectors.shape[1]):
        whole.array[:] = vectors[:, place]
        scatter.scatter(whole, found)
        result[:, place] = found.array_r
    return result
