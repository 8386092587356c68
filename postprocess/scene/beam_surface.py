"""The beam as surfaces that can be moved: skin, edges, and the parts of it that face the support."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import meshio
import numpy as np
import pyvista as pv
from vtkmodules.vtkFiltersGeometry import vtkDataSetSurfaceFilter

from gapbeam.postprocess.scene.support_surface import SupportBoxes

COLORED = "colored by"

_ON_CIRCLE = 1.0e-3  # of the radius
_NEAR = 1.0e-6
_ORIGINAL = "original point"
_CELL = "vtkOriginalCellIds"
_LEAST_FACING = 1.0e-3
_EDGE = 44.0  # degrees; the facets of a round face of some ten of them meet at smaller angles, a chamfer at 45


class MeshedBody(Protocol):
    """What surfaces are taken of: the fields of a run, or a mesh alone."""

    @property
    def points(self) -> np.ndarray:
        """(points, 3), m."""

    @property
    def cells(self) -> list[meshio.CellBlock]:
        """Their corners, by type of cell."""


@dataclass(frozen=True)
class Part:
    """A piece of the beam's surface.

    Attributes:
        mesh: Its polygons or lines, moved in place.
        points: Numbers of its points in the mesh of the run, (p,).
        rest: Where they are undeformed, (p, 3), m.
    """

    mesh: pv.PolyData
    points: np.ndarray
    rest: np.ndarray

    def move(self, displacement: np.ndarray, scale: float) -> None:
        """Put every point at its place + scale * displacement, given for all points of the mesh, (n, 3)."""
        self.mesh.points = self.rest + scale * displacement[self.points]

    def color(self, values: np.ndarray) -> None:
        """Set what it is colored by; of all points of the mesh, (n,)."""
        self.mesh.point_data[COLORED] = values[self.points]


@dataclass(frozen=True)
class BeamSurface:
    """The beam.

    Attributes:
        skin: Its outer surface but for `faces`; the whole plane in 2D.
        edges: Its outline.
        faces: What faces a support; lines in 2D.
        touching: Numbers of the mesh points on each face of the supports.
    """

    skin: Part
    edges: Part
    faces: Part
    touching: dict[str, np.ndarray]

    @property
    def parts(self) -> tuple[Part, Part, Part]:
        """All that moves."""
        return self.skin, self.edges, self.faces


def body_of(fields: MeshedBody, support: SupportBoxes) -> BeamSurface:
    """Take the surfaces of the mesh.

    Args:
        fields: The fields of a run, or a mesh.
        support: Beam and support of the same run.
    """
    grid = pv.from_meshio(meshio.Mesh(fields.points, fields.cells))
    grid.point_data[_ORIGINAL] = np.arange(grid.n_points)
    skin = _surface(grid)
    edges = skin.extract_feature_edges(
        feature_angle=_EDGE,
        boundary_edges=support.dimension == 2,
        non_manifold_edges=False,
        manifold_edges=False,
    )
    if support.dimension == 2:
        outline = _part(edges, fields)
        pairs = edges.lines.reshape(-1, 3)[:, 1:]
        held = _facing(outline.points[pairs], _lines_normals(outline.rest[pairs], support), fields.points, support)
        facing = np.any(list(held.values()), axis=0)
        faces = pv.PolyData(
            np.asarray(edges.points),
            lines=np.array([(2, *pair) for pair in pairs[facing]], dtype=int).reshape(-1),
        )
        faces.point_data[_ORIGINAL] = outline.points
        numbers = outline.points[pairs]
    else:
        corners = np.asarray(skin.point_data[_ORIGINAL])[skin.regular_faces].astype(int)
        cells = np.asarray(skin.cell_data[_CELL]).astype(int)
        held = _facing(
            corners, _normals(fields.points[corners], grid.cell_centers().points[cells]), fields.points, support
        )
        facing = np.any(list(held.values()), axis=0)
        faces, skin = _pick(skin, facing), _pick(skin, ~facing)
        numbers = corners
    touching = {face: np.unique(numbers[which]) for face, which in held.items()}
    return BeamSurface(_part(skin, fields), _part(edges, fields), _part(faces, fields), touching)


def _part(mesh: pv.PolyData, fields: MeshedBody) -> Part:
    numbers = np.asarray(mesh.point_data[_ORIGINAL] if mesh.n_points else []).astype(int)
    rest = fields.points[numbers]
    copy = mesh.copy()
    copy.clear_data()
    copy.points = rest.copy()
    copy.point_data[COLORED] = np.zeros(numbers.size)
    return Part(copy, numbers, rest)


def _facing(
    facets: np.ndarray, normals: np.ndarray, points: np.ndarray, support: SupportBoxes
) -> dict[str, np.ndarray]:
    """Which facets of the surface face each plane of the supports, (facets,) by face: flat and curved ones alike.

    These are the facets along the block whose outward normal points at it, on its side of the middle of the section.

    Args:
        facets: Numbers of their points, (facets, corners).
        normals: Component in the bending direction of the outward unit normals, (facets,).
        points: Of the mesh, (n, 3), m.
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
        block.face: (
            radius > (1.0 - _ON_CIRCLE) * 0.5 * block.thickness if block.around else down if block.below else up
        )
        & (first >= block.along[0] - near)
        & (last <= block.along[1] + near)
        for block in support.blocks
    }


def _lines_normals(lines: np.ndarray, support: SupportBoxes) -> np.ndarray:
    """Component in the bending direction of the normals of the outline, away from the middle of the beam, (lines,).

    Args:
        lines: (lines, 2, 3), m.
        support: Beam and support.
    """
    along = lines[:, 1] - lines[:, 0]
    share = np.abs(along[:, 0]) / np.linalg.norm(along, axis=1)
    return np.where(lines[:, :, 1].mean(axis=1) < 0.5 * (support.bottom + support.top), -share, share)


def _normals(corners: np.ndarray, behind: np.ndarray) -> np.ndarray:
    """Component in the bending direction of the normals of facets, outward from the middle of the cell behind each.

    Args:
        corners: (facets, corners, 3), m.
        behind: (facets, 3), m.
    """
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    outward = np.sign(np.einsum("fd,fd->f", corners.mean(axis=1) - behind, normals))
    return np.asarray(outward * normals[:, 2] / np.linalg.norm(normals, axis=1))


def _pick(surface: pv.PolyData, cells: np.ndarray) -> pv.PolyData:
    chosen: Any = np.flatnonzero(cells)
    return _surface(surface.extract_cells(chosen))


def _surface(mesh: pv.DataSet) -> pv.PolyData:
    """The outer surface; by VTK's filter, since pyvista's method warns of its default in some versions."""
    outside = vtkDataSetSurfaceFilter()
    outside.SetInputDataObject(mesh)
    outside.PassThroughCellIdsOn()
    outside.Update()
    return pv.wrap(outside.GetOutput())
