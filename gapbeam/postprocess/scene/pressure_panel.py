"""The panel of contact pressures on the support shown from near: curves along it in 2D, maps of its faces in 3D."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.tri import Triangulation

from gapbeam.postprocess.figures.figure_style import BASE_AND_GLAND, face_style
from gapbeam.postprocess.scene.support_surface import SupportBoxes
from gapbeam.postprocess.scene.surface_color import PRESSURES
from gapbeam.postprocess.scene.unrolled import unrolled

_MEGA = 1.0e-6
_BETWEEN_TICKS = -16.0  # points: the name of the angle stands beside its short label 0, between those of -180 and 180


class PressurePanel:
    """Contact pressure on the faces of a support, filled again for every frame."""

    def __init__(
        self,
        figure: Figure,
        place: tuple[float, float, float, float],
        support: SupportBoxes,
        points: np.ndarray,
        faces: dict[str, np.ndarray],
        largest: float,
        large: float = 1.0,
    ) -> None:
        """Lay out.

        Args:
            figure: The sheet.
            place: Left, bottom, width, height as fractions of the sheet.
            support: Beam and support.
            points: Of the undeformed mesh, m.
            faces: Numbers of the mesh points on each face.
            largest: End of the scale, Pa.
            large: Height of the sheet over the one it was designed for.
        """
        left, bottom, width, height = place
        self._limit, self._large = _MEGA * largest or 1.0, large
        self._numbers: dict[str, np.ndarray] = {}
        self._artists: dict[str, Any] = {}
        bar_place = (left + width + 0.008, bottom, 0.008, height)
        if support.dimension == 2:
            self._curves(figure, place, support, points, faces)
        else:
            self._maps(figure, place, support, points, faces)
        bar = figure.colorbar(ScalarMappable(Normalize(0.0, self._limit), PRESSURES), cax=figure.add_axes(bar_place))
        bar.outline.set_visible(False)  # type: ignore[operator]
        bar.ax.locator_params(nbins=5)
        if support.dimension == 2:
            bar.ax.set_yticklabels([])
            bar.ax.tick_params(length=0)

    @property
    def artists(self) -> list[Artist]:
        """Artists that change from frame to frame."""
        return list(self._artists.values())

    def fill(self, pressure: np.ndarray) -> None:
        """Show the pressures of one frame; of all points of the mesh, (n,), Pa."""
        for face, numbers in self._numbers.items():
            values = _MEGA * pressure[numbers]
            artist = self._artists[face]
            if hasattr(artist, "set_ydata"):
                artist.set_ydata(values)
            else:
                artist.set_array(values)

    def _curves(
        self, figure: Figure, place: tuple[float, float, float, float], support: SupportBoxes, points: np.ndarray,
        faces: dict[str, np.ndarray],
    ) -> None:  # fmt: skip
        panel = figure.add_axes(place)
        for face, numbers in faces.items():
            order = numbers[np.argsort(points[numbers, 0])]
            style = face_style(face, list(faces))
            x = 1e3 * points[order, 0]
            (self._artists[face],) = panel.plot(x, 0.0 * x, **{**style, "linewidth": 1.6}, label=face)
            self._numbers[face] = order
        panel.set_xlim(1e3 * support.near[0], 1e3 * support.near[1])
        panel.set_ylim(0.0, self._limit)
        panel.set_xlabel("x (mm)", labelpad=0)
        panel.set_ylabel("contact pressure (MPa)", labelpad=2.0 * self._large)
        panel.locator_params(axis="y", nbins=5)
        panel.legend(
            loc="lower right",
            bbox_to_anchor=(1.0, 0.99),
            ncols=2,
            borderaxespad=0.0,
            handlelength=1.6,
            columnspacing=1.0,
        )

    def _maps(
        self, figure: Figure, place: tuple[float, float, float, float], support: SupportBoxes, points: np.ndarray,
        faces: dict[str, np.ndarray],
    ) -> None:  # fmt: skip
        left, bottom, width, height = place
        each = 0.36 * height
        for number, face in enumerate(faces):
            low = bottom + 0.5 * height * number
            panel = figure.add_axes((left, low, width, each))
            numbers = faces[face]
            around = support.is_around(face)
            x, y = 1e3 * points[numbers, 0], 1e3 * points[numbers, 1]
            if around:
                numbers, x, y = unrolled(numbers, points)
                x = 1e3 * x
            if numbers.size:
                self._artists[face] = panel.tripcolor(
                    Triangulation(x, y),
                    np.zeros(numbers.size),
                    shading="gouraud",
                    cmap=PRESSURES,
                    vmin=0.0,
                    vmax=self._limit,
                )
                self._numbers[face] = numbers
            aside = _BETWEEN_TICKS * self._large if around else 0.0
            panel.set_ylabel(
                "angle (°)" if around else "y (mm)", labelpad=aside, fontsize="small" if around else "medium"
            )
            panel.set_yticks([-180.0, 0.0, 180.0] if around else [1e3 * support.front, 0.0, 1e3 * support.back])
            panel.set_title(
                f"pressure on the {face} (MPa)" if face in BASE_AND_GLAND else f"{face} (MPa)",
                loc="left",
                fontsize="medium",
                pad=4.0 * self._large,
            )
            panel.spines[:].set_visible(True)
            if number == 0:
                panel.set_xlabel("x (mm)", labelpad=0)
            else:
                panel.tick_params(labelbottom=False)
