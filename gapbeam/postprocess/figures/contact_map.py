"""Figure of contact along a support: share of time in contact, impulse per area, largest penetration.

Faces around the beam are unrolled: x along the beam, the angle from straight down around it. Planes have curves over x.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from gapbeam.postprocess.figures.figure_style import DOUBLE, GRAY, face_style, letter, panels
from gapbeam.postprocess.results.columns_of_run import PointMap

_HEIGHT = 2.3  # inches of a row
_DIGITS = 9  # of places that count as one
_ROUNDED = 6  # digits of angles that do
_WIDEST = 45.0  # degrees between neighbors: walls farther apart have a mark each, no cells
_DEPTH = 2  # the number of the panel of penetrations
_ANGLES = (-180.0, -90.0, 0.0, 90.0, 180.0)


class _Quantity(NamedTuple):
    """Quantity of a panel: its label, and its values at the points, never negative."""

    label: str
    values: np.ndarray


def draw_contact_map(points: Mapping[str, PointMap]) -> Figure:
    """Draw a row of three panels for each face around the beam, and one for all planes together.

    Args:
        points: Points of the faces of one support, by name, at least one; see
            `gapbeam.postprocess.results.columns_of_run.points_of`.
    """
    around = {face: one for face, one in points.items() if one.around}
    planes = {face: one for face, one in points.items() if not one.around}
    figure, grid = panels(len(around) + bool(planes), 3, width=DOUBLE, height=_HEIGHT)
    for row, (face, one) in zip(grid, around.items(), strict=False):
        for panel, quantity in zip(row, _quantities(one), strict=True):
            _draw_around(figure, panel, one, quantity)
        row[0].set_ylabel("angle from straight down (°)")
        row[0].set_title(face)
    if planes:
        for number, panel in enumerate(grid[-1]):
            _draw_planes(panel, planes, number)
        grid[-1][0].legend()
    letter([panel for row in grid for panel in row])
    return figure


def _quantities(one: PointMap) -> tuple[_Quantity, ...]:
    return (
        _Quantity("contact share (%)", 100.0 * one.share),
        _Quantity("impulse per area (N s/m$^2$)", one.pressed),
        _Quantity("largest penetration (µm)", 1.0e6 * np.maximum(one.deepest, 0.0)),
    )


def _draw_around(figure: Figure, panel: Axes, one: PointMap, quantity: _Quantity) -> None:
    values = quantity.values
    known = values[np.isfinite(values)]
    largest = float(known.max(initial=0.0)) or 1.0
    colors, scale = "viridis", Normalize(0.0, largest)
    cells = _cells(one, values)
    if cells is None:
        panel.scatter(1.0e3 * one.x, one.angle, c=values, s=9.0, marker="s", cmap=colors, norm=scale)
        panel.margins(x=0.1)
    else:
        panel.pcolormesh(*cells, cmap=colors, norm=scale)
    panel.set_ylim(-180.0, 180.0)
    panel.set_yticks(_ANGLES)
    panel.set_xlabel("x (mm)")
    if not known.size:
        panel.text(0.5, 0.5, "not known", transform=panel.transAxes, ha="center", va="center", color=GRAY)
    figure.colorbar(ScalarMappable(scale, colors), ax=panel, label=quantity.label, location="top")


def _cells(one: PointMap, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """Return edges along x, mm, and around, degrees, and the values between; None: the points fill no grid.

    The first row around is drawn again behind the last one, and the last one before the first, which closes the circle.
    """
    x, columns = np.unique(np.round(one.x, _DIGITS), return_inverse=True)
    angles, rows = np.unique(np.round(one.angle, _ROUNDED), return_inverse=True)
    turns = np.concatenate([angles[-1:] - 360.0, angles, angles[:1] + 360.0])
    grid = np.full((len(angles), len(x)), np.nan)
    grid[rows, columns] = values
    whole = len(values) == grid.size == len(np.unique(rows * len(x) + columns))
    if not whole or np.diff(turns).max() > _WIDEST:
        return None
    around = np.concatenate([turns[:1], _between(turns), turns[-1:]])
    half = 0.5 * float(np.sqrt(one.area.mean()))  # a face whose points all have one place is drawn as a row of squares
    ends = np.array([x[0] - half, x[0] + half]) if len(x) == 1 else 1.5 * x[[0, -1]] - 0.5 * x[[1, -2]]
    along = np.concatenate([ends[:1], _between(x), ends[1:]])
    return 1.0e3 * along, around, np.concatenate([grid[-1:], grid, grid[:1]])


def _between(places: np.ndarray) -> np.ndarray:
    return np.asarray(0.5 * (places[1:] + places[:-1]))


def _draw_planes(panel: Axes, planes: Mapping[str, PointMap], number: int) -> None:
    """Draw curves over x: means over the width by area, of penetrations the largest."""
    for face, one in planes.items():
        label, values = _quantities(one)[number]
        x, owners = np.unique(np.round(one.x, _DIGITS), return_inverse=True)
        across = np.bincount(owners, values * one.area) / np.bincount(owners, one.area)
        if number == _DEPTH:
            across = np.array([values[owners == place].max() for place in range(len(x))])
        panel.plot(1.0e3 * x, across, marker=".", markersize=3.0, label=face, **face_style(face, list(planes)))
        panel.set_ylabel(label)
    panel.set_xlabel("x (mm)")
    panel.set_ylim(bottom=0.0)
    panel.margins(x=0.02)
