"""Motions of a slender body that vary slowly along it, and what stiffness makes of them, to more digits than K has.

Bending, stretching and twisting that follow polynomials P along the beam's axis x, rigid motions among them:

    u_t = P(x), u_x = -t P'(x);      u_x = P(x);      u_y = -z P(x), u_z = y P(x)

Elasticity hardly feels them, so in K z large numbers cancel, and round-off of the stiffest entries of K is what low
frequencies would see: in K itself, in every product with it, and in its factor. So K z is found here once, from what
the nodes of a short stretch of the beam do beside moving together,

    (K z)_i = sum_j K_ij (z_j - r_j),    r the rigid motion of the stretch that node i lies in,

and K x = K (x - Z a) + (K Z) a with a = Z^T x. Neither depends on the order in which K was assembled, but for round-off
of strains.
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

BENDING, AXIAL, TWIST = 16, 4, 4  # polynomials of each kind: bending to some kHz for a beam of half a metre
STRETCHES = 64  # along the beam

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
        return np.asarray(stiffness(x - self.shapes @ shares) + self.images @ shares)


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
    scale = np.eye(frame.shapes(places[:1]).shape[1])
    for _ in range(2):  # twice is enough (Cholesky-QR)
        shapes = frame.shapes(places) @ scale
        factor = np.linalg.cholesky(total(shapes.T @ shapes))
        scale = solve_triangular(factor, scale.T, lower=True).T
    shapes = frame.shapes(places) @ scale
    images = _images(stiffness, places, frame, scale)
    return SmoothMotions(shapes, images, total)


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
        """Return all motions at some places (m, d), node by node, (m d, k)."""
        block = places.shape[1]
        along, *across = (places - self.center).T
        along = along / self.half
        waves, count = np.eye(max(BENDING, AXIAL, TWIST)), len(places)
        values, slopes = legval(along, waves), legval(along, legder(waves)) / self.half
        bending = np.zeros((block - 1, BENDING, count, block))
        for axis in range(1, block):
            bending[axis - 1, ..., axis] = values[:BENDING]
            bending[axis - 1, ..., 0] = -across[axis - 1] * slopes[:BENDING]
        axial = np.zeros((AXIAL, count, block))
        axial[..., 0] = values[:AXIAL]
        kinds = [*bending, axial]
        if block == 3:
            twist = np.zeros((TWIST, count, block))
            twist[..., 1], twist[..., 2] = -across[1] * values[:TWIST], across[0] * values[:TWIST]
            kinds.append(twist)
        return np.ascontiguousarray(np.concatenate(kinds).reshape(-1, count * block).T)


def _images(stiffness: PETSc.Mat, places: Array, frame: _Frame, scale: Array) -> Array:
    """Return K Z, (n, k). Collective."""
    block = places.shape[1]
    rows, around = _rows_with_places(stiffness, places)
    images = np.zeros((len(places) * block, len(scale)))
    stretch = np.floor((places[:, 0] - frame.center[0]) / frame.half * (STRETCHES / 2)).astype(np.int64)
    for one in np.unique(stretch):
        nodes = np.flatnonzero(stretch == one)
        dofs = (nodes[:, None] * block + np.arange(block)).reshape(-1)
        part = rows[dofs]
        near = np.unique(part.indices // block)
        columns = (near[:, None] * block + np.arange(block)).reshape(-1)
        place = np.empty(rows.shape[1], dtype=np.int64)
        place[columns] = np.arange(len(columns))
        here = csr_matrix((part.data, place[part.indices], part.indptr), (len(dofs), len(columns)))
        images[dofs] = here @ _deformed(frame.shapes(around[near]) @ scale, around[near])
    return images


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


def _rows_with_places(stiffness: PETSc.Mat, places: Array) -> tuple[csr_matrix, Array]:
    """Return the rows of this rank, with numbers of their own for the columns, and the places of these. Collective."""
    block = places.shape[1]
    starts, columns, values = stiffness.getValuesCSR()
    used = np.zeros(stiffness.getSize()[1] // block, dtype=bool)
    used[columns // block] = True
    near = np.flatnonzero(used)
    number: Indices = np.empty(len(used), dtype=np.int64)
    number[near] = np.arange(len(near))
    rows = csr_matrix((values, number[columns // block] * block + columns % block, starts), (len(starts) - 1, len(near) * block))
    whole = stiffness.createVecRight()
    whole.array[:] = places.reshape(-1)
    wanted = (near[:, None] * block + np.arange(block)).reshape(-1).astype(PETSc.IntType)
    found = PETSc.Vec().createSeq(len(wanted), comm=PETSc.COMM_SELF)
    wanted_set = PETSc.IS().createGeneral(wanted, comm=PETSc.COMM_SELF)
    scatter = PETSc.Scatter().create(whole, wanted_set, found, None)
    scatter.scatter(whole, found)
    return rows, np.array(found.array_r).reshape(-1, block)
