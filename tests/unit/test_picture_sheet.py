"""The sheet of a picture: its rulers can be read on beams of every length."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from gapbeam.postprocess.results.columns_of_run import supports_of
from gapbeam.postprocess.scene.motion_range import MotionRange, window_of_support, window_of_whole
from gapbeam.postprocess.scene.sheet import WHOLE, ZOOM, Sheet, pixels
from gapbeam.postprocess.scene.support_surface import support_of
from gapbeam.postprocess.scene.traces import Traces, caption_of
from tests.unit.test_postprocess_synthetic import plane_beam

SIZE = (1600, 900)


@pytest.mark.parametrize("support_share", [0.05, 0.5])
@pytest.mark.parametrize("length", [0.02, 0.09, 0.51, 2.0, 14.0])
def test_labels_of_the_rulers_are_apart(length: float, support_share: float) -> None:
    points, _ = plane_beam()
    points[:, 0] *= length / 0.51
    case = {"support": {"length": support_share * length, "clearance": 1e-4}}
    support = support_of(points, 2, supports_of({}, case))
    time, still = np.linspace(0.0, 0.1, 3), np.zeros(3)
    motion = MotionRange(time, still, 0.0, 0.0, 0.0, 1.0, 0)
    windows = (
        window_of_whole(motion, support, 10.0, pixels(WHOLE, SIZE)),
        window_of_support(support, 10.0, pixels(ZOOM, SIZE)),
    )
    faces = {"base": np.flatnonzero(points[:, 1] < -0.0059), "gland": np.flatnonzero(points[:, 1] > 0.0059)}
    traces = Traces(time, {"base": still, "gland": still}, time, still, "tip")
    caption = caption_of("A beam", (10.0, 10.0), 1e-4, None, time, 0.0)
    sheet = Sheet(SIZE, support, (points, faces, 1.0), traces, caption, windows)
    sheet.figure.canvas.draw()
    for image in (sheet._whole, sheet._near):
        boxes = [label.get_window_extent() for label in image.axes.get_xticklabels()]
        assert 1 <= len(boxes) <= 12
        assert all(left.x1 + 3.0 < right.x0 for left, right in pairwise(boxes))
