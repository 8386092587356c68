"""Double integrals of shapes along a load under its coherence, and joint acceptances.

    C_jk = int int s_j(x) s_k(x') rho(|x - x'|) dx dx',    J^2_mn = C_mn / L^2

The mean square of the force of a distributed load on a mode is its density at a place times L^2 J^2_mm; between two
modes, times L^2 J^2_mn. The integral over the distance d = x - x' is taken last,

    C = int_0^L rho(d) (A(d) + A(d)^T) dd,    A_jk(d) = int_0^(L-d) s_j(x + d) s_k(x) dx,

so that the kink of rho at d = 0 lies at an end: all integrals are those of smooth functions, by Gauss's rule. Between
the knots of piecewise polynomials the inner integral is exact.

Source: Powell, On the fatigue failure of structures due to vibrations excited by random pressure fields (1958).
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from gapbeam.solver.loads.coherence.coherence_table import CoherenceTable
from gapbeam.solver.system.operators import Array

OUTER = 16  # Gauss points in a piece of the distances

Shapes = Callable[[Array], Array]
"""Shapes at places from 0 to L, (places,) to (places, shapes)."""


def joint_acceptance(
    shapes: Shapes, coherence: CoherenceTable, length: float, half_waves: float = 20.0, knots: Array | None = None
) -> Array:
    """Return J^2_mn of shapes along a load, (shapes, shapes).

    Args:
        shapes: At places from 0 to the length.
        coherence: Of the load.
        length: Of the load, m.
        half_waves: Most half waves of a shape in the length: what the number of Gauss points follows.
        knots: Places between which the shapes are smooth, m; none: smooth all along.
    """
    return np.asarray(double_integrals(shapes, coherence, length, half_waves, knots) / length**2)


def double_integrals(
    shapes: Shapes, coherence: CoherenceTable, length: float, half_waves: float, knots: Array | None = None
) -> Array:
    """Return C_jk, (shapes, shapes); arguments as those of `joint_acceptance`."""
    inner = int(12 + 2.0 * half_waves)
    given = coherence.pieces(length)
    most = 4.0 * length / (1.0 + half_waves)
    counts = [1 + int(np.ceil((end - start) / most)) for start, end in _pairs(given)]
    cuts = [np.linspace(*pair, count)[1:] for pair, count in zip(_pairs(given), counts, strict=True)]
    edges = np.concatenate([[0.0], *cuts])
    places, weights = np.polynomial.legendre.leggauss(OUTER)
    inside = np.empty(0) if knots is None else knots[(knots > 0.0) & (knots < length)]
    total = 0.0
    for start, end in _pairs(edges):
        distances = 0.5 * (start + end) + 0.5 * (end - start) * places
        rho = 0.5 * (end - start) * weights * coherence.at(distances)
        total = total + sum(
            value * _shifted(shapes, float(distance), length, inner, inside)
            for value, distance in zip(rho, distances, strict=True)
        )
    return np.asarray(total + np.transpose(total))


def _shifted(shapes: Shapes, distance: float, length: float, count: int, knots: Array) -> Array:
    """Return A(d), (shapes, shapes)."""
    edges = np.unique(np.clip(np.concatenate([[0.0, length], knots, knots - distance]), 0.0, length - distance))
    places, weights = np.polynomial.legendre.leggauss(count)
    half, middle = 0.5 * np.diff(edges), 0.5 * (edges[1:] + edges[:-1])
    x = (middle[:, None] + half[:, None] * places).ravel()
    return np.asarray(shapes(x + distance).T @ ((half[:, None] * weights).ravel()[:, None] * shapes(x)))


def _pairs(edges: Array) -> list[tuple[float, float]]:
    return list(pairwise(map(float, edges)))
