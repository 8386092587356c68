"""Which cells of a mesh contain given points."""

from __future__ import annotations

import gmsh
import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from gapbeam.meshes.user_mesh.cell_types import CELL_TYPES, Nodes

INSIDE = 1.0e-8
"""How deep in the reference cell a point has to lie, to be inside."""

BULGE = 0.1
"""How far a curved cell may reach beyond the box of its nodes, relative to the box."""

BLOCK = 200_000
"""Pairs of point and cell that are looked at together: bounds the memory."""

FAR = 0.5
"""A point this far outside of the reference cell is given up, though a curved cell moves it a little."""

MOST_ITERATIONS = 12

Coordinates = npt.NDArray[np.float64]


def shape_values(kind: int, local: Coordinates) -> Coordinates:
    """Return the shape functions of a gmsh element type, (points, nodes), at points of its reference cell."""
    _, values, _ = gmsh.model.mesh.getBasisFunctions(kind, _padded(local).ravel(), "Lagrange")
    return np.asarray(values, dtype=np.float64).reshape(len(local), -1)


def cells_at(kind: int, cells: Nodes, x: Coordinates, points: Coordinates, excluded: Nodes) -> tuple[Nodes, Nodes]:
    """Find the cells in which points lie.

    Args:
        kind: gmsh's number of the cell type.
        cells: Nodes of the cells, (cells, nodes).
        x: Coordinates of the nodes, (nodes, dimension), m.
        points: (points, dimension), m.
        excluded: For each point the cell that is not looked at, (points,).

    Returns:
        Pairs of point and cell, by rising point: the points, and the cells.
    """
    lower, upper = x[cells].min(axis=1), x[cells].max(axis=1)
    size = upper - lower
    if cells.shape[1] > CELL_TYPES[kind].corner_count:
        lower, upper = lower - BULGE * size, upper + BULGE * size
    tree = cKDTree(points)
    radius = 0.5 * np.linalg.norm(upper - lower, axis=1)
    found: list[tuple[Nodes, Nodes]] = []
    step = max(1, BLOCK // 16)
    for first in range(0, len(cells), step):
        block = np.arange(first, min(first + step, len(cells)), dtype=np.int64)
        near = tree.query_ball_point(0.5 * (lower + upper)[block], radius[block])
        cell = np.repeat(block, [len(one) for one in near])
        point = np.array([number for one in near for number in one], dtype=np.int64)
        candidate = (cell != excluded[point]) & np.all(
            (points[point] >= lower[cell]) & (points[point] <= upper[cell]), axis=1
        )
        point, cell = _roughly(kind, cells, x, points, point[candidate], cell[candidate])
        for start in range(0, len(point), BLOCK):
            part = slice(start, start + BLOCK)
            inside = _inside(kind, x[cells[cell[part]]], points[point[part]])
            found.append((point[part][inside], cell[part][inside]))
    if not found:
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    point, cell = (np.concatenate(column) for column in zip(*found, strict=True))
    order = np.argsort(point, kind="stable")
    return point[order], cell[order]


def _roughly(
    kind: int, cells: Nodes, x: Coordinates, points: Coordinates, point: Nodes, cell: Nodes
) -> tuple[Nodes, Nodes]:
    """Leave away pairs of point and cell that are far apart: where the cell were as at its middle throughout."""
    dimension = points.shape[1]
    middle = _middle(kind, dimension)
    mine, which = np.unique(cell, return_inverse=True)
    jacobian = np.einsum("nk,cnd->cdk", _shape_gradients(kind, middle)[0], x[cells[mine]])
    jacobian[np.linalg.det(jacobian) == 0.0] = np.eye(dimension)
    inverse = np.linalg.inv(jacobian)
    off = points[point] - (shape_values(kind, middle)[0] @ x[cells[mine]])[which]
    local = middle + np.einsum("pkd,pd->pk", inverse[which], off)
    near = _depth(local, _is_simplex(kind, dimension)) > -FAR
    return point[near], cell[near]


def _inside(kind: int, nodes: Coordinates, points: Coordinates) -> npt.NDArray[np.bool_]:
    """Whether each point (pairs, dimension) lies in the cell with these nodes (pairs, nodes, dimension).

    Newton's method finds the place xi in the reference cell with sum_i N_i(xi) x_i = x.
    """
    dimension = points.shape[1]
    simplex = _is_simplex(kind, dimension)
    local = np.repeat(_middle(kind, dimension), len(points), axis=0)
    inside, left = np.zeros(len(points), dtype=bool), np.arange(len(points))
    for _ in range(MOST_ITERATIONS):
        missing = points[left] - np.einsum("pn,pnd->pd", shape_values(kind, local[left]), nodes[left])
        jacobian = np.einsum("pnk,pnd->pdk", _shape_gradients(kind, local[left]), nodes[left])
        regular = np.linalg.det(jacobian) != 0.0
        left, jacobian, missing = left[regular], jacobian[regular], missing[regular]
        change = np.linalg.solve(jacobian, missing[:, :, None])[:, :, 0]
        local[left] += change
        found = np.all(np.abs(change) < 0.1 * INSIDE, axis=1)
        inside[left[found]] = _depth(local[left[found]], simplex) > INSIDE
        left = left[~found & (_depth(local[left], simplex) > -FAR)]
        if len(left) == 0:
            break
    return inside


def _is_simplex(kind: int, dimension: int) -> bool:
    return len(CELL_TYPES[kind].corners) == dimension + 1


def _middle(kind: int, dimension: int) -> Coordinates:
    """The middle of gmsh's reference cell, (1, dimension)."""
    return np.full((1, dimension), 1.0 / (dimension + 1) if _is_simplex(kind, dimension) else 0.0)


def _depth(local: Coordinates, simplex: bool) -> Coordinates:
    """How deep places lie in the reference cell, (points,): negative outside; NaN stays NaN."""
    if simplex:
        return np.asarray(np.minimum(local.min(axis=1), 1.0 - local.sum(axis=1)))
    return np.asarray(1.0 - np.abs(local).max(axis=1))


def _shape_gradients(kind: int, local: Coordinates) -> Coordinates:
    """Derivatives of the shape functions in the reference cell, (points, nodes, dimension)."""
    _, values, _ = gmsh.model.mesh.getBasisFunctions(kind, _padded(local).ravel(), "GradLagrange")
    gradients = np.asarray(values, dtype=np.float64).reshape(len(local), -1, 3)
    return gradients[:, :, : local.shape[1]]


def _padded(local: Coordinates) -> Coordinates:
    """Return coordinates as gmsh wants them: three."""
    return np.pad(local, ((0, 0), (0, 3 - local.shape[1])))
