"""Figure: where the faces of the supports wear, along the beam and around it."""

from __future__ import annotations

from collections.abc import Mapping

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gapbeam.postprocess.figures.figure_style import DOUBLE, face_style, letter, panels
from gapbeam.postprocess.results.wear_of_run import WearMap

_COLUMNS = 3
_HEIGHT = 2.4  # inches of a row


def draw_wear(maps: Mapping[str, WearMap]) -> Figure:
    """Draw the work rate per area: of planes over x together, of each face around the beam over x and angle.

    Args:
        maps: At least one, by face; see `gapbeam.postprocess.results.wear_of_run.wear_of`.
    """
    planes = {face: one for face, one in maps.items() if not one.around}
    around = {face: one for face, one in maps.items() if one.around}
    count = len(around) + bool(planes)
    columns = min(count, _COLUMNS)
    rows = -(-count // columns)
    figure, grid = panels(rows, columns, width=DOUBLE, height=_HEIGHT)
    cells = [cell for row in grid for cell in row]
    if planes:
        _draw_planes(cells[0], planes)
    for cell, (face, one) in zip(cells[bool(planes) :], around.items(), strict=False):
        _draw_around(figure, cell, face, one)
    for cell in cells[count:]:
        cell.set_axis_off()
    letter(cells[:count])
    return figure


def _draw_planes(panel: Axes, planes: Mapping[str, WearMap]) -> None:
    for face, one in planes.items():
        x, density = one.along()
        panel.plot(1.0e3 * x, density, marker=".", markersize=3.0, label=face, **face_style(face, list(planes)))
    panel.set_xlabel("x (mm)")
    panel.set_ylabel("work rate per area (W/m$^2$)")
    panel.set_ylim(bottom=0.0)
    panel.margins(x=0.02)
    panel.legend()


def _draw_around(figure: Figure, panel: Axes, face: str, one: WearMap) -> None:
    drawn = panel.scatter(1.0e3 * one.x, one.angle, c=one.density, s=9.0, marker="s", cmap="viridis", vmin=0.0)
    panel.set_title(face)
    panel.set_xlabel("x (mm)")
    panel.set_ylabel("angle from straight down (deg)")
    panel.set_yticks([-180.0, -90.0, 0.0, 90.0, 180.0])
    panel.margins(x=0.1)
    figure.colorbar(drawn, ax=panel, label="work rate per area (W/m$^2$)")
