"""Smooth modes of a slender body: motions that vary slowly along the axis x, and their elastic forces.

The modes are bending, stretching and twisting with Legendre polynomials P(x); the rigid-body modes are among them:

    bending  u_t = P(x), u_x = -t P'(x)  (t = y or z);    stretching  u_x = P(x);    twisting  u_y = -z P, u_z = y P

The elastic forces K Z are small, and in a product K z large entries of K cancel. Therefore K Z is computed once from
strains alone. In each short segment of the beam a fitted rigid-body motion r is subtracted first:

    (K z)_i = sum_j K_ij (z_j - r_j),    r the rigid-body motion of the segment that node i lies in

Z and K Z make a `Deflation` of K, without the round-off of the large entries of K: slender beams keep the digits of
their first frequencies and of their seat. The forces of the rigid-body modes are exactly zero.

Deflation: products and solves with A that are exact on a few known vectors Z.

Z, (n, k), is orthonormal and nearly in the null space of A: the rigid-body modes R of a floating body, or motions that
vary slowly along a slender one. In a product A z large entries of A cancel, so that round-off outweighs A z itself. The
images A Z are therefore given, with more digits, and used in three places. With P = 1 - Z Z^T and E = Z^T A Z:

    product                     A x = P A P x + Z (A Z)^T P x + (A Z) Z^T x
    correction of x ~ A^-1 b    x' = x + Z E^-1 (Z^T b - (A Z)^T x)
    two-level preconditioner    c = E^-1 Z^T b,   x = B (b - A Z c),   then the correction of x

The product is symmetric. The two-level preconditioner Q + (1 - Q A) B (1 - A Q), Q = Z E^-1 Z^T, is symmetric where B
is, and solves exactly for right sides in the span of A Z.

Source: Nicolaides (1987), SIAM J. Numer. Anal. 24, 355: deflation; Mandel (1993), Comm. Numer. Methods Eng. 9, 233: the
two-level ("balancing") preconditioner.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.polynomial.legendre import legder, legval
from petsc4py import PETSc
from scipy.linalg import LinAlgError, cho_solve, lu_factor, lu_solve, solve_triangular
from scipy.sparse import csr_matrix

from gapbeam.solver.system.operators import Array, Indices, Springs

Map = Callable[[Array], Array]


@dataclass(frozen=True)
class Deflation:
    """A basis Z and its images under a symmetric operator A.

    Attributes:
        basis: Z, (n, k), orthonormal over all ranks.
        images: A Z, (n, k).
        total: Sums an array over the ranks.

    Collective to use.
    """

    basis: Array
    images: Array
    total: Map

    def product(self, multiply: Map) -> Map:
        """Return products with A on vectors, (n,), or blocks, (n, k), exact on Z; `multiply` has round-off there."""

        def exact(x: Array) -> Array:
            coefficients = self.total(self.basis.T @ x)
            rest = x - self.basis @ coefficients
            image = multiply(rest)
            image += self.basis @ self.total(self.images.T @ rest - self.basis.T @ image)
            image += self.images @ coefficients
            return image

        return exact

    def coarse_solve(self, right_side: Array) -> Array:
        """Return E^-1 b, (k,) or (k, r), for the share of this rank in b; takes one sum over ranks."""
        return self._inverse(self.total(right_side))

    def coarse_residual(self, right_side: Array, solution: Array) -> Array:
        """Return the share of this rank in Z^T b - (A Z)^T x, (k,) or (k, r)."""
        return np.asarray(self.basis.T @ right_side - self.images.T @ solution)

    def preconditioner(self, inner: Map) -> Map:
        """Return the two-level preconditioner with B = `inner`, on blocks (n, r)."""

        def two_level(right_side: Array) -> Array:
            solution = inner(right_side - self.images @ self.coarse_solve(self.basis.T @ right_side))
            solution += self.basis @ self.coarse_solve(self.coarse_residual(right_side, solution))
            return solution

        return two_level

    @cached_property
    def _inverse(self) -> Map:
        """E^-1 on (k,) or (k, r). Where A Z has no digits beyond round-off, E may be indefinite: LU then."""
        energies = self.total(self.basis.T @ self.images)
        symmetric = 0.5 * (energies + energies.T)
        try:
            lower = np.asarray(np.linalg.cholesky(symmetric), dtype=float)
        except LinAlgError:
            return partial(lu_solve, lu_factor(symmetric), check_finite=False)
        return partial(cho_solve, (lower, True), check_finite=False)


def rigid_body_modes(space: Any) -> Array:
    """Return the rigid-body modes R, orthonormal, on a blocked vector Lagrange space: (n, 3) in 2D, (n, 6) in 3D.

    Translations, and rotations about the center as displacements linear in the coordinates; orthonormal over all
    ranks.

    Collective.
    """
    comm, block = space.mesh.comm, space.dofmap.index_map_bs
    places = space.tabulate_dof_coordinates()[: space.dofmap.index_map.size_local, :block]
    count = space.dofmap.index_map.size_global
    places = places - sum(comm.allgather(places.sum(axis=0))) / count
    axes = [np.broadcast_to(axis, places.shape) for axis in np.eye(block)]
    for first in range(block):
        for second in range(first + 1, block):
            turn = np.zeros_like(places)
            turn[:, first], turn[:, second] = -places[:, second], places[:, first]
            axes.append(turn)
    motions = np.stack([motion.reshape(-1) for motion in axes], axis=1)
    motions /= np.sqrt(sum(comm.allgather((motions**2).sum(axis=0))))
    for _ in range(2):  # twice is enough (Cholesky-QR)
        gram = sum(comm.allgather(motions.T @ motions))
        motions = np.linalg.solve(np.linalg.cholesky(gram), motions.T).T
    return np.ascontiguousarray(motions)


BENDING, AXIAL, TWIST = 16, 4, 4  # polynomials of each kind
SEGMENTS = 64  # along the beam
DEPENDENT = 1.0e-3  # least squared sine between a mode and those before it, which a coarse mesh may not resolve


def smooth_modes(space: Any, stiffness: PETSc.Mat, total: Map) -> Deflation:
    """Return the smooth modes Z on a blocked vector Lagrange space, with K Z, both (n, k).

    Args:
        space: The space.
        stiffness: K, with the rigid-body modes as null space, distributed like vectors of that space.
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
    return Deflation(shapes, images, total)


