"""Cells of solids in the order of VTK: reference nodes, shape functions, and the matrices of linear elasticity.

    K = int B^T C B,     M = int rho N^T N,     in the plane times the thickness.

All cells are isoparametric. Each direction has one Gauss point more than the order of the cell, simplices by Stroud's
conical product: stiffness and mass of straight cells are exact.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache, cached_property
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
from scipy.special import roots_jacobi

from gapbeam.solver.system.operators import Array

Indices = Any
AT_ONCE = 2**23  # numbers that are held at once
PLANE, SPACE = (0, 1, 5), (0, 1, 2, 3, 4, 5)
"""Components of Voigt's notation xx, yy, zz, yz, xz, xy in the plane and in space."""
COMPONENTS = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))
_TRIANGLE = ((0, 1), (1, 2), (2, 0))
_QUAD = ((0, 1), (1, 2), (2, 3), (3, 0))
_TETRA = (*_TRIANGLE, (0, 3), (1, 3), (2, 3))
_HEXA = (*_QUAD, (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7))
_TETRA_FACES = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))
_HEXA_FACES = ((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7))


class CellKind(NamedTuple):
    """A kind of cell.

    Attributes:
        corners: Corners in the reference cell, (corners, dimension).
        facets: Corners of each facet.
        between: Corners of whose mean each further node is.
        order: 1 or 2.
        mirrored: Corners in the order of the mirrored cell.
    """

    corners: tuple[tuple[float, ...], ...]
    facets: tuple[tuple[int, ...], ...]
    between: tuple[tuple[int, ...], ...]
    order: int
    mirrored: tuple[int, ...]

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return len(self.corners[0])

    @property
    def simplex(self) -> bool:
        """True for triangles and tetrahedra."""
        return len(self.corners) == self.dimension + 1

    def mirror(self) -> list[int]:
        """Return the order of the nodes of the mirrored cell."""
        known = {frozenset(one): k for k, one in enumerate(self.between, len(self.corners))}
        turned = [known[frozenset(self.mirrored[i] for i in one)] for one in self.between]
        return [*self.mirrored, *turned]


def _simplex(order: int, dimension: int) -> CellKind:
    corners = ((0.0,) * dimension, *(tuple(map(float, row)) for row in np.eye(dimension)))
    facets, edges = (_TRIANGLE, _TRIANGLE) if dimension == 2 else (_TETRA_FACES, _TETRA)
    return CellKind(corners, facets, edges if order == 2 else (), order, (0, 2, 1, 3)[: dimension + 1])


def _block(order: int, dimension: int, whole: bool = False) -> CellKind:
    plane = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
    corners = plane if dimension == 2 else tuple((*one, z) for z in (0.0, 1.0) for one in plane)
    facets, edges = (_QUAD, _QUAD) if dimension == 2 else (_HEXA_FACES, _HEXA)
    inside = (tuple(range(len(corners))),) if dimension == 2 else (*_HEXA_FACES, tuple(range(8)))
    between = (*edges, *(inside if whole else ())) if order == 2 else ()
    return CellKind(corners, facets, between, order, (0, 3, 2, 1, 4, 7, 6, 5)[: len(corners)])


KINDS = {
    "triangle": _simplex(1, 2), "triangle6": _simplex(2, 2), "tetra": _simplex(1, 3), "tetra10": _simplex(2, 3),
    "quad": _block(1, 2), "quad8": _block(2, 2), "quad9": _block(2, 2, True),
    "hexahedron": _block(1, 3), "hexahedron20": _block(2, 3), "hexahedron27": _block(2, 3, True),
}  # fmt: skip
"""Kinds of cells by their names in meshio."""


FACETS = {
    "line": CellKind(((0.0,), (1.0,)), (), (), 1, ()), "line3": CellKind(((0.0,), (1.0,)), (), ((0, 1),), 2, ()),
    **{name: KINDS[name] for name in ("triangle", "triangle6", "quad", "quad8", "quad9")},
}  # fmt: skip
"""Kinds of facets of cells."""


