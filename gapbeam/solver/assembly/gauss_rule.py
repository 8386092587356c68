"""Gauss rules: few nodes instead of many points, and stations along a support.

The rule of points y_j with weights w_j has k nodes y_i and weights A_i, and integrates polynomials of degree 2 k - 1
like the points themselves. A node takes the value of the polynomial of degree k - 1 that fits the values f_j best,

    f_i = sum_j P_ij f_j,    P_ij = w_j sum_a pi_a(y_i) pi_a(y_j),    sum_j P_ij = 1,

with pi_a the orthonormal polynomials of the measure.

Stations along a support are nodes of the Gauss-Lobatto rule: the first and the last lie at its edges, where a beam that
tilts touches first, and n of them integrate polynomials of degree 2 n - 3. Force and couple of a depth that is linear
along the support follow from three. One or two stations are those of the Gauss rule, as two at the edges would have
three times the couple.

Sources: Golub and Welsch (1969) for the rule from the recurrence of the polynomials; Golub (1973), SIAM Review 15,
318-334, for a node at an edge; Davis and Rabinowitz (1984), Methods of Numerical Integration, section 2.7, for nodes at
the ends.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import Legendre, leggauss, legvander

from gapbeam.solver.system.operators import Array

SAME_PLACE = 1.0e-6  # of the length over which the points lie
FEWEST_AT_EDGES = 3  # stations, the first and the last of which lie at the edges of a support


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

    def values(self, y: Array, places: Array) -> Array:
        """Return pi_a at other places, (k, places), polynomial by polynomial.

        Args:
            y: Places of the points, (points,), m.
            places: Other places, m.
        """
        nodes = self.rows @ y
        middle, half = float(nodes.mean()), float(np.ptp(nodes)) or 1.0
        own, wanted = (legvander((some - middle) / half, len(nodes) - 1) for some in (nodes, places))
        return np.asarray((wanted @ np.linalg.solve(own, self.at_nodes.T)).T)


def gauss_rule(y: Array, weights: Array, count: int, edge: float | None = None) -> GaussRule:
    """Return the Gauss rule of a discrete measure, or the Gauss-Radau rule with a node at an edge.

    Args:
        y: Places of the points, (points,), m.
        weights: Weights of the points, (points,).
        count: Number of nodes; fewer where points lie at fewer places.
        edge: Place of one node, m, no point beyond it; polynomials are integrated up to degree 2 k - 2.
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
    if edge is not None:  # the polynomial of degree k vanishes there
        at_edge = [1.0, 0.0]
        for alpha, beta, last in zip(alphas[:-1], betas, [0.0, *betas], strict=False):
            at_edge = [((edge - alpha) * at_edge[0] - last * at_edge[1]) / beta, at_edge[0]]
        alphas[-1] = edge - (betas[-1] if betas else 0.0) * at_edge[1] / at_edge[0]
    _, vectors = np.linalg.eigh(np.diag(alphas) + np.diag(betas, 1) + np.diag(betas, -1))
    # pi_a(y_i) = vectors[a, i] / sqrt(A_i), and A_i = total vectors[0, i]^2, the vectors turned such that pi_0 > 0
    areas = total * vectors[0] ** 2
    values = vectors * np.sign(vectors[0]) / np.sqrt(areas)
    return GaussRule(areas, values, np.array(polynomials) * weights)


def stations_along(start: float, end: float, count: int) -> tuple[Array, Array]:
    """Return x of stations along a support, (count,), m, and the share of its length that each stands for, (count,).

    Args:
        start: x of its first edge, m.
        end: x of its other edge, m.
        count: Number of stations.
    """
    if count < FEWEST_AT_EDGES:
        nodes, weights = (np.asarray(some) for some in leggauss(count))
    else:
        last = Legendre.basis(count - 1)
        nodes = np.array([-1.0, *sorted(last.deriv().roots().real), 1.0])
        weights = np.asarray(1.0 / last(nodes) ** 2, dtype=float)
    nodes, weights = nodes - nodes[::-1], weights + weights[::-1]  # even up to the last bit
    return start + 0.25 * (end - start) * (2.0 + nodes), weights / weights.sum()
