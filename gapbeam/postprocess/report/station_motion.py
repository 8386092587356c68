"""Motion of stations along a beam from the fields of a mesh, three numbers each, and contact pressure on the faces.

The pressure is a map over x and angle around a beam, otherwise a curve over x.

The points of a mesh on the faces of its supports: sides of cells that no other cell has, and that look at a face.

VTK finds them too, for pictures; a report does without it, since it is loaded once in a process, set for pictures.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from meshio import CellBlock
from scipy.sparse import csr_matrix, lil_matrix
from scipy.spatial import ConvexHull, Delaunay, QhullError

from gapbeam.postprocess.report.moving_scene import ContactMap, FacePressure, SceneBeam, SceneWall
from gapbeam.postprocess.results.field_reader import Frame
from gapbeam.postprocess.scene.motion_range import unrolled

SIDES: dict[str, tuple[tuple[int, ...], ...]] = {
    "triangle": ((0, 1), (1, 2), (2, 0)),
    "quad": ((0, 1), (1, 2), (2, 3), (3, 0)),
    "tetra": ((0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3)),
    "hexahedron": ((0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
}
"""Corners of the sides of a cell, by its type."""

_NEAR = 1.0e-6  # of the length
_FACING = 1.0e-3  # component of a normal: a side that looks less up or down looks at no plane


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
            looks = (normals[:, up] < -_FACING) & (height < 0.0)
        else:
            looks = (normals[:, up] > _FACING) & (height > 0.0)
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
        outward: Vectors from the middle of the cell behind each to its own, m.
    """
    along = corners[:, 1] - corners[:, 0]
    other = np.array([0.0, 0.0, 1.0]) if corners.shape[1] == 2 else corners[:, 2] - corners[:, 0]
    normals = np.cross(along, other)
    signs = np.sign(np.einsum("sd,sd->s", normals, outward))
    return np.asarray(normals * (signs / np.linalg.norm(normals, axis=1))[:, None])


MOST = 200  # stations
LOOSE = 80  # stations of a mesh without planes across the beam
_SAME = 1.0e-6  # of the length: planes that are one
_LEAST = 0.02  # of the largest displacement: what less rotation moves is not drawn
_CORNERS = 48  # of an outline
_ROUND_FROM = 8  # corners of a section that is drawn round
_ROUND = 0.02  # of the radius: what its corners differ by
SQUARE = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
"""The outline of a rectangle in its box, counter-clockwise."""


@dataclass(frozen=True)
class Stations:
    """Points of a mesh, gathered by their place along the beam.

    Attributes:
        places: x, (s,), m.
        members: Numbers of the points of each.
        points: Points of the mesh, y and z, (n, 2), m.
        regular: Whether every station is a plane of the mesh.
    """

    places: np.ndarray
    members: tuple[np.ndarray, ...]
    points: np.ndarray
    regular: bool


def stations_of(points: np.ndarray, dimension: int) -> Stations:
    """Gather the points of a mesh in stations: its planes across the beam, or bins where these are too many.

    Args:
        points: (n, 3), m.
        dimension: 2 or 3; the bending direction is y or z.
    """
    x, length = points[:, 0], float(np.ptp(points[:, 0])) or 1.0
    across = np.column_stack([np.zeros(len(x)), points[:, 1]]) if dimension == 2 else points[:, 1:]
    order = np.argsort(x, kind="stable")
    jumps = np.flatnonzero(np.diff(x[order]) > _SAME * length) + 1
    groups = np.split(order, jumps)
    regular = len(groups) <= MOST or min(map(len, groups)) == max(map(len, groups))
    if regular and len(groups) > MOST:
        groups = [groups[k] for k in np.unique(np.linspace(0, len(groups) - 1, MOST).astype(int))]
    elif not regular:
        edges = np.linspace(x.min(), x.max(), LOOSE + 1)
        bins = np.digitize(x, edges[1:-1])
        groups = [found for k in range(LOOSE) if (found := np.flatnonzero(bins == k)).size]
    places = np.array([x[group].mean() for group in groups])
    if not regular:  # the ends are those of the beam
        places[[0, -1]] = x.min(), x.max()
    return Stations(places, tuple(groups), across, regular)


