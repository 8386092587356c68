"""Convex areas between straight walls: n . o <= b for all walls."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linprog
from scipy.spatial import ConvexHull, HalfspaceIntersection

from gapbeam.solver.supports.support import Array


def centroid(normals: Array, limits: Array) -> tuple[tuple[float, float], float] | None:
    """Return the centroid of the area, m, and its distance to the nearest wall, m; None where the area is open.

    Of an area without a point that is free, the point that all walls overlap least, and by how much, negative.

    Args:
        normals: Outward unit normals n of the walls, (k, 2).
        limits: b of each, (k,), m.
    """
    turns = np.sort(np.arctan2(normals[:, 0], normals[:, 1]))
    if np.max(np.diff(turns, append=turns[0] + 2.0 * np.pi)) >= np.pi * (1.0 - 1.0e-12):
        return None
    unit = float(np.max(np.abs(limits))) or 1.0
    walls = np.column_stack([normals, np.ones(len(normals))])
    inner = linprog([0.0, 0.0, -1.0], walls, limits / unit, bounds=[(None, None)] * 3).x
    if inner[2] <= 0.0:
        return (unit * float(inner[0]), unit * float(inner[1])), unit * float(inner[2])
    corners = HalfspaceIntersection(np.column_stack([normals, -limits / unit]), inner[:2]).intersections
    corners = corners[ConvexHull(corners).vertices]
    following = np.roll(corners, -1, axis=0)
    doubled = corners[:, 0] * following[:, 1] - following[:, 0] * corners[:, 1]
    middle = unit * (doubled @ (corners + following)) / (3.0 * np.sum(doubled))
    return (float(middle[0]), float(middle[1])), float(np.min(limits - normals @ middle))
