"""Set-up for pictures: mesh, supports, loads, probes and cross-sections, in a plane or in space."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import meshio
import numpy as np
from meshio import CellBlock

from gapbeam.postprocess.results.columns_of_run import RunSupport
from gapbeam.postprocess.scene.support_surface import SupportBoxes


@dataclass(frozen=True)
class LoadArrow:
    """A load in a picture.

    Attributes:
        words: Name and size.
        point: Point of application, m, in the frame of the case; None: not at a point.
        direction: Unit vector, (3,), y or z being the bending direction.
        sways: Whether it acts both ways.
        support: The support whose walls it moves; None: no single one.
    """

    words: str
    point: tuple[float, float, float] | None
    direction: tuple[float, float, float]
    sways: bool = True
    support: str | None = None


@dataclass(frozen=True)
class SectionMask:
    """Mask of the points of a plane across the beam that lie in its material.

    Attributes:
        across: Grid along y, (k,), m.
        up: Grid along the bending direction, (l,), m.
        inside: 1 in the material, 0 outside, (l, k).
    """

    across: np.ndarray
    up: np.ndarray
    inside: np.ndarray


@dataclass(frozen=True)
class SetUp:
    """A case before anything runs.

    Attributes:
        title: Title of the case.
        points: Points of the mesh, (points, 3), m.
        cells: Their corners, by type of cell.
        supports: Supports along the beam.
        regions: The types of their regions, by name.
        sections: The beam in each support, by its name; none where it is not known.
        loads: The loads.
        probes: Points by name, m, in the frame of the case.
        case: The case as tables: its joints, masses and fluids are read.
    """

    title: str
    points: np.ndarray
    cells: list[CellBlock]
    supports: tuple[RunSupport, ...]
    regions: Mapping[str, str]
    sections: Mapping[str, SectionMask]
    loads: tuple[LoadArrow, ...]
    probes: Mapping[str, tuple[float, float, float]]
    case: Mapping[str, Any]

    @cached_property
    def dimension(self) -> int:
        """2 for plane cells, 3 for solids."""
        return 3 if any(block.type in ("tetra", "tetrahedron", "hexahedron") for block in self.cells) else 2

    @cached_property
    def cell_count(self) -> int:
        """Cells of the mesh."""
        return sum(len(block.data) for block in self.cells)


_ON_CIRCLE = 1.0e-3  # of the radius
_NEAR = 1.0e-6
_LEAST_FACING = 1.0e-3


class MeshedBody(Protocol):
    """Body that surfaces are taken from: the fields of a run, or a mesh alone."""

    @property
    def points(self) -> np.ndarray:
        """(points, 3), m."""

    @property
    def cells(self) -> list[meshio.CellBlock]:
        """Their corners, by type of cell."""


def facing(facets: np.ndarray, normals: np.ndarray, points: np.ndarray, support: SupportBoxes) -> dict[str, np.ndarray]:
    """Return masks of the facets that face each plane of the supports, (facets,) by face: flat and curved ones alike.

    These are the facets along the block whose outward normal points at it, on its side of the middle of the section.

    Args:
        facets: Numbers of their points, (facets, corners).
        normals: Component in the bending direction of the outward unit normals, (facets,).
        points: Points of the mesh, (n, 3), m.
        support: Beam and support.
    """
    near = _NEAR * (support.end - support.start)
    first, last = points[facets, 0].min(axis=1, initial=np.inf), points[facets, 0].max(axis=1, initial=-np.inf)
    height = points[facets, support.dimension - 1].mean(axis=1)
    middle = 0.5 * (support.bottom + support.top)
    radii = np.hypot(points[facets, 1], points[facets, support.dimension - 1] - middle)
    radius = radii.min(axis=1, initial=np.inf)
    down = (normals < -_LEAST_FACING) & (height < middle)
    up = (normals > _LEAST_FACING) & (height > middle)
    return {
        block.met.face: (
            radius > (1.0 - _ON_CIRCLE) * 0.5 * block.thickness if block.met.around else down if block.met.below else up
        )
        & (first >= block.along[0] - near)
        & (last <= block.along[1] + near)
        for block in support.blocks
    }


@dataclass(frozen=True)
class PlaneBody:
    """The beam, by numbers of its mesh points.

    Attributes:
        rest: Undeformed places of the points, (n, 2), m.
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