def beam_of(stations: Stations, frames: Iterable[Frame], dimension: int, width: float) -> SceneBeam:
    """Return the beam of a scene.

    The motion of a station is the rigid motion next to that of its points, in the sense of least squares:
    u_y = v - phi (z - z0), u_z = w + phi (y - y0). Where sections stay flat and keep their shape nothing is lost.

    Args:
        stations: Stations of the mesh.
        frames: The fields to show.
        dimension: Dimension of the mesh; of 2, w is the mean.
        width: Width drawn for a slice, m.
    """
    fit, count = _fit(stations, dimension), len(stations.places)
    rows, slides = [], []
    for frame in frames:
        moved = frame.displacement
        slides.append(float(moved[:, 0].mean()))
        flat = np.zeros_like(moved[:, 0]) if dimension == 2 else moved[:, 1]
        rows.append((fit @ np.concatenate([flat, moved[:, dimension - 1]])).reshape(3, count))
    motion = np.array(rows, dtype=float).reshape(len(rows), 3, count)
    half, middle = _boxes(stations)
    if dimension == 2:
        half[:, 0] = 0.5 * width
    twist = motion[:, 2]
    if np.abs(twist).max(initial=0.0) * half.max() < _LEAST * np.abs(motion[:, :2]).max(initial=0.0):
        twist = np.zeros_like(twist)
    outline = _outline(stations) if dimension == 3 else SQUARE
    return SceneBeam(
        stations.places, outline, half, middle, motion[:, 0], motion[:, 1], twist, np.array(slides), dimension == 2
    )


def _fit(stations: Stations, dimension: int) -> csr_matrix:
    """Return the matrix (3 s, 2 n) from displacements along y and z to v, w and phi of all stations."""
    count, size = len(stations.places), len(stations.points)
    matrix = lil_matrix((3 * count, 2 * size))
    for k, members in enumerate(stations.members):
        rest = stations.points[members] - stations.points[members].mean(axis=0)
        share = 1.0 / len(members)
        matrix[k, members] = share
        matrix[count + k, size + members] = share
        inertia = float(np.sum(rest**2))
        if dimension == 3 and inertia > 0.0:
            matrix[2 * count + k, members] = -rest[:, 1] / inertia
            matrix[2 * count + k, size + members] = rest[:, 0] / inertia
    return csr_matrix(matrix)


def _boxes(stations: Stations) -> tuple[np.ndarray, np.ndarray]:
    """Return half width and height of the section at every station and their middle, (s, 2) each."""
    if not stations.regular:  # a bin may miss the corners of its section
        low, high = stations.points.min(axis=0), stations.points.max(axis=0)
        ends = [(low, high)] * len(stations.places)
    else:
        parts = [stations.points[members] for members in stations.members]
        ends = [(part.min(axis=0), part.max(axis=0)) for part in parts]
    lows, highs = (np.array([pair[side] for pair in ends]) for side in (0, 1))
    return 0.5 * (highs - lows), 0.5 * (highs + lows)


def _outline(stations: Stations) -> np.ndarray:
    """Return the convex outline of the largest section in its box, counter-clockwise, (n, 2)."""
    members = max(stations.members, key=len) if stations.regular else np.arange(len(stations.points))
    return hull_of(stations.points[members])


