"""The beam as surfaces that can be moved: skin, edges, and the parts of it that face the support."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import meshio
import numpy as np
import pyvista as pv
from vtkmodules.vtkFiltersGeometry import vtkDataSetSurfaceFilter

from postprocess.fields import Fields
from postprocess.scene.support import Support

PRESSURE = "contact pressure"

_NEAR = 1.0e-6
_ORIGINAL = "original point"


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

    def color(self, pressure: np.ndarray) -> None:
        """Set the contact pressure; of all points of the mesh, (n,), Pa."""
        self.mesh.point_data[PRESSURE] = pressure[self.points]


@dataclass(frozen=True)
class Body:
    """The beam.

    Attributes:
        skin: Its outer surface but for `faces`; the whole plane in 2D.
        edges: Its outline.
        faces: What faces base and gland; lines in 2D.
        base: Numbers of the mesh points on the base, (b,).
        gland: Numbers of the mesh points under the gland, (g,).
    """

    skin: Part
    edges: Part
    faces: Part
    base: np.ndarray
    gland: np.ndarray

    @property
    def parts(self) -> tuple[Part, Part, Part]:
        """All that moves."""
        return self.skin, self.edges, self.faces


def body_of(fields: Fields, support: Support) -> Body:
    """Take the surfaces of the mesh.

    Args:
        fields: The fields of a run.
        support: Beam and support of the same run.
    """
    grid = pv.from_meshio(meshio.Mesh(fields.points, fields.cells))
    grid.point_data[_ORIGINAL] = np.arange(grid.n_points)
    skin = _surface(grid)
    edges = skin.extract_feature_edges(
        feature_angle=30.0,
        boundary_edges=support.dimension == 2,
        non_manifold_edges=False,
        manifold_edges=False,
    )
    base, gland = (
        _facing(fields.points, support, support.bottom),
        _facing(fields.points, support, support.top),
    )
    if support.dimension == 2:
        outline = _part(edges, fields)
        pairs = edges.lines.reshape(-1, 3)[:, 1:]
        chosen = [pair for pair in pairs for face in (base, gland) if np.isin(outline.points[pair], face).all()]
        faces = pv.PolyData(
            np.asarray(edges.points), lines=np.array([(2, *pair) for pair in chosen], dtype=int).reshape(-1)
        )
        faces.point_data[_ORIGINAL] = outline.points
    else:
        numbers = np.asarray(skin.point_data[_ORIGINAL])
        corners = skin.regular_faces
        within = [np.asarray(np.isin(numbers[corners], face).all(axis=1)) for face in (base, gland)]
        facing = within[0] | within[1]
        faces, skin = _pick(skin, facing), _pick(skin, ~facing)
    return Body(_part(skin, fields), _part(edges, fields), _part(faces, fields), base, gland)


def _part(mesh: pv.PolyData, fields: Fields) -> Part:
    numbers = np.asarray(mesh.point_data[_ORIGINAL]).astype(int)
    rest = fields.points[numbers]
    copy = mesh.copy()
    copy.clear_data()
    copy.points = rest.copy()
    copy.point_data[PRESSURE] = np.zeros(numbers.size)
    return Part(copy, numbers, rest)


def _facing(points: np.ndarray, support: Support, level: float) -> np.ndarray:
    """Mesh points of the supported part of the lower or upper face."""
    near = _NEAR * (support.end - support.start)
    bending = points[:, support.dimension - 1]
    return np.flatnonzero((np.abs(bending - level) < near) & (points[:, 0] <= support.start + support.length + near))


def _pick(surface: pv.PolyData, cells: np.ndarray) -> pv.PolyData:
    chosen: Any = np.flatnonzero(cells)
    return _surface(surface.extract_cells(chosen))


def _surface(mesh: pv.DataSet) -> pv.PolyData:
    """The outer surface; by VTK's filter, since pyvista's method warns of its default in some versions."""
    outside = vtkDataSetSurfaceFilter()
    outside.SetInputDataObject(mesh)
    outside.Update()
    return pv.wrap(outside.GetOutput())
