"""A beam in a plane: its cells, its outline, and the lines of it that face supports."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gapbeam.postprocess.scene.facing_facets import MeshedBody, facing
from gapbeam.postprocess.scene.support_surface import SupportBoxes


@dataclass(frozen=True)
class PlaneBody:
    """The beam, by numbers of its mesh points.

    Attributes:
        rest: Where the points are undeformed, (n, 2), m.
        cells: Corners of each cell, counter-clockwise, (cells, corners) for each type of cell.
        lines: Ends of the lines of the mesh, each once, (l, 2).
        loops: The outline as closed polygons, (points,) each, with the beam on their left.
        faces: Lines of the outline that face a support, (f, 2).
        touching: The points on each face of the supports.
    """

    rest: np.ndarray
    cells: tuple[np.ndarray, ...]
    lines: np.ndarray
    loops: tuple[np.ndarray, ...]
    faces: np.ndarray
    touching: dict[str, np.ndarray]


def plane_body(fields: MeshedBody, support: SupportBoxes) -> PlaneBody:
    """Take cells and outline of the mesh.

    Args:
        fields: The fields of a run, or a mesh.
        support: Beam and support of the same run.
    """
    rest = fields.points[:, :2]
    cells = tuple(_counter_clockwise(np.asarray(block.data).astype(int), rest) for block in fields.cells)
    sides = np.vstack([np.stack([one, np.roll(one, -1, axis=1)], axis=2).reshape(-1, 2) for one in cells])
    lines, inverse, counts = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True, return_counts=True)
    outline = sides[counts[inverse.reshape(-1)] == 1]
    along = rest[outline[:, 1]] - rest[outline[:, 0]]
    held = facing(outline, -along[:, 0] / np.linalg.norm(along, axis=1), fields.points, support)
    faces = outline[np.any(list(held.values()), axis=0)]
    touching = {face: np.unique(outline[which]) for face, which in held.items()}
    return PlaneBody(rest, cells, lines, tuple(_loops(outline)), faces, touching)


def _counter_clockwise(cells: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """Turn the corners of cells, (cells, corners), whose area is negative."""
    x, y = rest[cells, 0], rest[cells, 1]
    twice = np.sum(x * np.roll(y, -1, axis=1) - np.roll(x, -1, axis=1) * y, axis=1)
    return np.where(twice[:, None] < 0.0, cells[:, ::-1], cells)


def _loops(outline: np.ndarray) -> list[np.ndarray]:
    """Chain directed lines, (l, 2), to closed polygons."""
    following: dict[int, list[int]] = {}
    for first, last in zip(*outline.T, strict=True):
        following.setdefault(int(first), []).append(int(last))
    loops = []
    while following:
        at = next(iter(following))
        loop = []
        while at in following:
            loop.append(at)
            after = following[at]
            to = after.pop()
            if not after:
                del following[at]
            at = to
        loops.append(np.array(loop))
    return loops