def facet_of(kind: CellKind) -> tuple[str, list[tuple[int, ...]]]:
    """Return the kind of the facets of a cell, and the nodes of each: corners, then nodes between them."""
    known = {frozenset(one): k for k, one in enumerate(kind.between, len(kind.corners))}
    found = []
    for corners in kind.facets:
        count = len(corners)
        sides = [frozenset((corners[i], corners[(i + 1) % count])) for i in range(count if count > 2 else 1)]
        inner = [*sides, frozenset(corners)] if count > 2 else sides
        found.append((*corners, *(known[one] for one in inner if one in known)))
    names = (
        {2: "line", 3: "line3"}
        if kind.dimension == 2
        else {3: "triangle", 6: "triangle6", 4: "quad", 8: "quad8", 9: "quad9"}
    )
    return names[len(found[0])], found


@cache
def _powers(name: str) -> tuple[Array, Array]:
    """Return the exponents of the monomials of a kind, (nodes, dimension), and their inverse table at its nodes."""
    kind = KINDS.get(name) or FACETS[name]
    corners, d = np.array(kind.corners), kind.dimension
    nodes = np.vstack([corners, *(corners[list(one)].mean(axis=0) for one in kind.between)])
    whole = any(len(one) == len(corners) for one in kind.between)  # a node in the middle: all products of powers
    powers = [
        one
        for one in product(range(kind.order + 1), repeat=d)
        if (sum(one) if kind.simplex else 0 if whole else sum(k for k in one if k > 1)) <= kind.order
    ]
    exponents = np.array(powers)
    return exponents, np.linalg.inv(np.prod(nodes[:, None] ** exponents, axis=2))


def shapes_at(name: str, points: Array) -> tuple[Array, Array]:
    """Return shape functions (points, nodes) and slopes (points, dimension, nodes) of a kind of cell or facet.

    Args:
        name: Name of the kind, in meshio.
        points: Points in the reference cell, (points, dimension).
    """
    exponents, inverse = _powers(name)
    slopes = np.empty((len(points), exponents.shape[1], len(exponents)))
    for i in range(exponents.shape[1]):
        lower = np.maximum(exponents - np.eye(exponents.shape[1], dtype=int)[i], 0)
        slopes[:, i] = (exponents[:, i] * np.prod(points[:, None] ** lower, axis=2)) @ inverse
    return np.prod(points[:, None] ** exponents, axis=2) @ inverse, slopes


@cache
def _shapes(name: str) -> tuple[Array, Array, Array]:
    """Return weights (points,), shape functions (points, nodes) and slopes (points, dimension, nodes) of a kind."""
    kind = KINDS[name]
    points, weights = rule_of(kind.order + 1, kind.dimension, kind.simplex)
    return weights, *shapes_at(name, points)


def rule_of(count: int, dimension: int, simplex: bool) -> tuple[Array, Array]:
    """Return points and weights of the reference cell: of a product of Gauss rules, conical for simplices."""
    lines = []
    for power in range(dimension):
        x, w = roots_jacobi(count, power if simplex else 0, 0)
        lines.append((0.5 * (x + 1.0), w * 0.5 ** (1 + (power if simplex else 0))))
    points = np.array(list(product(*(x for x, _ in lines))))
    weights = np.array([np.prod(one) for one in product(*(w for _, w in lines))])
    if simplex:  # coordinate i shrinks by all later ones
        for i in range(dimension - 1):
            points[:, i] *= np.prod(1.0 - points[:, i + 1 :], axis=1)
    return points, weights


