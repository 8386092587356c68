"""Nodes and four-sided cells of a cross-section, or the nodes across a slice.

Inside a patch the corners of cells are those of Coons's transfinite map of its sides,

    x(u, v) = (1 - v) b(u) + v t(u) + (1 - u) l(v) + u r(v)
              - (1 - u) (1 - v) x_00 - u (1 - v) x_10 - u v x_11 - (1 - u) v x_01.

Cells of second order follow arcs: their further nodes lie on the sides of the patch, halfway between corners, and in
the middle of a cell where the map of its eight other nodes puts it.

Source: Gordon and Hall (1973) for the map.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gapbeam.meshes.mesh_size import Positions
from gapbeam.meshes.sections.section_patches import Array, SectionCurve, SectionPatches

Indices = npt.NDArray[np.int64]


@dataclass(frozen=True)
class SectionGrid:
    """Cells of a cross-section, of order p.

    Attributes:
        nodes: Their places across the beam, (n, d - 1), m.
        cells: Nodes of each cell, axis after axis, (m, p + 1, ...).
        parts: Number of the patch, or of the band of a slice, that each cell lies in, (m,).
    """

    nodes: Array
    cells: Indices
    parts: Indices


def layered_grid(layers: Sequence[Positions], levels: tuple[float, ...]) -> SectionGrid:
    """Return the cells between layers across a beam.

    Args:
        layers: Boundaries along each axis across the beam, m.
        levels: Heights that bands of a slice with steps lie between, m.
    """
    shape = tuple(len(axis) for axis in layers)
    nodes = np.stack(np.meshgrid(*layers, indexing="ij"), axis=-1).reshape(-1, len(shape))
    cells = _cells_of(np.arange(len(nodes)).reshape(shape), 1)
    heights = nodes[cells.reshape(len(cells), -1), -1].mean(axis=1)
    return SectionGrid(nodes, cells, np.searchsorted(levels, heights) - 1)


def patch_grid(section: SectionPatches) -> SectionGrid:
    """Return the cells of a cross-section: of second order where a side is an arc, else of first order."""
    order = 2 if section.curved else 1
    sides = [_along(curve, order) for curve in section.curves]
    nodes, cells, parts, first = list[Array](), list[Indices](), list[Indices](), 0
    for number, patch in enumerate(section.patches):
        below, right, above, left = (sides[side][::-1] if backward else sides[side] for side, backward in patch)
        grid = _filled(below, right, above[::-1], left[::-1], order)
        nodes.append(grid.reshape(-1, 2))
        cells.append(_cells_of(first + np.arange(grid.shape[0] * grid.shape[1]).reshape(grid.shape[:2]), order))
        parts.append(np.full(len(cells[-1]), number))
        first += len(nodes[-1])
    # sides that two patches share have the same bits in both
    merged, places = np.unique(np.concatenate(nodes), axis=0, return_inverse=True)
    return SectionGrid(merged, places.reshape(-1)[np.concatenate(cells)], np.concatenate(parts))


def middles(curve: SectionCurve) -> Array:
    """Return the places halfway between the corners of cells along a curve, straight, (cells, 2), m."""
    corners = _along(curve, 1)
    return np.asarray(0.5 * (corners[1:] + corners[:-1]))


def _along(curve: SectionCurve, order: int) -> Array:
    """Return the nodes along a curve, (order cells + 1, 2)."""
    share = np.linspace(0.0, 1.0, order * curve.cells + 1)[:, None]
    start, end = np.array(curve.start), np.array(curve.end)
    if not curve.arc:
        found = (1.0 - share) * start + share * end
    else:
        angle = np.arctan2(start[0] * end[1] - start[1] * end[0], start @ end) * share
        found = np.cos(angle) * start + np.sin(angle) * np.array([-start[1], start[0]])
    found[-1] = end
    return np.asarray(found)


def _filled(below: Array, right: Array, above: Array, left: Array, order: int) -> Array:
    """Return the nodes of a patch between its sides, along v = 0, u = 1, v = 1 and u = 0, (u, v, 2)."""
    u, v = (np.linspace(0.0, 1.0, len(side))[::order] for side in (below, left))
    u, v = u[:, None, None], v[None, :, None]
    b, t, l, r = below[::order, None], above[::order, None], left[None, ::order], right[None, ::order]  # noqa: E741
    corners = (1.0 - u) * ((1.0 - v) * below[0] + v * above[0]) + u * ((1.0 - v) * below[-1] + v * above[-1])
    grid = np.empty((len(below), len(left), 2))
    grid[::order, ::order] = (1.0 - v) * b + v * t + (1.0 - u) * l + u * r - corners
    if order == 2:
        grid[1::2, ::2] = 0.5 * (grid[:-1:2, ::2] + grid[2::2, ::2])
        grid[::2, 1::2] = 0.5 * (grid[::2, :-1:2] + grid[::2, 2::2])
    grid[:, 0], grid[:, -1], grid[0], grid[-1] = below, above, left, right
    if order == 2:
        ends = grid[:-1:2, :-1:2] + grid[2::2, :-1:2] + grid[:-1:2, 2::2] + grid[2::2, 2::2]
        halves = grid[1::2, :-1:2] + grid[1::2, 2::2] + grid[:-1:2, 1::2] + grid[2::2, 1::2]
        grid[1::2, 1::2] = 0.5 * halves - 0.25 * ends
    return grid


def _cells_of(numbers: Indices, order: int) -> Indices:
    """Return the cells of a grid of numbered nodes, (cells, order + 1, ...)."""
    windows = np.lib.stride_tricks.sliding_window_view(numbers, (order + 1,) * numbers.ndim)
    chosen = windows[(slice(None, None, order),) * numbers.ndim]
    return np.ascontiguousarray(chosen.reshape(-1, *(order + 1,) * numbers.ndim))