def _orthonormal(products: Array) -> Array:
    """Return C, (k, r), so that V C is orthonormal, from the scalar products V^T V, (k, k).

    Cholesky row by row. Vectors that depend on the ones before are left out: their remainder would have few digits.
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
    """Center of a body, (d,), m, and half its length, m."""

    center: Array
    half: float

    @classmethod
    def of(cls, places: Array, total: Map) -> _Frame:
        count = total(np.array([float(len(places))]))[0]
        center = total(places.sum(axis=0)) / count
        spread = total(((places[:, 0] - center[0]) ** 2).sum(keepdims=True))[0] / count
        return cls(center, float(np.sqrt(3.0 * spread)))

    def shapes(self, places: Array) -> Array:
        """Return all modes at the nodes (m, d), node by node, (m d, k); rigid-body modes first."""
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
    around = _gathered(stiffness, np.column_stack([places.reshape(-1), shapes]), needed)
    images = np.zeros_like(shapes)
    first, length = places[:, 0].min(initial=np.inf), np.ptp(places[:, 0]) if len(places) else 1.0
    segment = np.floor((places[:, 0] - first) / max(length, np.finfo(float).tiny) * SEGMENTS)
    for one in np.unique(segment):
        dofs = _dofs(np.flatnonzero(segment == one), block)
        part = rows[dofs]
        columns = _dofs_of_nodes(part.indices, len(needed), block)
        part = part[:, columns]
        images[dofs] = part @ _without_rigid_motion(around[columns, 1:], around[columns, 0].reshape(-1, block))
    return images


def _dofs_of_nodes(columns: Indices, count: int, block: int) -> Indices:
    """Return all DOFs of the nodes that some of the `count` columns belong to, ascending."""
    nodes = np.zeros(count // block, dtype=bool)
    nodes[columns // block] = True
    return _dofs(np.flatnonzero(nodes), block)


def _dofs(nodes: Indices, block: int) -> Indices:
    """Return the DOFs of nodes, node by node."""
    return np.asarray((nodes[:, None] * block + np.arange(block)).reshape(-1))


def _without_rigid_motion(moved: Array, places: Array) -> Array:
    """Return motions (m d, k) of nodes near each other, (m, d), less their rigid-body motion in least squares."""
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
    rotations, rest = np.stack(turns, axis=1), rest.reshape(len(places) * block, -1)
    return np.asarray(rest - rotations @ np.linalg.lstsq(rotations, rest)[0])


def _rows(stiffness: PETSc.Mat) -> tuple[csr_matrix, Indices]:
    """Return the rows of this rank without the columns of unconnected nodes, and the numbers of the columns kept."""
    starts, columns, values = stiffness.getValuesCSR()
    block, count = stiffness.getBlockSize(), stiffness.getSize()[1]
    needed = _dofs_of_nodes(columns, count, block)
    number = np.empty(count, dtype=PETSc.IntType)
    number[needed] = np.arange(len(needed))
    return csr_matrix((values, number[columns], starts), (len(starts) - 1, len(needed))), needed


def _gathered(stiffness: PETSc.Mat, vectors: Array, needed: Indices) -> Array:
    """Return rows of distributed vectors (n, k) by their numbers over all ranks, unrounded. Collective."""
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


def add_springs(matrix: PETSc.Mat, springs: Springs, total: Callable[[Array], Array]) -> None:
    """Add springs to a matrix on the DOFs of the body that has room for them; `total` sums over ranks. Collective."""
    interface, added = springs.interface, springs.matrix
    first = matrix.getOwnershipRange()[0]
    place = interface.numbers(first, total)
    for slot, owned in zip(interface.slots, interface.owned, strict=True):
        entries = slice(added.indptr[slot], added.indptr[slot + 1])
        columns = place[added.indices[entries]].astype(PETSc.IntType)
        matrix.setValues([int(owned + first)], columns, added.data[entries], addv=PETSc.InsertMode.ADD_VALUES)
    matrix.assemble()


def enlarge_by_springs(matrix: PETSc.Mat, springs: Springs, total: Callable[[Array], Array]) -> None:
    """Add springs to a matrix that may have no room for them, so that it grows once; as `add_springs`. Collective."""
    interface, added = springs.interface, springs.matrix
    first, end = matrix.getOwnershipRange()
    place = interface.numbers(first, total)
    counts = np.zeros(end - first, dtype=PETSc.IntType)
    counts[interface.owned] = np.diff(added.indptr)[interface.slots]
    order = np.argsort(interface.owned)
    rows = [slice(added.indptr[slot], added.indptr[slot + 1]) for slot in np.asarray(interface.slots)[order]]
    columns = np.concatenate([place[added.indices[row]] for row in rows] or [np.empty(0)]).astype(PETSc.IntType)
    values = np.concatenate([added.data[row] for row in rows] or [np.empty(0)])
    starts = np.concatenate([[0], np.cumsum(counts)]).astype(PETSc.IntType)
    sparse = PETSc.Mat().createAIJ(matrix.getSizes(), csr=(starts, columns, values), comm=matrix.comm)
    matrix.axpy(1.0, sparse, structure=PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
    sparse.destroy()


class _Product:
    def __init__(self, product: Callable[[Array], Array]) -> None:
        self._product = product

    def mult(self, _matrix: PETSc.Mat, x: PETSc.Vec, y: PETSc.Vec) -> None:
        y.array[:] = self._product(x.array_r)


def as_matrix(product: Callable[[Array], Array], like: PETSc.Mat) -> PETSc.Mat:
    """Return a symmetric linear map as PETSc's matrix, laid out like another one. Collective."""
    matrix = PETSc.Mat().createPython(like.getSizes(), _Product(product), comm=like.comm)
    matrix.setUp()
    return matrix
