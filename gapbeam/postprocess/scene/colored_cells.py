"""Cells of a plane colored by a field between their corners."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.path import Path
from matplotlib.transforms import IdentityTransform, TransformedPath

from gapbeam.postprocess.scene.surface_color import SurfaceColor

_PARTS = 4  # of each side of a cell: colors are blended between parts, and a scale does not go straight through colors


class ColoredCells:
    """The cells of a beam as small triangles."""

    def __init__(self, cells: tuple[np.ndarray, ...], color: SurfaceColor) -> None:
        """Cut the cells.

        Args:
            cells: Their corners, (cells, 3 or 4) for each type of cell.
            color: The scale.
        """
        self._color = color
        self._corners = np.vstack([one[:, [0, 1, 2, -1]] for one in cells])  # a triangle: a side of no length
        s, t = (one.ravel() for one in np.meshgrid(*2 * [np.linspace(0.0, 1.0, _PARTS + 1)], indexing="ij"))
        self._weights = np.stack([(1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t], axis=1)
        first = (np.arange(_PARTS)[:, None] * (_PARTS + 1) + np.arange(_PARTS)).ravel()
        right, up = first + _PARTS + 1, first + 1
        self._triangles = np.vstack([np.stack([first, right, right + 1]).T, np.stack([first, right + 1, up]).T])

    def draw(self, renderer: Any, outline: Path, corners: np.ndarray, values: np.ndarray) -> None:
        """Draw them within an outline, whose edge is smooth.

        Args:
            renderer: Of Agg. It takes an outline for its last one if both are at the same place in memory.
            outline: Of the beam, pixels.
            corners: All points of the mesh, (n, 2), pixels.
            values: The field there, (n,).
        """
        low, high = self._color.limits
        places = np.einsum("pc,kcd->kpd", self._weights, corners[self._corners])[:, self._triangles]
        shares = (values[self._corners] @ self._weights.T - low) / (high - low)
        colors = self._color.colors(shares)[:, self._triangles]
        context = renderer.new_gc()
        context.set_clip_path(TransformedPath(outline, IdentityTransform()))
        renderer.draw_gouraud_triangles(
            context, places.reshape(-1, 3, 2), colors.reshape(-1, 3, 4), IdentityTransform()
        )
        context.restore()
