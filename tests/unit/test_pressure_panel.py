"""The map of pressures around a hole: its labels are whole, between the picture beside it and its own axis."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from gapbeam.postprocess.results.columns_of_run import RunFace, RunSupport, supports_of
from gapbeam.postprocess.scene.sheet import _PRESSURE, DESIGNED_FOR, DPI, ZOOM, PressurePanel, style_of
from gapbeam.postprocess.scene.support_surface import support_of
from tests.unit.test_moving_scene import RADIUS, tube
from tests.unit.test_postprocess_synthetic import plane_beam


@pytest.mark.parametrize("size", [(6.4, 3.6), (9.6, 5.4), (16.0, 9.0), (19.2, 10.8)])
def test_name_of_the_angle_is_not_clipped(size: tuple[float, float]) -> None:
    """It begins right of the picture of the support, and neither it nor the labels of the ticks hide each other."""
    points = tube()
    face = RunFace("hole", False, 1e-4, True)
    support = support_of(points, 3, [RunSupport("baffle", 0.4, 0.6, 1e-4, (face,))])
    touching = np.flatnonzero((points[:, 0] >= 0.4) & (points[:, 0] <= 0.6))
    large = size[1] * DPI / DESIGNED_FOR
    with rc_context(style_of(large)):
        figure = Figure(figsize=size, dpi=DPI)
        canvas = FigureCanvasAgg(figure)
        PressurePanel(figure, _PRESSURE, support, points, {"hole": touching}, 1e6, large)
        canvas.draw()
        panel = next(axes for axes in figure.axes if axes.get_ylabel() == "angle (°)")
        name = panel.yaxis.label.get_window_extent()
        assert name.x0 > (ZOOM[0] + ZOOM[2]) * size[0] * DPI
        labels = [tick.label1.get_window_extent() for tick in panel.yaxis.get_major_ticks()]
    assert not any(name.overlaps(label) for label in labels)
    assert float(np.ptp(points[:, 1])) == pytest.approx(2 * RADIUS)


@pytest.mark.parametrize("largest", [0.04e6, 120e6, 3000e6])
@pytest.mark.parametrize("size", [(6.4, 3.6), (9.6, 5.4), (16.0, 9.0), (19.2, 10.8)])
def test_name_of_the_pressure_is_not_clipped(size: tuple[float, float], largest: float) -> None:
    """In 2D it begins right of the picture of the support, however long the labels of the ticks are."""
    points, _ = plane_beam()
    support = support_of(points, 2, supports_of({}, {"support": {"length": 0.05, "clearance": 1e-4}}))
    faces = {"base": np.flatnonzero(points[:, 1] < -0.0059)}
    large = size[1] * DPI / DESIGNED_FOR
    with rc_context(style_of(large)):
        figure = Figure(figsize=size, dpi=DPI)
        canvas = FigureCanvasAgg(figure)
        PressurePanel(figure, _PRESSURE, support, points, faces, largest, large)
        canvas.draw()
        panel = next(axes for axes in figure.axes if axes.get_ylabel() == "contact pressure (MPa)")
        name = panel.yaxis.label.get_window_extent()
    assert name.x0 > (ZOOM[0] + ZOOM[2]) * size[0] * DPI
    assert name.y0 > 0.0
    assert name.y1 < size[1] * DPI
