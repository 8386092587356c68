"""The scene of a run without fields: the beam of its case, as its mesh would have shown it, in its supports."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gapbeam.postprocess.report.sections.scene_section import resting_beam, scene_of, still_scene_of
from gapbeam.postprocess.results.results import open_results
from tests.regression.test_postprocess_plot import sine_records
from tests.unit.test_moving_scene import planar_run
from tests.unit.test_postprocess_synthetic import write_results

TUBE: dict[str, Any] = {"length": 1.0, "thickness": 0.02, "width": 0.02, "section": {"type": "tube", "wall": 2e-3}}


def test_it_is_what_the_fields_would_show(tmp_path: Path) -> None:
    """Size of the beam, and the walls with their gaps, are those of the scene of a run with fields, which moves."""
    time = np.linspace(0.0, 0.5, 501)
    still = still_scene_of(open_results(write_results(tmp_path / "bare", time, sine_records(time))), "c")
    moving = scene_of(open_results(planar_run(tmp_path / "run")), "c")
    assert still is not None
    assert moving is not None
    assert (still.moves, moving.moves) == (False, True)
    assert still.beam.stations[[0, -1]] == pytest.approx(moving.beam.stations[[0, -1]])
    assert still.beam.half[0] == pytest.approx(moving.beam.half[0])
    assert still.beam.middle[0] == pytest.approx(moving.beam.middle[0])
    for one, other in zip(still.walls, moving.walls, strict=True):
        assert (one.met, one.along, one.bottom, one.top) == (other.met, other.along, other.bottom, other.top)
        assert one.force.size == 0
    assert still.magnification * 1.07e-4 == pytest.approx(0.25 * 0.012, rel=0.6)


def test_sections_and_segments_are_drawn_as_they_are() -> None:
    """A tube is round, and thinner where a segment says so; a triangle has three corners."""
    stepped = resting_beam({"beam": TUBE, "segment": [{"from": 0.2, "to": 0.5, "thickness": 0.01, "width": 0.01}]})
    assert stepped is not None
    assert stepped.stations == pytest.approx([0.0, 0.2, 0.2, 0.5, 0.5, 1.0])
    assert stepped.half[:, 1] == pytest.approx([0.01, 0.01, 0.005, 0.005, 0.01, 0.01])
    assert np.hypot(*stepped.outline.T) == pytest.approx(1.0)
    corners = [[0.0, 0.0], [0.02, 0.0], [0.01, 0.02]]
    triangle = resting_beam({"beam": TUBE | {"section": {"type": "polygon", "points": corners}}})
    assert triangle is not None
    assert sorted(map(tuple, triangle.outline.tolist())) == [(-1.0, -1.0), (0.0, 1.0), (1.0, -1.0)]


@pytest.mark.parametrize("case", [{}, {"beam": {"length": 1.0}}, {"beam": {"length": "long", "thickness": 1.0}}])
def test_a_case_without_a_beam_has_none(case: dict[str, Any]) -> None:
    assert resting_beam(case) is None