def hull_of(section: np.ndarray) -> np.ndarray:
    """Return the convex outline of points of a section in their box, counter-clockwise, (n, 2).

    Args:
        section: y and z, (k, 2), m.
    """
    low, high = section.min(axis=0), section.max(axis=0)
    size = np.where(high > low, high - low, 1.0)
    scaled = 2.0 * (section - low) / size - 1.0
    try:
        hull = scaled[ConvexHull(scaled).vertices]
    except QhullError:
        return SQUARE
    if len(hull) >= _ROUND_FROM and np.ptp(np.hypot(*hull.T)) < _ROUND:
        return circle()
    hull = _without_flat_corners(hull)
    return hull[:: -(-len(hull) // _CORNERS)]


def circle() -> np.ndarray:
    """Return the outline of a round section in its box, (n, 2)."""
    angle = np.linspace(0.0, 2.0 * np.pi, _CORNERS, endpoint=False)
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)


def _without_flat_corners(hull: np.ndarray) -> np.ndarray:
    """Drop corners on a straight side."""
    closed = np.vstack([hull, hull[:1]])
    sides = np.array([(b - a) / np.linalg.norm(b - a) for a, b in pairwise(closed)])
    before = np.roll(sides, 1, axis=0)
    turned = np.abs(before[:, 0] * sides[:, 1] - before[:, 1] * sides[:, 0]) > 1e-3
    return hull[turned] if turned.sum() >= 3 else hull


CONTACT_MAPS_MOST = 300_000  # numbers of 16 bits in a page: 0.8 MB


def contact_maps_of(
    points: np.ndarray, cells: Iterable[CellBlock], dimension: int, walls: Sequence[SceneWall], frames: Sequence[Frame]
) -> list[ContactMap]:
    """Return the maps of the supports that the beam presses on at some time.

    Faces around the beam have a map each, the planes of a support have one together.

    Args:
        points: Points of the mesh, (n, 3), m.
        cells: Their corners, by type of cell.
        dimension: 2 or 3; the bending direction is y or z.
        walls: The faces of the supports.
        frames: The fields that the scene shows.
    """
    pressed = np.zeros(len(points), dtype=bool)
    for frame in frames:
        pressed |= frame.contact_pressure > 0.0
    if not pressed.any():
        return []
    near = _SAME * float(np.ptp(points[:, 0]))
    maps, planes = [], dict[str, list[FacePressure]]()
    for wall, numbers in zip(walls, face_points(points, cells, dimension, walls), strict=True):
        if not numbers.size:
            continue
        if not wall.met.around:
            one = _over_x(wall.met.face, numbers, points[numbers, 0], near, frames)
            planes.setdefault(wall.support, []).append(one)
        elif pressed[numbers].any():
            maps.append(ContactMap(wall.support, (_around(wall.met.face, numbers, points, frames),)))
    maps += [ContactMap(support, tuple(faces)) for support, faces in planes.items()]
    order = list(dict.fromkeys(wall.support for wall in walls))
    return sorted((one for one in maps if one.largest > 0.0), key=lambda one: order.index(one.support))


def within_room(maps: Sequence[ContactMap], most: int = CONTACT_MAPS_MOST) -> tuple[list[ContactMap], list[str]]:
    """Return the maps that a page has room for, those of the largest pressures first, and the supports of the others.

    Args:
        maps: Maps of all supports.
        most: Numbers of 16 bits to keep; frames without contact and points that nothing presses on take none for zeros.
    """
    kept, used = set[int](), 0
    for k in sorted(range(len(maps)), key=lambda k: -maps[k].largest):
        if used + maps[k].size <= most:
            kept.add(k)
            used += maps[k].size
    left = [one.support for k, one in enumerate(maps) if k not in kept]
    return [maps[k] for k in sorted(kept)], list(dict.fromkeys(left))


def _around(face: str, numbers: np.ndarray, points: np.ndarray, frames: Sequence[Frame]) -> FacePressure:
    numbers, x, angles = unrolled(numbers, points)
    flat = np.column_stack([(one - one.min()) / (np.ptp(one) or 1.0) for one in (x, angles)])
    try:
        triangles = Delaunay(flat).simplices
    except QhullError:  # all on a line
        triangles = np.empty((0, 3), dtype=int)
    return FacePressure(face, x, angles, triangles, np.array([frame.contact_pressure[numbers] for frame in frames]))


def _over_x(face: str, numbers: np.ndarray, places: np.ndarray, near: float, frames: Sequence[Frame]) -> FacePressure:
    """Return the largest pressure across the beam at the places of the mesh, or in bins where every point has its own.

    Args:
        face: Name.
        numbers: Numbers of the points on it, (p,).
        places: x of each, (p,), m.
        near: Distance of places that are one, m.
        frames: The fields.
    """
    order = np.argsort(places, kind="stable")
    starts = np.r_[0, np.flatnonzero(np.diff(places[order]) > near) + 1]
    sizes = np.diff(np.r_[starts, len(order)])
    x = np.add.reduceat(places[order], starts) / sizes
    if sizes.min() != sizes.max():
        bins = max(1, round(np.sqrt(len(order))))
        edges = np.linspace(places.min(), places.max(), bins + 1)
        starts = np.unique(np.searchsorted(places[order], edges[:-1] - near))
        sizes = np.diff(np.r_[starts, len(order)])
        x = np.add.reduceat(places[order], starts) / sizes
    values = [np.maximum.reduceat(frame.contact_pressure[numbers[order]], starts) for frame in frames]
    return FacePressure(face, x, np.empty(0), np.empty((0, 3), dtype=int), np.array(values))
