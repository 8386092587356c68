"""Point masses, springs and dampers on a body as rank-one updates of its operators.

    M = M_body + sum_j m_j b_j b_j^T,    K = K_body + sum_j k_j b_j b_j^T

b_j are the nodal forces of a unit force at the place. With A^-1 known, that of A + B^T diag(a) B, B of rows b_j, takes

    A'^-1 = A^-1 - W R W^T,    W = A^-1 B^T,    R = (1 + diag(a) B W)^-1 diag(a),

one back-substitution for each place when the factor is made, and a scalar product for each when it is used.

Source: Woodbury (1950); Hager (1989), SIAM Rev. 31.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.sparse import csr_matrix

from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Array, Factor, Interface, Operators, RankOnes, Springs


@dataclass(frozen=True)
class UpdatedFactor:
    """The factor of A + sum_j a_j b_j b_j^T from that of A.

    Attributes:
        factor: Factor of A.
        operators: Operators, for sums over ranks.
        responses: W, (n, k).
        inner: R, (k, k), symmetric.
    """

    factor: Factor
    operators: Operators
    responses: Array
    inner: Array
    tolerance: ClassVar[float] = 0.0

    def keeps(self, columns: int) -> bool:
        """Return whether so many columns A^-1 E X may be kept in memory."""
        return self.factor.keeps(columns)

    def solve(self, right_side: Array) -> Array:
        """Return A'^-1 b, (n,). Collective."""
        seen = self.operators.sum(self.responses.T @ right_side)
        return np.asarray(self.factor.solve(right_side) - self.responses @ (self.inner @ seen))

    def solve_columns(self, interface: Interface, columns: csr_matrix) -> Array:
        """Return A'^-1 E X, (n, r), column-major. Collective."""
        solved = self.factor.solve_columns(interface, columns)
        seen = self.operators.sum(np.asarray(columns[interface.slots].T @ self.responses[interface.owned]).T)
        solved -= self.responses @ (self.inner @ seen)
        return solved

    def interface_block(self, interface: Interface) -> Array | None:
        """Return E^T A'^-1 E, (interface.size, interface.size), symmetric, or None. Collective."""
        block = self.factor.interface_block(interface)
        if block is None:
            return None
        mine = np.zeros((interface.size, len(self.inner)))
        mine[interface.slots] = self.responses[interface.owned]
        seen = self.operators.sum(mine)
        changed = block - seen @ (self.inner @ seen.T)
        return np.asarray(0.5 * (changed + changed.T))


def updated(factor: Factor, operators: Operators, added: RankOnes | None) -> Factor:
    """Return the factor of A + sum_j a_j b_j b_j^T.

    Args:
        factor: The factor of A.
        operators: Operators, for sums over ranks.
        added: The sum; None: A stays what it is.

    Collective.
    """
    if added is None:
        return factor
    responses = np.stack([factor.solve(pattern) for pattern in added.patterns], axis=1)
    scales, inner = inner_inverse(operators.sum(added.patterns @ responses), added.coefficients)
    return UpdatedFactor(factor, operators, responses * scales, inner)


def inner_inverse(flexibility: Array, coefficients: Array) -> tuple[Array, Array]:
    """Return powers of two c, (k,), and R of c_j W_j, (k, k), symmetric, with A'^-1 = A^-1 - (W c) R (W c)^T.

    Displacements and rotations have different units. The scales make the entries of all about 1, so that round-off does
    not depend on the size of a scene.

    Args:
        flexibility: B W, (k, k).
        coefficients: a, (k,).
    """
    sizes = np.abs(np.diagonal(flexibility))
    scales = np.exp2(-np.round(0.5 * np.log2(np.where(sizes > 0.0, sizes, 1.0))))
    scaled, changed = np.outer(scales, scales) * (0.5 * (flexibility + flexibility.T)), coefficients / scales**2
    inner = np.linalg.solve(np.eye(len(scaled)) + changed[:, None] * scaled, np.diag(changed))
    return scales, 0.5 * (inner + inner.T)


class AttachedOperators:
    """M and K of a body with masses and springs at some of its places.

    Args:
        body: The operators of the body alone.
        masses: Moving masses, kg.
        springs: Springs to the frame, N/m, at the same places.
        restraint: Springs among them that are weak restraints.

    Attributes:
        body: The operators of the body alone.
        masses: As given.
        springs: As given.
        restraint: As given.
    """

    def __init__(self, body: Operators, masses: RankOnes, springs: RankOnes, restraint: RankOnes) -> None:
        self.body, self.masses, self.springs, self.restraint = body, masses, springs, restraint
        self.size, self.massless = body.size, body.massless
        self._spring_diagonal = springs.coefficients @ springs.patterns**2

    def apply_mass(self, x: Array) -> Array:
        """Return M x. Collective."""
        return self.body.apply_mass(x) + self.masses.apply(x, self.body)

    def apply_stiffness(self, x: Array) -> Array:
        """Return K x. Collective."""
        return self.body.apply_stiffness(x) + self.springs.apply(x, self.body)

    def stiffness_round_off(self, x: Array) -> Array:
        """Return about how far the entries of K x are off by round-off."""
        springs = np.finfo(float).eps * self._spring_diagonal * np.abs(x)
        return np.asarray(self.body.stiffness_round_off(x) + springs)

    def apply_restraint(self, x: Array) -> Array:
        """Return the part of K x that the restraint adds. Collective."""
        return self.body.apply_restraint(x) + self.restraint.apply(x, self.body)

    def factor(
        self, mass: float, stiffness: float, springs: Springs | None = None, added: RankOnes | None = None
    ) -> Factor:
        """Factor mass M + stiffness K + springs + added; rows of massless DOFs as in `Operators`. Collective."""
        both = self.masses.times(mass).and_also(self.springs.times(stiffness)).and_also(added)
        return self.body.factor(mass, stiffness, springs, both)

    def sum(self, local: Array) -> Array:
        """Sum a small array over all ranks. Collective."""
        return self.body.sum(local)


def attached(body: Operators, masses: RankOnes, springs: RankOnes, restraint: RankOnes) -> Operators:
    """Return the operators of a body with masses and springs at some of its places.

    Args:
        body: The operators of the body alone, which do not change.
        masses: Moving masses, kg.
        springs: Springs to the frame, N/m, at the same places.
        restraint: Springs among them that are weak restraints.
    """
    if not (np.any(masses.coefficients) or np.any(springs.coefficients)):
        return body
    if isinstance(body, DenseOperators):
        whole = body.stiffness + springs.matrix
        return DenseOperators.of_whole(body.mass + masses.matrix, whole, body.restraint + restraint.matrix)
    return AttachedOperators(body, masses, springs, restraint)
