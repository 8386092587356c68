"""The views of a scene: of a plane drawn by Agg, of a solid by VTK, which is loaded for that alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple, Protocol

import numpy as np

from gapbeam.postprocess.results.field_reader import Frame
from gapbeam.postprocess.scene.camera_window import Window
from gapbeam.postprocess.scene.facing_facets import MeshedBody
from gapbeam.postprocess.scene.offscreen import prepare_offscreen
from gapbeam.postprocess.scene.plane_body import plane_body
from gapbeam.postprocess.scene.plane_view import PlaneView
from gapbeam.postprocess.scene.support_surface import SupportBoxes
from gapbeam.postprocess.scene.surface_color import SurfaceColor


class PictureView(Protocol):
    """A view of the beam in its support; to be closed."""

    def picture(self, frame: Frame, motions: Mapping[str, float] | None = None) -> np.ndarray:
        """Draw one frame, (height, width, 3 or 4), 8 bits; to be used before the next one is drawn."""

    def hurry(self) -> None:
        """Draw from now on as films are drawn."""

    def fractions(self, points: np.ndarray) -> np.ndarray:
        """Return where points, (k, 3), m, are in the picture, (k, 2): fractions of its width and height."""

    def close(self) -> None:
        """Let what it draws with go."""


class Shot(NamedTuple):
    """How a view is taken.

    Attributes:
        window: What to see.
        size: Width and height of the picture in pixels.
        scale: Factor of displacements and clearance.
        direction: From what is seen to the camera, of a solid.
    """

    window: Window
    size: tuple[int, int]
    scale: float
    direction: tuple[float, float, float]


def views_of(
    mesh: MeshedBody, support: SupportBoxes, shots: Sequence[Shot], color: SurfaceColor, meshed: bool = False
) -> tuple[list[PictureView], dict[str, np.ndarray]]:
    """Set up views of a beam.

    Args:
        mesh: The fields of a run, or a mesh.
        support: Beam and support of the same run.
        shots: One for each view.
        color: What the beam is colored by.
        meshed: Whether the cells of the mesh are drawn.

    Returns:
        The views, and the numbers of the mesh points on each face of the supports.

    Raises:
        RenderError: No solid can be drawn off-screen here.
    """
    if support.dimension == 2:
        plane = plane_body(mesh, support)
        return [
            PlaneView(plane, support, one.window, one.size, one.scale, color, meshed) for one in shots
        ], plane.touching
    prepare_offscreen()
    # VTK reads the choice just made when it is first loaded.
    from gapbeam.postprocess.scene.beam_surface import body_of
    from gapbeam.postprocess.scene.camera_view import View

    body = body_of(mesh, support)
    return [View(body, support, *one[:3], color, one.direction, meshed) for one in shots], body.touching
