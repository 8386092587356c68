"""The torsion constant of sections of rectangular blocks, by finite elements for the warping function.

A section that twists by theta' per length moves along the beam by theta' phi(y, z), phi the warping function. Of all
functions it makes smallest

    J = int (phi_y - z)^2 + (phi_z + y)^2 dA

so that the figure found is a bit too large. Of sections that are symmetric about both axes a quarter is enough, with
phi = 0 on both axes. Elements are biquadratic. They shrink toward the corner where blocks meet, at which the shear
stress grows without bound, and toward the ends of flanges and walls. What is left is an error of some 1e-5 of J.

Source: Timoshenko and Goodier (1970), Theory of Elasticity, 3rd ed., sec. 104.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import scipy
from numpy.typing import NDArray

RATIO = 0.6  # of the lengths of neighboring elements
INWARD, OUTWARD = 18, 10  # elements toward the corner where blocks meet, and toward the outer faces
POINTS = 0.5 + 0.5 * np.polynomial.legendre.leggauss(3)[0]
WEIGHTS = 0.5 * np.polynomial.legendre.leggauss(3)[1]

Array = NDArray[np.float64]
Blocks = tuple[tuple[bool, bool], tuple[bool, bool]]
"""Presence of the blocks: by y (inner, outer), and in that by z (inner, outer)."""


@lru_cache(maxsize=256)
def torsion_of_blocks(corner: tuple[float, float], outer: tuple[float, float], blocks: Blocks) -> float:
    """Return J of a section whose quarter y, z > 0 consists of rectangular blocks, m^4.

    Args:
        corner: (y, z) of the corner where the blocks meet, m.
        outer: (y, z) of the outer corner, m.
        blocks: Which of the four blocks are filled.
    """
    lines = [_graded(inner, end) for inner, end in zip(corner, outer, strict=True)]
    sizes = [np.diff(line) for line in lines]
    block = [np.asarray(line[:-1] >= at, dtype=int) for line, at in zip(lines, corner, strict=True)]
    first, second = np.nonzero(np.array(blocks)[np.ix_(*block)])
    y, z = (
        line[of][:, None] + size[of][:, None] * POINTS
        for line, size, of in zip(lines, sizes, (first, second), strict=True)
    )
    shapes, slopes = _shapes(POINTS)
    by_y = np.einsum("ai,bj->abij", slopes, shapes).reshape(len(POINTS), len(POINTS), -1)
    by_z = np.einsum("ai,bj->abij", shapes, slopes).reshape(len(POINTS), len(POINTS), -1)
    long, high = sizes[0][first], sizes[1][second]
    weights = np.outer(WEIGHTS, WEIGHTS)
    in_y, in_z = (np.einsum("ab,abi,abj->ij", weights, part, part) for part in (by_y, by_z))
    stiffness = (high / long)[:, None, None] * in_y + (long / high)[:, None, None] * in_z
    force = np.einsum("ab,eb,abi,e->ei", weights, z, by_y, high) - np.einsum("ab,ea,abi,e->ei", weights, y, by_z, long)
    count = 2 * len(sizes[1]) + 1
    local = np.add.outer(np.arange(3) * count, np.arange(3)).reshape(-1)
    nodes = (2 * first * count + 2 * second)[:, None] + local
    free, numbers = np.unique(nodes, return_inverse=True)
    numbers = numbers.reshape(nodes.shape)
    held = (free < count) | (free % count == 0)
    shape = (len(free), len(free))
    rows, columns = np.repeat(numbers, 9, axis=1), np.tile(numbers, 9)
    matrix = scipy.sparse.csc_matrix((stiffness.reshape(-1), (rows.reshape(-1), columns.reshape(-1))), shape)
    right = np.bincount(numbers.reshape(-1), force.reshape(-1), len(free))
    kept = np.flatnonzero(~held)
    warping = scipy.sparse.linalg.spsolve(matrix[np.ix_(kept, kept)], right[kept])
    rigid = np.sum(long * high * ((y**2) @ WEIGHTS + (z**2) @ WEIGHTS))
    return float(4.0 * (rigid - right[kept] @ warping))


def _graded(inner: float, end: float) -> Array:
    """Return the ends of elements from 0 to `end`, which shrink toward `inner` from both sides and toward `end`, m."""
    near, far = RATIO ** np.arange(INWARD), RATIO ** np.arange(1, OUTWARD)
    half = 0.5 * (end - inner)
    return np.concatenate(
        [[0.0], inner * (1.0 - near[1:]), [inner], (inner + half * near)[::-1], end - half * far, [end]]
    )


def _shapes(xi: Array) -> tuple[Array, Array]:
    """Return the quadratic shapes and their slopes at places of [0, 1], (k, 3) each."""
    shapes = np.stack([(1.0 - xi) * (1.0 - 2.0 * xi), 4.0 * xi * (1.0 - xi), xi * (2.0 * xi - 1.0)], axis=1)
    slopes = np.stack([4.0 * xi - 3.0, 4.0 - 8.0 * xi, 4.0 * xi - 1.0], axis=1)
    return shapes, slopes