class Cells:
    """Cells of one kind with their nodes.

    Args:
        name: Name of the kind, in meshio.
        nodes: (cells, nodes of a cell).
        places: (nodes, 3), m.
    """

    def __init__(self, name: str, nodes: Indices, places: Array) -> None:
        self.name, self.kind, self.nodes = name, KINDS[name], nodes
        self.places = places[:, : self.kind.dimension]
        self.weights, self.values, self.slopes = _shapes(name)

    @cached_property
    def jacobians(self) -> Array:
        """Determinants at the points of the rule, (cells, points)."""
        return np.concatenate([np.linalg.det(self._jacobian(some)) for some in self._chunks()])

    def _chunks(self) -> Sequence[Indices]:
        size = len(self.weights) * self.nodes.shape[1] * 6 * self.kind.dimension
        return np.array_split(np.arange(len(self.nodes)), max(1, len(self.nodes) * size // AT_ONCE))

    def _jacobian(self, some: Indices) -> Array:
        corners = self.places[self.nodes[some]]
        corners = corners - corners[:, :1]  # short beside where the cell lies: no digits are lost
        found: Array = np.einsum("qdk,ckx->cqdx", self.slopes, corners, optimize=True)
        return found

    def matrices(self, moduli: Array, of_cell: Indices, densities: Array, thickness: float) -> tuple[Any, Any]:
        """Return stiffness and mass, sparse, in N/m and kg, component after component at each node.

        Args:
            moduli: C of each material, (materials, components, components), Pa.
            of_cell: Material of each cell, (cells,).
            densities: Densities of each material, kg/m^3.
            thickness: Thickness in the plane, m; 1 in space.
        """
        d, count, size = self.kind.dimension, self.nodes.shape[1], len(self.places)
        rows, columns, stiff, heavy = [], [], [], []
        for some in self._chunks():
            jacobian = self._jacobian(some)
            weights = thickness * self.weights * np.linalg.det(jacobian)
            B = self._strains(np.asarray(np.linalg.solve(jacobian, self.slopes[None]), dtype=float))
            C = moduli[of_cell[some]]
            stress = np.einsum("cq,cab,cqbj->cqaj", weights, C, B, optimize=True)
            wide = (len(some), -1, count * d)
            k = B.reshape(wide).transpose(0, 2, 1) @ stress.reshape(wide)
            m = np.einsum(
                "cq,qi,qj->cij", densities[of_cell[some], None] * weights, self.values, self.values, optimize=True
            )
            at = (d * self.nodes[some][..., None] + np.arange(d)).reshape(len(some), -1)
            rows.append(np.repeat(at, count * d, axis=1).ravel())
            columns.append(np.tile(at, (1, count * d)).ravel())
            stiff.append((0.5 * (k + k.transpose(0, 2, 1))).ravel())
            heavy.append(np.einsum("cij,xy->cixjy", m, np.eye(d)).ravel())
        place, shape = (np.concatenate(rows), np.concatenate(columns)), (d * size, d * size)
        K, M = (sp.csr_matrix((np.concatenate(one), place), shape) for one in (stiff, heavy))
        M.eliminate_zeros()
        return K, M

    def at_nodes(self, nodes: Sequence[int]) -> Iterator[tuple[int, Array]]:
        """Yield each cell that meets at nodes with its strains there, (components, motions), (cell, B).

        B is in the motions of all nodes, component after component at each.
        """
        d = self.kind.dimension
        corners = np.array(self.kind.corners)
        reference = np.vstack([corners, *(corners[list(one)].mean(axis=0) for one in self.kind.between)])
        slopes = shapes_at(self.name, reference)[1]
        for node in nodes:
            for cell, place in zip(*np.nonzero(self.nodes == node), strict=True):
                jacobian = slopes[place] @ self.places[self.nodes[cell]]
                own = self._strains(np.linalg.solve(jacobian, slopes[place])[None, None])[0, 0]
                B = np.zeros((len(own), d * len(self.places)))
                B[:, (d * self.nodes[cell][:, None] + np.arange(d)).ravel()] = own
                yield int(cell), B

    def _strains(self, slopes: Array) -> Array:
        """Return B, (cells, points, components, motions), from the slopes in space."""
        d = self.kind.dimension
        components = PLANE if d == 2 else SPACE
        B = np.zeros((*slopes.shape[:2], len(components), slopes.shape[3], d))
        for row, component in enumerate(components):
            i, j = COMPONENTS[component]
            B[:, :, row, :, i] += slopes[:, :, j]
            if i != j:
                B[:, :, row, :, j] += slopes[:, :, i]
        return B.reshape(*slopes.shape[:2], len(components), -1)
