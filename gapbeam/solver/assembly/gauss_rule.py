"""The Gauss rule of a discrete measure: few nodes instead of many points.

The rule of points y_j with weights w_j has k nodes y_i and weights A_i, and integrates polynomials of degree 2 k - 1
like the points themselves. A node takes the value of the polynomial of degree k - 1 that fits the values f_j best,

    f_i = sum_j P_ij f_j,    P_ij = w_j sum_a pi_a(y_i) pi_a(y_j),    sum_j P_ij = 1,

with pi_a the orthonormal polynomials of the measure.

Source: Golub and Welsch (1969) for the rule from the recurrence of the polynomials.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gapbeam.solver.system.operators import Array

SAME_PLACE = 1.0e-6  # of the length over which the points lie


@dataclass(frozen=True)
class GaussRule:
    """Nodes instead of points.

    Attributes:
        areas: A, (k,).
        at_nodes: pi_a at the nodes, (k, k), polynomial by polynomial.
        moments: w_j pi_a(y_j), (k, points): what gives the coefficients of the best fit.
    """

    areas: Array
    at_nodes: Array
    moments: Array

    @property
    def rows(self) -> Array:
        """P, (k, points)."""
        return np.asarray(self.at_nodes.T @ self.moments)


def gauss_rule(y: Array, weights: Array, count: int) -> GaussRule:
    """Return the Gauss rule of a discrete measure.

    Args:
        y: Places of the points, (points,), m.
        weights: Weights of the points, (points,).
        count: Number of nodes; fewer where points lie at fewer places.
    """
    total = float(weights.sum())
    polynomials = [np.full(len(y), 1.0 / np.sqrt(total))]
    alphas, betas = [float(weights @ (y * polynomials[0] ** 2))], list[float]()
    # points at one place are apart by the round-off of their coordinate
    span = max(float(np.ptp(y)), SAME_PLACE * float(np.abs(y).max()), np.finfo(float).tiny)
    for _ in range(1, count):
        following = (y - alphas[-1]) * polynomials[-1]
        if betas:
            following = following - betas[-1] * polynomials[-2]
        for known in polynomials:  # again: the recurrence loses orthogonality
            following = following - known * float(weights @ (known * following))
        norm = float(np.sqrt(weights @ following**2))
        if norm <= SAME_PLACE * span:
            break  # the measure has no more points than this
        betas.append(norm)
        polynomials.append(following / norm)
        alphas.append(float(weights @ (y * polynomials[-1] ** 2)))
    _, vectors = np.linalg.eigh(np.diag(alphas) + np.diag(betas, 1) + np.diag(betas, -1))
    # pi_a(y_i) = vectors[a, i] / sqrt(A_i), and A_i = total vectors[0, i]^2, the vectors turned such that pi_0 > 0
    areas = total * vectors[0] ** 2
    values = vectors * np.sign(vectors[0]) / np.sqrt(areas)
    return GaussRule(areas, values, np.array(polynomials) * weights)
