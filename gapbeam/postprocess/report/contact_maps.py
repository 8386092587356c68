"""Contact pressure on the faces of supports in the frames of a scene: over x and angle around a beam, else over x."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from meshio import CellBlock
from scipy.spatial import Delaunay, QhullError

from gapbeam.postprocess.report.face_points import face_points
from gapbeam.postprocess.report.moving_scene import ContactMap, FacePressure, SceneWall
from gapbeam.postprocess.results.field_reader import Frame
from gapbeam.postprocess.scene.unrolled import unrolled

FloatArray = np.ndarray

MOST = 300_000  # numbers of 16 bits in a page: 0.8 MB
_SAME = 1.0e-6  # of the length: places along the beam that are one


def contact_maps_of(
    points: FloatArray, cells: Iterable[CellBlock], dimension: int, walls: Sequence[SceneWall], frames: Sequence[Frame]
) -> list[ContactMap]:
    """Return the maps of the supports that the beam presses on at some time.

    Faces around the beam have a map each, the planes of a support have one together.

    Args:
        points: Of the mesh, (n, 3), m.
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


def within_room(maps: Sequence[ContactMap], most: int = MOST) -> tuple[list[ContactMap], list[str]]:
    """Return the maps that a page has room for, those of the largest pressures first, and the supports of the others.

    Args:
        maps: Of all supports.
        most: Numbers of 16 bits to keep; frames without contact and points that nothing presses on take none for zeros.
    """
    kept, used = set[int](), 0
    for k in sorted(range(len(maps)), key=lambda k: -maps[k].largest):
        if used + maps[k].size <= most:
            kept.add(k)
            used += maps[k].size
    left = [one.support for k, one in enumerate(maps) if k not in kept]
    return [maps[k] for k in sorted(kept)], list(dict.fromkeys(left))


def _around(face: str, numbers: np.ndarray, points: FloatArray, frames: Sequence[Frame]) -> FacePressure:
    numbers, x, angles = unrolled(numbers, points)
    flat = np.column_stack([(one - one.min()) / (np.ptp(one) or 1.0) for one in (x, angles)])
    try:
        triangles = Delaunay(flat).simplices
    except QhullError:  # all on a line
        triangles = np.empty((0, 3), dtype=int)
    return FacePressure(face, x, angles, triangles, np.array([frame.contact_pressure[numbers] for frame in frames]))


def _over_x(face: str, numbers: np.ndarray, places: FloatArray, near: float, frames: Sequence[Frame]) -> FacePressure:
    """Return the largest pressure across the beam at the places of the mesh, or in bins where every point has its own.

    Args:
        face: Name.
        numbers: Of the points on it, (p,).
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
