"""Dense operators for systems of a few DOFs: oscillators, rods, reduced models."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from scipy.linalg import cho_factor, cho_solve, eigh
from scipy.sparse import csr_matrix

from gapbeam.solver.errors import NotConverged
from gapbeam.solver.system.operators import Array, Factor, Interface, RankOnes, Springs
from gapbeam.solver.system.refined_modes import refined_modes

ROUND_OFF = 8.0 * np.finfo(float).eps
WIDE = 1.0e4  # between the squares of the lowest and the highest frequency
FLOATS = 1.0e-12  # of the largest square of a frequency; below it a motion is a rigid one


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


class DenseOperators:
    """M and K as dense symmetric arrays on one rank.

    Args:
        mass: M, (n, n), kg.
        stiffness: K without the restraint, (n, n), N/m.
        restraint: What a weak restraint adds to K, (n, n), N/m.
    """

    def __init__(self, mass: Array, stiffness: Array, restraint: Array | None = None) -> None:
        self.mass = np.atleast_2d(mass)
        self.restraint = np.zeros_like(self.mass) if restraint is None else np.atleast_2d(restraint)
        self.stiffness = np.atleast_2d(stiffness) + self.restraint
        self.size = len(self.mass)
        self.massless = np.diagonal(self.mass) == 0.0

    @classmethod
    def of_whole(cls, mass: Array, stiffness: Array, restraint: Array) -> DenseOperators:
        """Return operators whose K, restraint included, is to the last bit what is given."""
        found = cls(mass, np.zeros_like(mass), restraint)
        found.stiffness = stiffness
        return found

    @cached_property
    def modes(self) -> tuple[Array, Array]:
        """Squares s of the angular frequencies, (n,), 1/s^2, and shapes X with X^T M X = 1, (n, n); found once.

        A system that is in modal coordinates stays as it is. Of one whose frequencies lie far apart the eigenvalues
        found are 1 / (s + sigma), of M against K + sigma M, with sigma at the lowest elastic frequency: the high
        frequencies would leave their round-off in the low ones. What the shift costs the high ones is mended then.
        """
        diagonal = np.diagonal(self.stiffness)
        coupling = np.abs(self.stiffness - np.diag(diagonal))
        eye = np.identity(self.size)
        larger = np.maximum.outer(np.abs(diagonal), np.abs(diagonal))  # what couples less than that turns no mode
        if np.array_equal(self.mass, eye) and np.all(coupling <= ROUND_OFF * larger):
            return diagonal.copy(), eye
        squares, shapes = eigh(self.stiffness, self.mass)
        elastic = squares[squares > FLOATS * squares[-1]]
        if len(elastic) == 0 or squares[-1] <= WIDE * elastic[0]:
            return squares, shapes
        shift = float(elastic[0])
        compliances, shapes = eigh(self.mass, self.stiffness + shift * self.mass)
        order = np.argsort(-compliances)
        compliances, shapes = compliances[order], shapes[:, order]
        return refined_modes(self.mass, self.stiffness, shapes / np.sqrt(compliances))

    def apply_mass(self, x: Array) -> Array:
        """Return M x."""
        return np.asarray(self.mass @ x)

    def apply_stiffness(self, x: Array) -> Array:
        """Return K x."""
        return np.asarray(self.stiffness @ x)

    def stiffness_round_off(self, x: Array) -> Array:
        """Return about how far the entries of K x are off by round-off."""
        return np.asarray(np.finfo(float).eps * np.diagonal(self.stiffness) * np.abs(x))

    def apply_restraint(self, x: Array) -> Array:
        """Return the part of K x that the restraint adds."""
        return np.asarray(self.restraint @ x)

    def factor(
        self, mass: float, stiffness: float, springs: Springs | None = None, added: RankOnes | None = None
    ) -> Factor:
        """Factor mass M + stiffness K + springs + added, positive definite; massless rows as in `Operators`.

        Raises:
            NotConverged: It is not positive definite.
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

    def sum(self, local: Array) -> Array:
        """Return the array: there is one rank."""
        return local
