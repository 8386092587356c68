"""The rigid motion of a cross-section from the displacements of its points, and windows that show what beams carry."""

from __future__ import annotations

import numpy as np
import pytest

from gapbeam.postprocess.results.columns_of_run import supports_of
from gapbeam.postprocess.scene.motion_range import MotionRange, carrying_section, window_of_whole
from gapbeam.postprocess.scene.support_surface import carried_by, marks_of, placed, support_of


def test_a_rigid_motion_is_found_and_carries_places_beside_the_section() -> None:
    """Points of a solid that moves by a + w x X: every place does, whatever section it hangs on."""
    x, y, z = np.meshgrid(np.linspace(0.0, 0.5, 6), [-0.01, 0.01], [-0.02, 0.0, 0.02], indexing="ij")
    points = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    shift, turn = np.array([1e-3, -2e-3, 3e-3]), np.array([0.01, -0.02, 0.03])
    displacement = shift + np.cross(turn, points)
    section = carrying_section(points, 0.31)
    assert np.unique(points[section.points, 0]) == pytest.approx([0.3])
    place = np.array([0.6, 0.1, -0.2])
    assert section.of(displacement, place) == pytest.approx(shift + np.cross(turn, place), abs=1e-15)


def test_a_line_of_points_shows_its_turn_in_the_plane_alone() -> None:
    """The section of a slice is a line: it turns in the plane, and nothing is made up of other turns."""
    points = np.array([[x, z, 0.0] for x in (0.0, 0.1, 0.2) for z in (-0.01, 0.0, 0.01)])
    turn = np.array([0.0, 0.0, 0.02])
    section = carrying_section(points, 0.2)
    moved = section.of(np.cross(turn, points), np.array([0.25, 0.1, 0.0]))
    assert moved == pytest.approx(np.cross(turn, [0.25, 0.1, 0.0]), abs=1e-15)


def test_masses_beside_the_beam_are_in_the_picture() -> None:
    """A mass on an arm ahead of the beam and above it widens the window, and has its name above it."""
    points = np.array([[0.0, -0.01, 0.0], [0.5, 0.01, 0.0]])
    support = support_of(points, 2, supports_of({}, {"support": {"length": 0.05, "clearance": 1e-4}}))
    case = {"mass": [{"name": "head", "point": 0.5, "mass": 1.0, "offset": [0.1, 0.3]}]}
    marks = list(marks_of(case, 0.0))
    still = MotionRange(np.zeros(1), np.zeros(1), 0.0, 0.0, 0.0, 0.0, 0)
    alone = window_of_whole(still, support, 1.0, (1500, 300))
    both = window_of_whole(still, support, 1.0, (1500, 300), carried_by(marks, support.middle))
    assert alone.x[1] < 0.6 < both.x[1]
    assert alone.height[1] < 0.3 < both.height[1]
    [head] = placed(marks, support, both.height, lambda places: places[:, :2])
    assert head.above == pytest.approx([0.6, 0.3])
    [moved] = placed(marks, support, both.height, lambda places: places[:, :2], lambda _mark, places: places + 0.1)
    assert moved.root is not None
    assert np.stack([moved.at, moved.root]) == pytest.approx(np.array([[0.7, 0.4], [0.6, 0.1]]))
