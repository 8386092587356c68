"""Quadrilaterals that fill a polygon: a grid where all sides are upright or level, else pairs of triangles.

Triangles of twice the wanted size are joined in pairs as far as good quadrilaterals come out. Quadrilaterals are then
divided into four, and the triangles that are left into three: all cells have four sides and meet side to side. A
polygon that is symmetric about the bending plane has symmetric cells.
"""

from __future__ import annotations

import math
from functools import lru_cache
from itertools import pairwise, product

import numpy as np

from gapbeam.meshes.mesh_errors import MeshError
from gapbeam.meshes.sections.section_mesh import SAME, BoolArray, Indices, PolygonOutline, edges_of, refined_delaunay
from gapbeam.meshes.sections.section_patches import (
    Array,
    Place,
    SectionCurve,
    SectionPatches,
    Side,
    grid_patches,
    patches_of,
)

SLACK = 0.05  # of a cell
JOINED = 0.4  # least sine of the corners of a quadrilateral that two triangles make
SMOOTHED = 8  # times that corners within the section move to the mean of their neighbors
LEAST = 0.05  # sine of an angle of a cell


@lru_cache(maxsize=64)
def polygon_patches(outline: PolygonOutline, through: int, across: int) -> SectionPatches:
    """Return the patches of a polygon.

    Args:
        outline: The polygon.
        through: Cells through its extent along z, about.
        across: Cells across its extent along y, about.

    Raises:
        MeshError: The polygon cannot be filled with cells that are good enough.
    """
    lengths = outline.extents[0] / across, outline.extents[1] / through
    if outline.upright:
        return _grid(outline, lengths)
    return _quadrilaterals(outline, math.sqrt(lengths[0] * lengths[1]))


def _grid(outline: PolygonOutline, lengths: tuple[float, float]) -> SectionPatches:
    """Return the rectangles between lines through all corners."""
    lines, cells = list[list[float]](), list[list[int]]()
    for axis, length in enumerate(lengths):
        places = sorted({corner[axis] for loop in outline.loops for corner in loop})
        kept = places[:1]
        kept += [place for before, place in pairwise(places) if place - before > SAME * outline.size]
        lines.append(kept)
        cells.append([max(1, math.ceil((high - low) / length - SLACK)) for low, high in pairwise(kept)])
    filled = [
        [
            bool(outline.contains(np.array([[0.5 * (left + right), 0.5 * (low + high)]]))[0])
            for left, right in pairwise(lines[0])
        ]
        for low, high in pairwise(lines[1])
    ]
    return grid_patches((lines[0], lines[1]), (cells[0], cells[1]), filled)


def _quadrilaterals(outline: PolygonOutline, length: float) -> SectionPatches:
    """Return the quadrilaterals of triangles with sides of twice a length."""
    sides, area = _divided(outline, 2.0 * length), outline.moments.area

    def inside(places: Array) -> BoolArray:
        return np.asarray(outline.contains(places) & ((places[:, 0] > 0.0) | (not outline.mirrored)))

    whole = refined_delaunay(
        sides, inside, lambda places: np.full(len(places), 2.0 * length), 0.5 * area if outline.mirrored else area
    )
    points, cells = _divided_cells(whole.points, whole.triangles)
    points = _smoothed(points, cells)
    if outline.mirrored:
        points, cells = _with_mirror_image(points, cells)
    if (worst := float(np.min(_sines(points, cells)))) < LEAST:
        raise MeshError(
            "cross-section",
            found=f"cells with an angle of {math.degrees(math.asin(max(worst, -1.0))):.2g} degrees",
            expected="a polygon that cells with better angles fill",
            hint="More cells (cells_through_thickness), or fewer small details.",
        )
    return _as_patches(outline, points, cells)


def _divided(outline: PolygonOutline, length: float) -> Array:
    """Return the sides in equal parts of at most a length, (n, 2, 2), m; of a symmetric polygon those of a half."""
    sides = list(outline.sides)
    if outline.mirrored:
        near = SAME * outline.size
        sides = [np.where(np.abs(side) <= [[near, 0.0]], 0.0, side) for side in sides]
        for side in sides:
            if side[0, 0] * side[1, 0] < 0.0:  # level, as its mirror image is itself
                side[int(side[1, 0] < 0.0)] = 0.0, side[int(side[1, 0] > 0.0), 1]
        sides = [side for side in sides if side[:, 0].max() > 0.0]
        ends = sorted({float(z) for side in sides for y, z in side if y == 0.0})
        for low, high in pairwise(ends):
            if outline.contains(np.array([[0.0, 0.5 * (low + high)]]))[0]:
                sides.append(np.array([[0.0, low], [0.0, high]]))
    found = []
    for start, end in sides:
        count = max(1, math.ceil(float(np.linalg.norm(end - start)) / length - SLACK))
        places = [start, *(start + number / count * (end - start) for number in range(1, count)), end]
        found += [np.stack(pair) for pair in pairwise(places)]
    return np.array(found)


