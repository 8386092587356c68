"""Sparse operators of bodies that are made before their few DOFs are: chains of many beam elements."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from scipy.sparse import csc_matrix, csr_matrix
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, SuperLU, eigsh, splu

from gapbeam.solver.errors import NotConverged, RunError
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Array, Interface, RankOnes, Springs


class SparseFactor:
    """Factor of a sparse effective operator.

    Args:
        operator: A, symmetric and positive definite.

    Raises:
        NotConverged: It is singular.
    """

    tolerance = 0.0

    def __init__(self, operator: csc_matrix) -> None:
        try:
            self._factor: SuperLU = splu(operator, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
        except RuntimeError as error:
            raise NotConverged(f"nothing holds the beam: an operator is singular ({error})") from error
        self.size = operator.shape[0]

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


class SparseOperators:
    """M and K as sparse symmetric matrices on one rank.

    Args:
        mass: M, (n, n), kg.
        stiffness: K without the restraint, (n, n), N/m.
        restraint: What a weak restraint adds to K, (n, n), N/m.
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

    def factor(
        self, mass: float, stiffness: float, springs: Springs | None = None, added: RankOnes | None = None
    ) -> SparseFactor:
        """Factor mass M + stiffness K; a basis needs no springs.

        Raises:
            NotConverged: It is singular.
        """
        assert springs is None
        assert added is None
        return SparseFactor(csc_matrix(mass * self.mass + stiffness * self.stiffness))

    def sum(self, local: Array) -> Array:
        """Return the array: there is one rank."""
        return local

    def lowest_modes(self, shift: float, count: int, factor: SparseFactor) -> tuple[Array, Array]:
        """Return squares of the lowest angular frequencies, ascending, (k,), and shapes with x^T M x = 1, (n, k).

        By shift and invert: (K + sigma M)^-1 M x = x / (s + sigma), Lanczos.

        Args:
            shift: sigma > 0, 1/s^2.
            count: k, fewer than n.
            factor: What solves with K + sigma M.

        Raises:
            RunError: They did not converge.
        """
        inverse = LinearOperator((self.size, self.size), matvec=factor.solve, dtype=float)
        start = np.random.default_rng(0).standard_normal(self.size)  # the same in every run
        try:
            squares, shapes = eigsh(self.stiffness, count, self.mass, sigma=-shift, OPinv=inverse, v0=start)
        except ArpackNoConvergence as error:
            raise RunError(f"the vibration modes of {self.size} DOFs could not be found ({error})") from error
        order = np.argsort(squares)
        return squares[order], shapes[:, order]
