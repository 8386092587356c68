"""A solid beam as surfaces that can be moved: skin, edges, and the parts of it that face the support."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import meshio
import numpy as np
import pyvista as pv
from vtkmodules.vtkFiltersGeometry import vtkDataSetSurfaceFilter

from gapbeam.postprocess.scene.set_up import MeshedBody, facing
from gapbeam.postprocess.scene.support_surface import SupportBoxes

COLORED = "colored by"

_ORIGINAL = "original point"
_CELL = "vtkOriginalCellIds"
_EDGE = 44.0  # degrees; the facets of a round face of some ten of them meet at smaller angles, a chamfer at 45


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
        """Set the values that it is colored by, of all points of the mesh, (n,)."""
        self.mesh.point_data[COLORED] = values[self.points]


@dataclass(frozen=True)
class BeamSurface:
    """The beam.

    Attributes:
        skin: Its outer surface but for `faces`.
        edges: Its outline.
        faces: Parts that face a support.
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
        feature_angle=_EDGE, boundary_edges=False, non_manifold_edges=False, manifold_edges=False
    )
    corners = np.asarray(skin.point_data[_ORIGINAL])[skin.regular_faces].astype(int)
    cells = np.asarray(skin.cell_data[_CELL]).astype(int)
    normals = _normals(fields.points[corners], grid.cell_centers().points[cells])
    held = facing(corners, normals, fields.points, support)
    faced = np.any(list(held.values()), axis=0)
    faces, skin = _pick(skin, faced), _pick(skin, ~faced)
    touching = {face: np.unique(corners[which]) for face, which in held.items()}
    return BeamSurface(_part(skin, fields), _part(edges, fields), _part(faces, fields), touching)


def _part(mesh: pv.PolyData, fields: MeshedBody) -> Part:
    numbers = np.asarray(mesh.point_data[_ORIGINAL] if mesh.n_points else []).astype(int)
    rest = fields.points[numbers]
    copy = mesh.copy()
    copy.clear_data()
    copy.points = rest.copy()
    copy.point_data[COLORED] = np.zeros(numbers.size)
    return Part(copy, numbers, rest)


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