def _divided_cells(points: Array, triangles: Indices) -> tuple[Array, Indices]:
    """Return quadrilaterals: four for each pair of triangles that makes a good one, three for each other triangle."""
    rings = _joined(points, triangles)
    edges, _ = edges_of(triangles)
    known = {(int(a), int(b)): len(points) + number for number, (a, b) in enumerate(edges)}
    places = [*points, *(0.5 * (points[edges[:, 0]] + points[edges[:, 1]]))]
    cells = []
    for ring in rings:
        center = len(places)
        places.append(points[list(ring)].mean(axis=0))
        middles = [known[(min(pair), max(pair))] for pair in pairwise((*ring, ring[0]))]
        cells += [(corner, middles[n], center, middles[n - 1]) for n, corner in enumerate(ring)]
    used, cells_of_used = np.unique(np.array(cells), return_inverse=True)  # not the middles of edges that are gone
    return np.array(places)[used], cells_of_used.reshape(-1, 4)


def _joined(points: Array, triangles: Indices) -> list[tuple[int, ...]]:
    """Return the corners of quadrilaterals, where two triangles make a good one, and of the triangles that are left."""
    edges, numbers = edges_of(triangles)
    beside = list[list[int]]([] for _ in edges)
    for triangle, three in enumerate(numbers):
        for edge in three:
            beside[edge].append(triangle)
    pairs = []
    for (start, end), both in zip(edges, beside, strict=True):
        if len(both) == 2:
            tips = [int(sum(triangles[one]) - start - end) for one in both]
            ring = (tips[0], int(start), tips[1], int(end))
            sines = _sines(points, np.array([ring]))
            if sines.mean() < 0.0:
                ring, sines = ring[::-1], -sines
            pairs.append((float(np.min(sines)), both, ring))
    free, found = set(range(len(triangles))), list[tuple[int, ...]]()
    for sine, both, ring in sorted(pairs, key=lambda pair: -pair[0]):
        if sine >= JOINED and free.issuperset(both):
            free.difference_update(both)
            found.append(ring)
    return found + [tuple(int(corner) for corner in triangles[number]) for number in sorted(free)]


def _sines(points: Array, cells: Indices) -> Array:
    """Return the sines of the angles of quadrilaterals, (k, 4); negative where they are re-entrant."""
    corners = points[cells]
    after, before = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    cross = after[..., 0] * before[..., 1] - after[..., 1] * before[..., 0]
    return np.asarray(cross / (np.linalg.norm(after, axis=2) * np.linalg.norm(before, axis=2)))


def _smoothed(points: Array, cells: Indices) -> Array:
    """Return points, but those on the rim, moved toward the mean of their neighbors while the worst angle improves."""
    sides = cells[:, [[0, 1], [1, 2], [2, 3], [3, 0]]].reshape(-1, 2)
    edges, counts = np.unique(np.sort(sides, axis=1), axis=0, return_counts=True)
    moved = np.ones(len(points), dtype=bool)
    moved[edges[counts == 1].reshape(-1)] = False
    degree = np.bincount(edges.reshape(-1), minlength=len(points))[:, None]
    best, worst = points, float(np.min(_sines(points, cells)))
    for _ in range(SMOOTHED):
        sums = np.zeros_like(points)
        np.add.at(sums, edges[:, 0], points[edges[:, 1]])
        np.add.at(sums, edges[:, 1], points[edges[:, 0]])
        points = np.where(moved[:, None], sums / degree, points)
        if (sine := float(np.min(_sines(points, cells)))) >= worst:
            best, worst = points, sine
    return best


def _with_mirror_image(points: Array, cells: Indices) -> tuple[Array, Indices]:
    """Return the cells on both sides of y = 0."""
    aside = np.flatnonzero(points[:, 0] > 0.0)
    image = np.arange(len(points))
    image[aside] = len(points) + np.arange(len(aside))
    whole = np.concatenate([points, points[aside] * [-1.0, 1.0]])
    return whole, np.concatenate([cells, image[cells][:, ::-1]])


def _as_patches(outline: PolygonOutline, points: Array, cells: Indices) -> SectionPatches:
    """Return each quadrilateral as a patch of one cell."""
    top, near = 0.5 * outline.extents[1], SAME * outline.size
    places: list[Place] = [(float(y), float(z)) for y, z in points]
    curves = dict[tuple[int, int], SectionCurve]()
    for cell, number in product(cells, range(4)):
        ends = int(cell[number - 1]), int(cell[number])
        pair = min(ends), max(ends)
        heights = [places[end][1] for end in pair]
        side: Side = "inside"
        if all(abs(z + top) <= near for z in heights):
            side = "below"
        elif all(abs(z - top) <= near for z in heights):
            side = "above"
        curves.setdefault(pair, SectionCurve(places[pair[0]], places[pair[1]], 1, side=side))
    return patches_of(list(curves.values()), [[places[corner] for corner in cell] for cell in cells])
