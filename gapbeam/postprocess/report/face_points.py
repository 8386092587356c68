"""The points of a mesh on the faces of its supports: sides of cells that no other cell has, and that look at a face.

VTK finds them too, for pictures; a report does without it, since it is loaded once in a process, set for pictures.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from meshio import CellBlock

from gapbeam.postprocess.report.moving_scene import SceneWall

SIDES: dict[str, tuple[tuple[int, ...], ...]] = {
    "triangle": ((0, 1), (1, 2), (2, 0)),
    "quad": ((0, 1), (1, 2), (2, 3), (3, 0)),
    "tetra": ((0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3)),
    "hexahedron": ((0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
}
"""Corners of the sides of a cell, by its type."""

_NEAR = 1.0e-6  # of the length
_LEAST = 1.0e-3  # component of a normal: a side that looks less up or down looks at no plane


def face_points(
    points: np.ndarray, cells: Iterable[CellBlock], dimension: int, walls: Sequence[SceneWall]
) -> list[np.ndarray]:
    """Return the numbers of the points on every face.

    Args:
        points: Points of the mesh, (n, 3), m.
        cells: Their corners, by type of cell.
        dimension: 2 or 3; the bending direction is y or z.
        walls: The faces of the supports.
    """
    solid = 3 if dimension == 3 else 2
    blocks = [block for block in cells if block.type in SIDES and len(SIDES[block.type][0]) >= solid]
    return [_points_on(wall, points, blocks, dimension) for wall in walls]


def _points_on(wall: SceneWall, points: np.ndarray, blocks: Sequence[CellBlock], dimension: int) -> np.ndarray:
    near = _NEAR * float(np.ptp(points[:, 0]))
    inside = (points[:, 0] >= wall.along[0] - near) & (points[:, 0] <= wall.along[1] + near)
    middle, up = 0.5 * (wall.bottom + wall.top), dimension - 1
    found: list[np.ndarray] = [np.empty(0, dtype=int)]
    for block in blocks:
        corners = np.asarray(block.data)
        corners = corners[inside[corners].any(axis=1)]
        sides, behind = _outer_sides(corners, SIDES[block.type])
        kept = inside[sides].all(axis=1) & (np.ptp(points[sides, 0], axis=1) > near)
        sides, behind = sides[kept], corners[behind[kept]]
        place = points[sides].mean(axis=1)
        normals, height = _normals(points[sides], place - points[behind].mean(axis=1)), place[:, up] - middle
        if wall.met.around:
            looks = normals[:, 1] * place[:, 1] + normals[:, up] * height > 0.0
        elif wall.met.below:
            looks = (normals[:, up] < -_LEAST) & (height < 0.0)
        else:
            looks = (normals[:, up] > _LEAST) & (height > 0.0)
        found.append(np.unique(sides[looks]))
    return np.asarray(np.unique(np.concatenate(found)))


def _outer_sides(corners: np.ndarray, sides: tuple[tuple[int, ...], ...]) -> tuple[np.ndarray, np.ndarray]:
    """Return the sides that one cell has alone, (s, corners), and the number of that cell, (s,)."""
    every = np.concatenate([corners[:, list(side)] for side in sides])
    _, first, count = np.unique(np.sort(every, axis=1), axis=0, return_index=True, return_counts=True)
    alone = first[count == 1]
    return every[alone], alone % max(len(corners), 1)


def _normals(corners: np.ndarray, outward: np.ndarray) -> np.ndarray:
    """Return the unit normals of sides, (s, 3), on the side of vectors that point outward, (s, 3).

    Args:
        corners: Corners of the sides, (s, corners, 3), m; two in a plane.
        outward: From the middle of the cell behind each to its own, m.
    """
    along = corners[:, 1] - corners[:, 0]
    other = np.array([0.0, 0.0, 1.0]) if corners.shape[1] == 2 else corners[:, 2] - corners[:, 0]
    normals = np.cross(along, other)
    signs = np.sign(np.einsum("sd,sd->s", normals, outward))
    return np.asarray(normals * (signs / np.linalg.norm(normals, axis=1))[:, None])
