"""Dense operators for systems of a few DOFs: oscillators, rods, reduced models.

Masses on springs beside a body, which nothing but contact couples to it, are part of the dense system:

    M = diag(M_beam, m_1, m_2, ...),    K = diag(K_beam, k_1, k_2, ...)

The DOFs of the masses come after those of the beam. Chains of many beam elements have sparse operators until their few
DOFs are made.

Lowest modes of large systems by a block Lanczos method, whose solves take many right sides at once.

The space of V_1, (K + sigma M)^-1 M V_1, ... is made M-orthonormal as a whole, so that repeated frequencies and rigid
motions are found, too. Of a Ritz pair T V y = theta V y + W E^T y the residual is the part of y in the last block.
Source: Grimes, Lewis and Simon (1994), SIAM J. Matrix Anal. Appl. 15, 228.

Factors of large symmetric matrices by MUMPS, where PETSc is installed.

With nested dissection solids of 87 000 DOFs take a twentieth of the time of SuperLU, and several right sides at once an
eighth of the time of one after the other. Small matrices, and installations without PETSc, take SuperLU.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from importlib.machinery import PathFinder
from typing import Any, ClassVar

import numpy as np
from scipy.linalg import block_diag, cho_factor, cho_solve, eigh
from scipy.sparse import csc_matrix, csr_matrix
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, SuperLU, eigsh, splu

from gapbeam.solver.messages.errors import NotConverged, RunError
from gapbeam.solver.system.operators import Array, Factor, Interface, RankOnes, Springs

BLOCK = 16
CONVERGED = 1e-11
"""Residual of a shape, relative to its 1 / (s + sigma)."""
LOST = 1e-12  # of the length of a vector: what is left of it is round-off
MOST = 12  # vectors for each mode, and as many blocks beside


def lowest_modes_by_blocks(
    solve: Callable[[Array], Array], mass: Callable[[Array], Array], size: int, shift: float, count: int
) -> tuple[Array, Array]:
    """Return squares s of the lowest angular frequencies, ascending, (count,), and M-orthonormal shapes, (n, count).

    Args:
        solve: (K + sigma M)^-1 b, of several columns.
        mass: M x.
        size: n.
        shift: sigma, 1/s^2.
        count: Modes, fewer than n.

    Raises:
        RunError: The iterations did not converge.
    """
    start = np.random.default_rng(0).standard_normal((size, min(BLOCK, size)))  # the same in every run
    V = _orthonormal(solve(mass(start)), np.zeros((size, 0)), mass)
    H: Array = np.zeros((0, 0))
    last = V
    while True:
        answers = solve(mass(last))
        new = V.T @ mass(answers)
        m, added = V.shape[1], last.shape[1]
        H = np.asarray(
            np.block([[H, new[: m - added]], [new[: m - added].T, 0.5 * (new[m - added :] + new[m - added :].T)]])
        )
        beyond = answers - V @ new
        beyond -= V @ (V.T @ mass(beyond))
        sizes, Y = np.linalg.eigh(H)
        first = slice(m - 1, m - 1 - count if m > count else None, -1)
        residuals = np.sqrt(np.einsum("ij,ij->j", beyond, mass(beyond)))
        worst = residuals.max(initial=0.0) * np.abs(Y[m - added :, first]).max(axis=0, initial=0.0)
        if m >= count and (np.all(worst <= CONVERGED * np.abs(sizes[first])) or m == size):
            return 1.0 / sizes[first] - shift, V @ Y[:, first]
        last = _orthonormal(beyond, V, mass)
        if not last.shape[1] or m > MOST * (count + BLOCK):
            raise RunError(f"the vibration modes of {size} DOFs could not be found")
        V = np.hstack([V, last])


def _orthonormal(vectors: Array, V: Array, mass: Callable[[Array], Array]) -> Array:
    """Return an M-orthonormal basis of vectors beside those of V; directions lost in round-off are left out."""
    lengths = np.sqrt(np.einsum("ij,ij->j", vectors, mass(vectors)))
    found = vectors[:, lengths > 0.0] / lengths[lengths > 0.0]
    for _ in range(2):
        found = found - V @ (V.T @ mass(found))
        squares, turn = np.linalg.eigh(found.T @ mass(found))
        kept = squares > LOST * squares.max(initial=0.0)
        found = found @ (turn[:, kept] / np.sqrt(squares[kept]))
    return np.asarray(found)


LARGE = 10_000
"""DOFs from which on MUMPS is worth its start."""


def is_for_mumps(size: int) -> bool:
    """Return whether MUMPS factors a matrix of so many rows here: where petsc4py is installed."""
    return size >= LARGE and PathFinder.find_spec("petsc4py") is not None


class LargeFactor:
    """Factor L D L^T of a symmetric matrix on one rank.

    Args:
        operator: A, sparse, with both triangles.

    Raises:
        NotConverged: The matrix is singular, or there is not enough memory.
    """

    def __init__(self, operator: Any) -> None:
        from petsc4py import PETSc

        A, index = operator.tocsr(), PETSc.IntType
        A.sort_indices()
        csr = (A.indptr.astype(index), A.indices.astype(index), A.data)
        whole = PETSc.Mat().createAIJ(A.shape, csr=csr, comm=PETSc.COMM_SELF)
        whole.setOption(PETSc.Mat.Option.SYMMETRIC, True)
        made = PETSc.PC().create(PETSc.COMM_SELF)
        made.setOperators(whole)
        made.setType("cholesky")
        made.setFactorSolverType("mumps")
        try:
            made.setUp()
        except PETSc.Error as error:
            raise NotConverged(f"an operator of {A.shape[0]} DOFs cannot be factored ({error})") from None
        if made.getFailedReason() != 0:
            raise NotConverged(f"nothing holds the beam: an operator of {A.shape[0]} DOFs is singular")
        self._made, self._factored = made, made.getFactorMatrix()

    def solve(self, right_side: Array) -> Array:
        """Return A^-1 b, (n,) or, of several columns at once, (n, k)."""
        from petsc4py import PETSc

        if right_side.size == 0:
            return np.zeros(right_side.shape)
        columns = np.asfortranarray(right_side.reshape(len(right_side), -1))
        given = PETSc.Mat().createDense(columns.shape, array=columns, comm=PETSc.COMM_SELF)
        found = PETSc.Mat().createDense(columns.shape, comm=PETSc.COMM_SELF)
        found.setUp()
        self._factored.matSolve(given, found)
        answer = np.array(found.getDenseArray(), dtype=float)
        return np.asarray(answer.reshape(right_side.shape))


ROUND_OFF = 8.0 * np.finfo(float).eps
WIDE = 1.0e4  # between the squares of two frequencies: the higher one leaves round-off in the lower one
SMALL = 1.0e-6  # rad: a larger turn of two modes is none that round-off leaves


def with_steady_signs(shapes: Array) -> Array:
    """Return shapes, (n, k), with the signs at which their products with n fixed weights are above 0.

    An eigensolver leaves signs to round-off. With these, shapes change smoothly as a structure does, so that motions
    in modes can be compared, followed and differentiated over its parameters.
    """
    weights = np.random.default_rng(0).standard_normal(len(shapes))  # the same in every run; no symmetry makes it 0
    return np.asarray(shapes * np.where(weights @ shapes < 0.0, -1.0, 1.0))


def _coupled_modes(mass: Array, stiffness: Array) -> tuple[Array, Array]:
    """Return squares of the angular frequencies and shapes, as `DenseOperators.modes`.

    High frequencies leave their round-off in the low ones, but hardly in the space of their shapes X: there
    X^T K X y = s y gives them anew, again and again down to the lowest. What still couples modes i and j then turns
    both by S_ij / (s_j - s_i), S = X^T K X, where that is small (Ogita and Aishima 2018, Japan J. Indust. Appl. Math.
    35, 1007).
    """
    squares, shapes = eigh(stiffness, mass)
    if squares[-1] > WIDE * squares[0]:
        low = len(squares)
        while low > 0 and squares[low - 1] > 0.0:
            low = int(np.searchsorted(squares[:low], squares[low - 1] / WIDE))
            lowest = shapes[:, :low]
            projected = lowest.T @ (stiffness @ lowest)
            squares[:low], turn = np.linalg.eigh(0.5 * (projected + projected.T))
            shapes[:, :low] = lowest @ turn
        coupling = np.tril(shapes.T @ (stiffness @ shapes), -1)  # K acts on the lower one: least round-off
        apart = squares - squares[:, None]
        small = np.abs(coupling) < SMALL * np.abs(apart)
        turn = np.divide(coupling, apart, out=np.zeros_like(apart), where=small)
        shapes = shapes + shapes @ (turn - turn.T)
        shapes = shapes / np.sqrt(np.einsum("ij,ij->j", shapes, mass @ shapes))
        squares = np.einsum("ij,ij->j", shapes, stiffness @ shapes)
    return squares, shapes


@dataclass(frozen=True)
class DenseFactor:
    """Cholesky factor of a dense effective operator."""

    cholesky: tuple[Array, bool]
    tolerance: ClassVar[float] = 0.0

    def keeps(self, _columns: int) -> bool:
        """Return True: there are few DOFs."""
        return True

    def solve(self, right_side: Array) -> Array:
        """Return A^-1 b, (n,)."""
        return np.asarray(cho_solve(self.cholesky, right_side))

    def solve_columns(self, interface: Interface, columns: csr_matrix) -> Array:
        """Return A^-1 E X, (n, r)."""
        right_sides = np.zeros((len(self.cholesky[0]), columns.shape[1]))
        right_sides[interface.owned] = columns.toarray()[interface.slots]
        return np.asfortranarray(cho_solve(self.cholesky, right_sides))

    def interface_block(self, _interface: Interface) -> None:
        """Return None: all columns are at hand."""


class _Products:
    """Products with matrices on one rank, dense or sparse."""

    mass: Any
    stiffness: Any
    restraint: Any

    def apply_mass(self, x: Array) -> Array:
        """Return M x."""
        return np.asarray(self.mass @ x)

    def apply_stiffness(self, x: Array) -> Array:
        """Return K x."""
        return np.asarray(self.stiffness @ x)

    def stiffness_round_off(self, x: Array) -> Array:
        """Return about how far the entries of K x are off by round-off."""
        return np.asarray(np.finfo(float).eps * self.stiffness.diagonal() * np.abs(x))

    def apply_restraint(self, x: Array) -> Array:
        """Return the part of K x that the restraint adds."""
        return np.asarray(self.restraint @ x)

    def sum(self, local: Array) -> Array:
        """Return the array: there is one rank."""
        return local


class DenseOperators(_Products):
    """M and K as dense symmetric arrays on one rank.

    Args:
        mass: M, (n, n), kg.
        stiffness: K without the restraint, (n, n), N/m.
        restraint: Stiffness of a weak restraint, (n, n), N/m.
    """

    def __init__(self, mass: Array, stiffness: Array, restraint: Array | None = None) -> None:
        self.mass = np.atleast_2d(mass)
        self.restraint = np.zeros_like(self.mass) if restraint is None else np.atleast_2d(restraint)
        self.stiffness = np.atleast_2d(stiffness) + self.restraint
        self.size = len(self.mass)
        self.massless = np.diagonal(self.mass) == 0.0

    @classmethod
    def of_whole(cls, mass: Array, stiffness: Array, restraint: Array) -> DenseOperators:
        """Return operators whose K, restraint included, is the given one to the last bit."""
        found = cls(mass, np.zeros_like(mass), restraint)
        found.stiffness = stiffness
        return found

    @cached_property
    def modes(self) -> tuple[Array, Array]:
        """Squares s of the angular frequencies, (n,), 1/s^2, and shapes X with X^T M X = 1, (n, n); found once.

        A system that is in modal coordinates stays as it is. Modes of DOFs that do not couple, such as those of bending
        in two planes, are found separately.
        """
        diagonal = np.diagonal(self.stiffness)
        coupling = np.abs(self.stiffness - np.diag(diagonal))
        eye = np.identity(self.size)
        larger = np.maximum.outer(np.abs(diagonal), np.abs(diagonal))  # what couples less than that turns no mode
        if np.array_equal(self.mass, eye) and np.all(coupling <= ROUND_OFF * larger):
            return diagonal.copy(), eye
        count, labels = connected_components(csr_matrix((self.mass != 0.0) | (self.stiffness != 0.0)), directed=False)
        squares, shapes, end = np.empty(self.size), np.zeros((self.size, self.size)), 0
        for label in range(count):
            own = np.flatnonzero(labels == label)
            first, end = end, end + len(own)
            block = np.ix_(own, own)
            squares[first:end], shapes[own, first:end] = _coupled_modes(self.mass[block], self.stiffness[block])
        order = np.argsort(squares, kind="stable")
        return squares[order], with_steady_signs(shapes[:, order])

    def factor(
        self, mass: float, stiffness: float, springs: Springs | None = None, added: RankOnes | None = None
    ) -> Factor:
        """Factor mass M + stiffness K + springs + added, positive definite; massless rows as in `Operators`.

        Raises:
            NotConverged: The operator is not positive definite.
        """
        effective = mass * self.mass + stiffness * self.stiffness
        if stiffness == 0.0:
            block = np.ix_(self.massless, self.massless)
            effective[block] = self.stiffness[block]
        if springs is not None:
            owned, slots = springs.interface.owned, springs.interface.slots
            effective[np.ix_(owned, owned)] += springs.matrix.toarray()[np.ix_(slots, slots)]
        if added is not None:
            effective += added.matrix
        try:
            return DenseFactor(cho_factor(effective))
        except np.linalg.LinAlgError as error:
            raise NotConverged(
                "round-off hides what holds the beam beside the largest stiffness: an operator is not positive "
                f"definite ({error}); try a stiffer restraint.axial, and restraint.lateral in 3D"
            ) from error


class MassesBeside(DenseOperators):
    """M and K of a dense system and of masses on springs to the frame.

    Args:
        beam: The system without them.
        masses: m, (k,), kg.
        springs: k, (k,), N/m.
    """

    def __init__(self, beam: DenseOperators, masses: Array, springs: Array) -> None:
        super().__init__(
            block_diag(beam.mass, np.diag(masses)),
            np.zeros((beam.size + len(masses),) * 2),
            block_diag(beam.restraint, np.zeros((len(masses),) * 2)),
        )
        self.stiffness = block_diag(beam.stiffness, np.diag(springs))  # equal to the beam's to the last bit
        self._beam, self._masses, self._springs = beam, masses, springs

    @cached_property
    def modes(self) -> tuple[Array, Array]:
        """Modes of the beam, and each mass on its spring: a stiff spring leaves no round-off in the others."""
        squares, shapes = self._beam.modes
        alone = np.diag(1.0 / np.sqrt(self._masses))
        return np.concatenate([squares, self._springs / self._masses]), block_diag(shapes, alone)


class SparseFactor:
    """Factor of a sparse effective operator.

    Args:
        operator: A, symmetric and positive definite.

    Raises:
        NotConverged: The matrix is singular.
    """

    tolerance = 0.0

    def __init__(self, operator: csc_matrix) -> None:
        self.size = operator.shape[0]
        self._factor: SuperLU | LargeFactor
        if is_for_mumps(self.size):
            self._factor = LargeFactor(operator)
            return
        try:
            self._factor = splu(operator, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
        except RuntimeError as error:
            raise NotConverged(f"nothing holds the beam: an operator is singular ({error})") from error

    def keeps(self, _columns: int) -> bool:
        """Return True: solves are quick."""
        return True

    def solve(self, right_side: Array) -> Array:
        """Return A^-1 b, (n,) or, of several columns, (n, k)."""
        return np.asarray(self._factor.solve(np.asfortranarray(right_side)))

    def solve_columns(self, interface: Interface, columns: csr_matrix) -> Array:
        """Return A^-1 E X, (n, r)."""
        right_sides = np.zeros((self.size, columns.shape[1]))
        right_sides[interface.owned] = columns.toarray()[interface.slots]
        return np.asfortranarray(self.solve(right_sides))

    def interface_block(self, _interface: Interface) -> None:
        """Return None: all columns are at hand."""


class SparseOperators(_Products):
    """M and K as sparse symmetric matrices on one rank.

    Args:
        mass: M, (n, n), kg.
        stiffness: K without the restraint, (n, n), N/m.
        restraint: Stiffness of a weak restraint, (n, n), N/m.
    """

    def __init__(self, mass: csr_matrix, stiffness: csr_matrix, restraint: csr_matrix | None = None) -> None:
        self.mass = csr_matrix(mass)
        self.restraint = csr_matrix(self.mass.shape) if restraint is None else csr_matrix(restraint)
        self.elastic = csr_matrix(stiffness)
        self.stiffness = self.elastic if restraint is None else csr_matrix(self.elastic + self.restraint)
        self.size = int(self.mass.shape[0])
        self.massless = self.mass.diagonal() == 0.0

    @cached_property
    def dense(self) -> DenseOperators:
        """The same as dense arrays."""
        restraint = None if self.restraint.nnz == 0 else self.restraint.toarray()
        return DenseOperators(self.mass.toarray(), self.elastic.toarray(), restraint)

    def factor(
        self, mass: float, stiffness: float, springs: Springs | None = None, added: RankOnes | None = None
    ) -> SparseFactor:
        """Factor mass M + stiffness K; a basis needs no springs.

        Raises:
            NotConverged: The operator is singular.
        """
        assert springs is None
        assert added is None
        return SparseFactor(csc_matrix(mass * self.mass + stiffness * self.stiffness))

    def lowest_modes(self, shift: float, count: int, factor: SparseFactor) -> tuple[Array, Array]:
        """Return squares of the lowest angular frequencies, ascending, (k,), and shapes with x^T M x = 1, (n, k).

        By shift and invert: (K + sigma M)^-1 M x = x / (s + sigma), Lanczos.

        Args:
            shift: sigma > 0, 1/s^2.
            count: k, fewer than n.
            factor: Solver for K + sigma M.

        Raises:
            RunError: The iterations did not converge.
        """
        if is_for_mumps(self.size):
            return lowest_modes_by_blocks(factor.solve, self.apply_mass, self.size, shift, count)
        inverse = LinearOperator((self.size, self.size), matvec=factor.solve, dtype=float)
        start = np.random.default_rng(0).standard_normal(self.size)  # the same in every run
        try:
            squares, shapes = eigsh(self.stiffness, count, self.mass, sigma=-shift, OPinv=inverse, v0=start)
        except ArpackNoConvergence as error:
            raise RunError(f"the vibration modes of {self.size} DOFs could not be found ({error})") from error
        order = np.argsort(squares)
        return squares[order], shapes[:, order]
