"""Color of the beam's surface: contact pressure on the faces of supports, or a stress all over it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.colors import Colormap, LinearSegmentedColormap
from matplotlib.path import Path
from matplotlib.transforms import IdentityTransform, TransformedPath

from gapbeam.postprocess.display_units import shown_by
from gapbeam.postprocess.results.field_reader import Frame
from gapbeam.solver.schema.record_table import STRESS_FIELDS

BEAM = "#C9D3DC"
BELOW = "#808080"
ABOVE = "#9C9C9C"
EDGE = "#2B2B2B"
REST = "#9A9A9A"
CELLS = "#7B8794"
# From the color of the beam through orange to dark red: darker means more, also in print without color.
PRESSURES = LinearSegmentedColormap.from_list("pressure", [BEAM, "#F2C94C", "#E8702A", "#B0200C", "#4A0508"])
_BOTH_SIGNS = LinearSegmentedColormap.from_list(
    "stress", ["#08204A", "#1F5FA8", "#7FB2DE", BEAM, "#F2B46A", "#C8401C", "#4A0508"]
)
STRESSES = {"axial": "axial_stress", "von-mises": "von_mises_stress"}
"""Fields of stress by the words for them in commands."""


@dataclass(frozen=True)
class SurfaceColor:
    """Colors of a field.

    Attributes:
        field: Its name.
        colors: Colors from the lowest to the highest value.
        limits: Lowest and highest value, Pa.
        everywhere: Whether all of the surface has them, or the faces of supports alone.
    """

    field: str
    colors: Colormap
    limits: tuple[float, float]
    everywhere: bool

    @classmethod
    def of_pressure(cls, largest: float) -> SurfaceColor:
        """Return the colors of contact pressure, from 0 to the largest, Pa."""
        return cls("contact_pressure", PRESSURES, (0.0, largest or 1.0), everywhere=False)

    @classmethod
    def of_stress(cls, field: str, largest: Mapping[str, float]) -> SurfaceColor:
        """Return the colors of a stress: of both signs from minus the largest size to that, else from 0.

        Args:
            field: Its name.
            largest: Size of each stress in all frames, by name, Pa.
        """
        most = largest[field] or 1.0
        if field == "axial_stress":
            return cls(field, _BOTH_SIGNS, (-most, most), everywhere=True)
        return cls(field, PRESSURES, (0.0, most), everywhere=True)

    @property
    def label(self) -> str:
        """Name and unit beside a scale."""
        name = self.field.replace("_", " ").replace("von mises", "von Mises")
        return f"{name} ({self._shown[0]})"

    @property
    def shown_limits(self) -> tuple[float, float]:
        """The limits in the unit of the label."""
        factor = self._shown[1]
        return factor * self.limits[0], factor * self.limits[1]

    @property
    def _shown(self) -> tuple[str, float]:
        return shown_by(STRESS_FIELDS[self.field], self.limits)

    def values(self, frame: Frame) -> np.ndarray:
        """Return the field in a frame, (n,), Pa."""
        return frame.stress[self.field] if self.everywhere else frame.contact_pressure


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
            renderer: Renderer of Agg. It takes an outline for its last one if both are at the same place in memory.
            outline: Outline of the beam, pixels.
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
