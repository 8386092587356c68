"""Reference cells in the order of basix: corners, facets, Lagrange shapes, quadrature.

Intervals, quadrilaterals and hexahedra are products of intervals: N_ij(x, y) = L_i(x) L_j(y), and NumPy is enough. A
node belongs to the smallest corner, edge, side or cell that holds it; nodes are numbered corners first, then edges,
sides and the cell, each in the order of its corners. Triangles and tetrahedra take basix, which DOLFINx brings.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import product
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

PRODUCTS = {"interval": 1, "quadrilateral": 2, "hexahedron": 3}
SIMPLICES = ("triangle", "tetrahedron")
FACETS = {"triangle": "interval", "quadrilateral": "interval", "tetrahedron": "triangle", "hexahedron": "quadrilateral"}
"""Dimension of products of intervals; cells that basix serves; type of the facets of a cell."""
ROUNDS, CLOSE = 30, 1.0e-13  # of Newton's method; of the reference cell
FAR = 1.0e3  # cells away: Newton's method has left


@dataclass(frozen=True)
class LagrangeCell:
    """Lagrange shapes on a reference cell.

    Attributes:
        cell: Its type, such as "hexahedron".
        degree: Degree of the shapes, 1 or 2.
    """

    cell: str
    degree: int

    @property
    def places(self) -> Array:
        """The nodes, (k, d)."""
        if self.cell in PRODUCTS:
            return np.array(_numbered(PRODUCTS[self.cell], self.degree)) / self.degree
        return np.asarray(_simplex_element(self.cell, self.degree).points)

    def tabulate(self, points: Array) -> tuple[Array, Array]:
        """Return values, (q, k), and derivatives, (d, q, k), at points of the reference cell, (q, d)."""
        if self.cell not in PRODUCTS:
            found = _simplex_element(self.cell, self.degree).tabulate(1, points)[..., 0]
            return found[0], found[1:]
        numbers = np.array(_numbered(PRODUCTS[self.cell], self.degree))
        values, slopes = _along_axis(np.asarray(points, dtype=float), self.degree)
        axes = np.arange(PRODUCTS[self.cell])
        taken = values[:, axes, numbers]  # (q, k, d)
        derivatives = [
            np.prod(np.where(axes == axis, slopes[:, axes, numbers], taken), axis=2) for axis in map(int, axes)
        ]
        return np.prod(taken, axis=2), np.stack(derivatives)

    def pull_back(self, point: Array, nodes: Array) -> Array:
        """Return the place in the reference cell of a point, (d,), of a cell with given nodes, (k, d), by Newton.

        Raises:
            RuntimeError: The point lies so far outside that no place is found.
        """
        found: Array = np.full((1, len(point)), 0.5)
        for _ in range(ROUNDS):
            values, derivatives = self.tabulate(found)
            update = np.linalg.solve((derivatives[:, 0] @ nodes).T, point - values[0] @ nodes)
            found = found + update
            if np.max(np.abs(update)) < CLOSE:
                return found
            if np.max(np.abs(found)) > FAR:
                break
        raise RuntimeError("the point lies outside")


@cache
def _simplex_element(cell: str, degree: int) -> Any:
    """Return the element of basix."""
    import basix

    kind = getattr(basix.CellType, cell)
    return basix.create_element(basix.ElementFamily.P, kind, degree, basix.LagrangeVariant.gll_warped, dtype=np.float64)


def corners(cell: str) -> Array:
    """Return the corners of a reference cell, (c, d)."""
    return LagrangeCell(cell, 1).places


@cache
def facets(cell: str) -> tuple[tuple[int, ...], ...]:
    """Return the corners of each facet of a reference cell."""
    if cell in SIMPLICES:
        count = len(corners(cell))
        return tuple(tuple(one for one in range(count) if one != left) for left in range(count))
    places = corners(cell)
    sides = [np.flatnonzero(places[:, axis] == end) for axis in range(places.shape[1]) for end in (0.0, 1.0)]
    return tuple(sorted(tuple(map(int, side)) for side in sides))


def quadrature(cell: str, degree: int) -> tuple[Array, Array]:
    """Return points, (q, d), and weights, (q,), of Gauss's rule of a degree."""
    if cell in SIMPLICES:
        import basix

        points, weights = basix.make_quadrature(getattr(basix.CellType, cell), degree)
        return np.asarray(points), np.asarray(weights)
    points, weights = np.polynomial.legendre.leggauss((degree + 2) // 2)
    return _product(0.5 * (1.0 + points), 0.5 * weights, PRODUCTS[cell])


def nodal_rule(cell: str, degree: int) -> tuple[Array, Array]:
    """Return the nodes of a facet that carry a uniform pressure, and their weights: Gauss-Lobatto's on edges."""
    if cell == "triangle":
        places = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
        middles = 0.5 * (places + np.roll(places, -1, axis=0))
        return (places if degree == 1 else middles), np.full(3, 1.0 / 6.0)
    points, weights = {
        1: (np.array([0.0, 1.0]), np.array([0.5, 0.5])),
        2: (np.array([0.0, 1.0, 0.5]), np.array([1.0, 1.0, 4.0]) / 6.0),
    }[degree]
    return _product(points, weights, PRODUCTS[cell])


def _product(points: Array, weights: Array, dimension: int) -> tuple[Array, Array]:
    places = np.stack(np.meshgrid(*[points] * dimension, indexing="ij"), axis=-1).reshape(-1, dimension)
    factors = np.stack(np.meshgrid(*[weights] * dimension, indexing="ij"), axis=-1).reshape(-1, dimension)
    return places, np.prod(factors, axis=1)


@cache
def _numbered(dimension: int, degree: int) -> tuple[tuple[int, ...], ...]:
    """Return the number of each node along each axis, node by node."""

    def order(node: tuple[int, ...]) -> tuple[int, tuple[int, ...]]:
        ends = [(0, 1) if 0 < number < degree else (number // degree,) for number in node]
        spanned = sorted(sum(end << axis for axis, end in enumerate(corner)) for corner in product(*ends))
        return len(spanned), tuple(spanned)

    return tuple(sorted(product(range(degree + 1), repeat=dimension), key=order))


def _along_axis(x: Array, degree: int) -> tuple[Array, Array]:
    """Return Lagrange polynomials and their slopes, (..., degree + 1) each."""
    if degree == 1:
        return np.stack([1.0 - x, x], axis=-1), np.stack([-np.ones_like(x), np.ones_like(x)], axis=-1)
    if degree != 2:
        raise ValueError(f"shapes of degree {degree}; expected 1 or 2")
    values = np.stack([(1.0 - x) * (1.0 - 2.0 * x), 4.0 * x * (1.0 - x), x * (2.0 * x - 1.0)], axis=-1)
    return values, np.stack([4.0 * x - 3.0, 4.0 - 8.0 * x, 4.0 * x - 1.0], axis=-1)
