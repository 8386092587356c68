"""One camera on the beam in its support: a picture for every frame."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyvista as pv
from matplotlib.colors import LinearSegmentedColormap
from vtkmodules.vtkRenderingCore import vtkMapper

from gapbeam.postprocess.results.field_reader import Frame
from gapbeam.postprocess.scene.beam_surface import PRESSURE, BeamSurface
from gapbeam.postprocess.scene.camera_window import Window
from gapbeam.postprocess.scene.ring import ring_of
from gapbeam.postprocess.scene.support_surface import FaceBox, SupportBoxes

BEAM = "#C9D3DC"
BELOW = "#808080"
ABOVE = "#9C9C9C"
EDGE = "#2B2B2B"
REST = "#9A9A9A"
# From the color of the beam through orange to dark red: darker means more, also in print without color.
PRESSURES = LinearSegmentedColormap.from_list("pressure", [BEAM, "#F2C94C", "#E8702A", "#B0200C", "#4A0508"])

_ANGLE = 10.0
_FACE_LINE = 7.0
# Pictures are drawn so many times finer and averaged: smooth lines with every renderer.
_FINER = 2


class View:
    """A camera on the scene.

    In 2D a parallel projection that fills the picture with the window exactly; in 3D a perspective from the
    front and above, the beam axis horizontal.
    """

    def __init__(
        self,
        body: BeamSurface,
        support: SupportBoxes,
        window: Window,
        size: tuple[int, int],
        scale: float,
        largest_pressure: float,
        direction: tuple[float, float, float],
    ) -> None:
        """Set up the scene.

        Args:
            body: Moved by `picture`.
            support: Drawn with its clearance times `scale`.
            window: What to see.
            size: Width and height of the picture in pixels.
            scale: Factor of displacements and clearance.
            largest_pressure: Upper end of the colors, Pa.
            direction: From what is seen to the camera, 3D.
        """
        self._body, self._scale = body, scale
        vtkMapper.SetResolveCoincidentTopologyToPolygonOffset()  # outlines stay in front of their faces
        flat = support.dimension == 2
        fine = [_FINER * size[0], _FINER * size[1]]
        plotter: Any = pv.Plotter(off_screen=True, window_size=fine, lighting="none" if flat else "light kit")
        plotter.set_background("white")
        line = _FINER * max(1.0, size[0] / 900)
        shade: dict[str, Any] = {
            "lighting": not flat,
            "show_scalar_bar": False,
            "ambient": 0.0 if flat else 0.3,
        }
        rest = body.edges.mesh.copy()
        rest.points = body.edges.rest - (0.0, 0.0, 1e-3 if flat else 0.0)  # in 2D behind the beam
        _add(plotter, rest, color=REST, line_width=0.7 * line, lighting=False)
        _add_blocks(plotter, support, scale, line)
        _add(plotter, body.skin.mesh, color=BEAM, scalars=None, **shade)
        _add(plotter, body.edges.mesh, color=EDGE, scalars=None, line_width=line, lighting=False)
        _add(
            plotter, body.faces.mesh, scalars=PRESSURE, cmap=_colors(largest_pressure, flat),
            line_width=_FACE_LINE * line, **shade,
        )  # fmt: skip
        if flat:
            _look_flat(plotter, window)
        else:
            _look_from(plotter, window, support, size, np.array(direction))
        self._plotter = plotter

    def picture(self, frame: Frame) -> np.ndarray:
        """Draw one frame, (height, width, 3), 8 bits."""
        for part in self._body.parts:
            part.move(frame.displacement, self._scale)
        self._body.faces.color(frame.contact_pressure)
        self._plotter.render()
        fine = np.asarray(self._plotter.screenshot(return_img=True))
        places = [(row, column) for row in range(_FINER) for column in range(_FINER)]
        summed = sum(fine[row::_FINER, column::_FINER].astype(np.uint16) for row, column in places)
        return np.asarray((summed + len(places) // 2) // len(places)).astype(np.uint8)

    def close(self) -> None:
        """Let the graphics memory go."""
        self._plotter.close()


def _add(plotter: Any, mesh: pv.PolyData, **style: Any) -> None:
    """Draw a part of the beam, unless there is nothing of it: a round section has no edges along the beam."""
    if mesh.n_points:
        plotter.add_mesh(mesh, **style)


def _colors(largest_pressure: float, flat: bool) -> pv.LookupTable:
    """Colors from 0 to the largest pressure; the thick lines of 2D show only where there is pressure."""
    table = pv.LookupTable(PRESSURES, n_values=256, scalar_range=(0.0, largest_pressure or 1.0))
    if flat:
        values = np.array(table.values)
        values[:4, 3] = 0
        table.values = values
    return table


def _add_blocks(plotter: pv.Plotter, support: SupportBoxes, scale: float, line: float) -> None:
    flat = support.dimension == 2
    for piece in support.blocks:
        if piece.around:
            _add_ring(plotter, support, piece, scale, line)
            continue
        box, color = support.box(piece, scale), BELOW if piece.below else ABOVE
        opacity = 1.0 if flat or piece.below else 0.5
        corners = [(box[0], box[2], 0.0), (box[1], box[2], 0.0), (box[1], box[3], 0.0)]
        block = pv.Rectangle(corners) if flat else pv.Box(bounds=box)
        block.points[:, 1 if flat else 2] += piece.rise(block.points[:, 0], scale)
        plotter.add_mesh(block, color=color, opacity=opacity, lighting=not flat, ambient=0.0 if flat else 0.3)
        edges = block.extract_feature_edges(boundary_edges=flat, non_manifold_edges=False, manifold_edges=False)
        plotter.add_mesh(edges, color=EDGE, line_width=line, lighting=False)


def _add_ring(plotter: pv.Plotter, support: SupportBoxes, piece: FaceBox, scale: float, line: float) -> None:
    """Draw a support around the beam as a ring that one can see through."""
    box = support.box(piece, scale)
    middle = 0.5 * (box[2] + box[3]), 0.5 * (box[4] + box[5])
    ring = ring_of(piece.met, piece.along, middle, piece.thickness, scale)
    ring.points[:, 2] += piece.rise(ring.points[:, 0], scale)
    plotter.add_mesh(ring, color=BELOW, opacity=0.35, lighting=True, ambient=0.3)
    edges = ring.extract_feature_edges(feature_angle=25.0, boundary_edges=False, non_manifold_edges=False)
    plotter.add_mesh(edges, color=EDGE, line_width=line, lighting=False)


def _look_flat(plotter: Any, window: Window) -> None:
    x, y = window.center
    plotter.camera.position, plotter.camera.focal_point = (x, y, 1.0), (x, y, 0.0)
    plotter.camera.up = (0.0, 1.0, 0.0)
    plotter.enable_parallel_projection()
    plotter.camera.parallel_scale = 0.5 * (window.height[1] - window.height[0])
    plotter.camera.clipping_range = (0.1, 2.0)


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
