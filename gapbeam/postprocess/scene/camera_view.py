"""One camera on a solid beam in its support, drawn by VTK: a picture for every frame."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import meshio
import numpy as np
import pyvista as pv
from PIL import Image
from vtkmodules.vtkFiltersGeometry import vtkDataSetSurfaceFilter
from vtkmodules.vtkRenderingCore import vtkMapper

from gapbeam.postprocess.results.field_reader import Frame
from gapbeam.postprocess.scene.motion_range import Window, shown_displacement
from gapbeam.postprocess.scene.set_up import MeshedBody, facing
from gapbeam.postprocess.scene.support_surface import FaceBox, SupportBoxes, ring_of
from gapbeam.postprocess.scene.surface_color import ABOVE, BEAM, BELOW, CELLS, EDGE, REST, SurfaceColor

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
        rest: Undeformed places, (p, 3), m.
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
        skin: Its outer surface except for `faces`.
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


_ANGLE = 10.0
# Pictures are drawn so many times finer and averaged: smooth lines with every renderer.
_FINER = 2
_SAMPLES = 8  # of each of these pixels in a still picture; a film takes one, which is four times as fast


class View:
    """A camera on the scene: a perspective from the front and above, the beam axis horizontal."""

    def __init__(
        self,
        body: BeamSurface,
        support: SupportBoxes,
        window: Window,
        size: tuple[int, int],
        scale: float,
        color: SurfaceColor,
        direction: tuple[float, float, float],
        meshed: bool = False,
    ) -> None:
        """Set up the scene.

        Args:
            body: Surface of the beam, moved by `picture`.
            support: Support, drawn with its clearance times `scale`.
            window: Window of the view.
            size: Width and height of the picture in pixels.
            scale: Factor of displacements and clearance.
            color: Color of the surface.
            direction: Direction from the target to the camera.
            meshed: Whether the cells of the mesh are drawn.
        """
        self._body, self._scale, self._color = body, scale, color
        vtkMapper.SetResolveCoincidentTopologyToPolygonOffset()  # outlines stay in front of their faces
        fine = [_FINER * size[0], _FINER * size[1]]
        plotter: Any = pv.Plotter(off_screen=True, window_size=fine, lighting="light kit")
        plotter.render_window.SetMultiSamples(_SAMPLES)
        # Supports one can see through are all gray: it hardly matters which is in front, and to blend them in any order
        # takes a third of the time of a picture. VTK 9.4 leaves no choice.
        if hasattr(plotter.renderer, "SetUseOIT"):
            plotter.renderer.SetUseOIT(False)
        plotter.set_background("white")
        line = _FINER * max(1.0, size[0] / 900)
        lit = not color.everywhere  # light would change the colors that a scale explains
        shade: dict[str, Any] = {
            "lighting": lit,
            "show_scalar_bar": False,
            "ambient": 0.3 if lit else 0.0,
        }
        rest = body.edges.mesh.copy()
        rest.points = body.edges.rest.copy()
        _add(plotter, rest, color=REST, line_width=0.7 * line, lighting=False)
        self._support, self._moving = support, _add_blocks(plotter, support, scale, line)
        if meshed:
            shade |= {"show_edges": True, "edge_color": CELLS, "line_width": 0.4 * line}
        table = pv.LookupTable(color.colors, n_values=256, scalar_range=color.limits)
        colored = {"scalars": COLORED, "cmap": table, **shade}
        _add(plotter, body.skin.mesh, **(colored if color.everywhere else {"color": BEAM, "scalars": None, **shade}))
        _add(plotter, body.edges.mesh, color=EDGE, scalars=None, line_width=line, lighting=False)
        _add(plotter, body.faces.mesh, **colored)
        _look_from(plotter, window, support, size, np.array(direction))
        self._plotter = plotter

    def picture(self, frame: Frame, motions: Mapping[str, float] | None = None) -> np.ndarray:
        """Draw one frame, (height, width, 3), 8 bits.

        Args:
            frame: The fields.
            motions: `wall_motion` by its name, m; None: walls are where they were at t = 0.
        """
        for piece, meshes in self._moving:
            here = replace(piece, met=piece.met.moved(motions or {}))
            for mesh, moved in zip(meshes, _drawn(self._support, here, self._scale), strict=True):
                mesh.copy_from(moved)
        shown = shown_displacement(frame, self._scale)
        for part in self._body.parts:
            part.move(shown, self._scale)
        for part in (self._body.skin, self._body.faces):
            part.color(self._color.values(frame))
        self._plotter.render()
        return np.asarray(Image.fromarray(self._plotter.screenshot(return_img=True)).reduce(_FINER))

    def hurry(self) -> None:
        """Draw from now on as films are drawn: nobody sees the edges of a picture that moves."""
        self._plotter.render_window.SetMultiSamples(0)

    def fractions(self, points: np.ndarray) -> np.ndarray:
        """Return the places of points, (k, 3), m, in the picture, (k, 2): fractions of its width and height."""
        camera, (width, height) = self._plotter.camera, self._plotter.window_size
        ahead = np.subtract(camera.focal_point, camera.position)
        ahead /= np.linalg.norm(ahead)
        right = np.cross(ahead, camera.up)
        right /= np.linalg.norm(right)
        away = points - np.array(camera.position)
        half = np.tan(np.radians(0.5 * camera.view_angle)) * (away @ ahead)  # of the height there, m
        across = np.stack([away @ right * (height / width), away @ np.cross(right, ahead)], axis=1)
        return np.asarray(0.5 + 0.5 * across / half[:, None])

    def close(self) -> None:
        """Let the graphics memory go."""
        self._plotter.close()


def _add(plotter: Any, mesh: pv.PolyData, **style: Any) -> None:
    """Draw a part of the beam, unless there is nothing of it: a round section has no edges along the beam."""
    if mesh.n_points:
        plotter.add_mesh(mesh, **style)


Meshes = tuple[pv.PolyData, pv.PolyData]


def _add_blocks(plotter: pv.Plotter, support: SupportBoxes, scale: float, line: float) -> list[tuple[FaceBox, Meshes]]:
    """Draw the faces of all supports; return those that move, with their surface and edges.

    One around the beam is a ring that one can see through.
    """
    moving = list[tuple[FaceBox, Meshes]]()
    for piece in support.blocks:
        surface, edges = _drawn(support, piece, scale)
        if piece.met.around:
            plotter.add_mesh(surface, color=BELOW, opacity=0.35, lighting=True, ambient=0.3)
        else:
            color, opacity = (BELOW, 1.0) if piece.met.below else (ABOVE, 0.5)
            plotter.add_mesh(surface, color=color, opacity=opacity, lighting=True, ambient=0.3)
        plotter.add_mesh(edges, color=EDGE, line_width=line, lighting=False)
        if piece.met.moves:
            moving.append((piece, (surface, edges)))
    return moving


def _drawn(support: SupportBoxes, piece: FaceBox, scale: float) -> Meshes:
    """Return surface and edges of a face of a support."""
    box = support.box(piece, scale)
    if piece.met.around:
        middle = 0.5 * (box[2] + box[3]), 0.5 * (box[4] + box[5])
        ring = ring_of(piece.met, piece.along, middle, piece.thickness, scale)
        ring.points[:, 2] += piece.rise(ring.points[:, 0], scale)
        return ring, ring.extract_feature_edges(feature_angle=25.0, boundary_edges=False, non_manifold_edges=False)
    block = pv.Box(bounds=box)
    block.points[:, 2] += piece.rise(block.points[:, 0], scale)
    return block, block.extract_feature_edges(boundary_edges=False, non_manifold_edges=False, manifold_edges=False)


def _look_from(
    plotter: pv.Plotter, window: Window, support: SupportBoxes, size: tuple[int, int], direction: np.ndarray
) -> None:
    """Put the camera where the corners of the window, drawn through the width of the beam, just fit."""
    toward = direction / np.linalg.norm(direction)
    right = np.cross([0.0, 0.0, 1.0], toward)
    right /= np.linalg.norm(right)
    up = np.cross(toward, right)
    corners = np.array([(x, y, z) for x in window.x for y in (support.front, support.back) for z in window.height])
    target = corners.mean(axis=0)
    slope = np.tan(np.radians(0.5 * _ANGLE))
    across, along, depth = (np.abs((corners - target) @ axis) for axis in (right, up, toward))
    distance = float(max((across * size[1] / size[0] / slope + depth).max(), (along / slope + depth).max()))
    plotter.camera.view_angle = _ANGLE
    plotter.camera.focal_point = tuple(target)
    plotter.camera.position = tuple(target + distance * toward)
    plotter.camera.up = (0.0, 0.0, 1.0)
    reach = float(depth.max()) + float(np.ptp(window.x)) + float(np.ptp(window.height))
    plotter.camera.clipping_range = (max(0.01 * distance, distance - reach), distance + reach)
