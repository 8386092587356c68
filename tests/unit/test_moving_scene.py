"""The moving scene of reports: its fields, its magnification, and motions known in closed form taken back from it."""

from __future__ import annotations

import base64
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from gapbeam.postprocess.report.charts import packed, packed_shorts
from gapbeam.postprocess.report.moving_scene import SceneBeam, scene_values
from gapbeam.postprocess.report.sections.run_section import _body_orbits
from gapbeam.postprocess.report.sections.scene_section import MOST, frames_shown, magnification_of, scene_of
from gapbeam.postprocess.report.station_motion import beam_of, stations_of
from gapbeam.postprocess.results.field_reader import Frame
from gapbeam.postprocess.results.results import open_results
from gapbeam.postprocess.results_errors import BlockError
from tests.regression.test_postprocess_plot import sine_records
from tests.unit.test_postprocess_synthetic import write_fields, write_results

LENGTH, RADIUS = 1.2, 0.01


def tube(stations: int = 31) -> np.ndarray:
    """Return the points of a tube: rings of twelve points at equal distances."""
    x, angle = np.linspace(0.0, LENGTH, stations), np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    ring = RADIUS * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return np.column_stack([np.repeat(x, 12), np.tile(ring, (stations, 1))])


def moved(points: np.ndarray, lateral: float, vertical: float, twist: float) -> Frame:
    """Return a parabola in both directions with a twist that grows along the beam, and a slide of 2 mm."""
    share = points[:, 0] / LENGTH
    turn = twist * share
    displacement = np.column_stack([
        np.full(len(points), 2e-3), lateral * share**2 - turn * points[:, 2], vertical * share**2 + turn * points[:, 1],
    ])  # fmt: skip
    return Frame(0.0, displacement, 0.0 * displacement, np.zeros(len(points)))


def test_rigid_sections_are_taken_back() -> None:
    """Displacement, twist and slide of sections that stay flat come back to round-off, with the round outline."""
    points = tube()
    frames = [moved(points, 1e-3, -3e-3, 0.2), moved(points, -2e-3, 1e-3, 0.0)]
    beam = beam_of(stations_of(points, 3), frames, 3, 2 * RADIUS)
    share = beam.stations / LENGTH
    assert beam.lateral == pytest.approx(np.outer([1e-3, -2e-3], share**2), abs=1e-12)
    assert beam.vertical == pytest.approx(np.outer([-3e-3, 1e-3], share**2), abs=1e-12)
    assert beam.twist == pytest.approx(np.outer([0.2, 0.0], share), abs=1e-9)
    assert beam.slide == pytest.approx([2e-3, 2e-3])
    assert np.hypot(*beam.outline.T) == pytest.approx(1.0, abs=1e-9)
    assert len(beam.outline) == 48
    assert beam.thickness == pytest.approx(2 * RADIUS)


def test_mesh_without_planes_is_gathered_in_bins() -> None:
    """A cloud of points has few stations, the first and the last at its ends; its mean motion is that of its points."""
    random = np.random.default_rng(3)
    points = np.column_stack([random.uniform(0.0, LENGTH, 4000), random.uniform(-RADIUS, RADIUS, (4000, 2))])
    stations = stations_of(points, 3)
    assert not stations.regular
    assert len(stations.places) <= 80
    beam = beam_of(stations, [moved(points, 0.0, -3e-3, 0.0)], 3, 2 * RADIUS)
    inner = slice(1, -1)
    assert beam.vertical[0, inner] == pytest.approx(-3e-3 * (beam.stations[inner] / LENGTH) ** 2, abs=3e-5)
    assert beam.stations[[0, -1]] == pytest.approx([points[:, 0].min(), points[:, 0].max()])


def test_frames_are_few_and_follow_the_forcing() -> None:
    """All of few; every second of many; the last ones where every second would be too few for the forcing."""
    assert frames_shown(100, 1000, 1e-3, 20.0) == list(range(100))
    assert frames_shown(MOST + 1, 1000, 1e-3, 20.0) == list(range(MOST + 1))
    assert frames_shown(800, 1000, 1e-3, None) == list(range(0, 800, 2))
    assert frames_shown(801, 1000, 5e-3, 20.0) == list(range(800 - MOST, 801))
    assert len(frames_shown(800, 10_000_000, 1e-3, None)) <= 25


def test_magnification_is_round_and_shows_gaps() -> None:
    """A motion of 1 % of the thickness is drawn 50 times; gaps raise the factor as far as the length allows."""
    points = tube()
    beam = beam_of(stations_of(points, 3), [moved(points, 0.0, 0.02 * RADIUS, 0.0)], 3, 2 * RADIUS)
    assert magnification_of(beam) == 50.0
    assert magnification_of(beam, [1e-5]) == 500.0
    still = beam_of(stations_of(points, 3), [moved(points, 0.0, 0.0, 0.0)], 3, 2 * RADIUS)
    assert magnification_of(still) == 1.0


def test_packed_numbers_come_back() -> None:
    """32 bits as they are; 16 bits to 1/32767 of the largest."""
    values = np.array([[1.0, -2.5], [0.0, 1e-3]])
    assert np.frombuffer(base64.b64decode(packed(values)["bdata"]), "<f4") == pytest.approx(values.ravel())
    short = packed_shorts(values)
    back = np.frombuffer(base64.b64decode(str(short["bdata"])), "<i2") * float(short["unit"])
    assert back == pytest.approx(values.ravel(), abs=2.5 / 32767)


def test_shapes_that_differ_are_refused() -> None:
    """A motion of other stations than the beam has is named."""
    zeros = np.zeros((2, 3))
    with pytest.raises(BlockError, match=r"vertical of shape \(1, 3\); expected \(2, 3\)"):
        SceneBeam(np.arange(3.0), zeros, zeros, zeros, zeros, zeros[:1], zeros, np.zeros(2), False)


def planar_run(folder: Path) -> Path:
    """Write a run of a slice with fields: a parabola that swings by 2 mm at 20 Hz."""
    time = np.linspace(0.0, 0.5, 501)
    write_results(folder, time, sine_records(time))
    x = np.linspace(0.0, 0.51, 18)
    points = np.array([(a, b, 0.0) for a in x for b in (-0.006, 0.006)])
    cells = np.array([(2 * k, 2 * k + 2, 2 * k + 3, 2 * k + 1) for k in range(len(x) - 1)])
    frames = []
    for moment in time[::10]:
        rise = 2e-3 * np.sin(2 * np.pi * 20.0 * moment) * (points[:, 0] / 0.51) ** 2
        frames.append((moment, np.column_stack([0 * rise, rise, 0 * rise]), np.zeros(len(points))))
    write_fields(folder, points, cells, "Quadrilateral", frames)
    return folder


def test_scene_of_a_run_has_its_supports_and_forces(tmp_path: Path) -> None:
    """A slice is as wide as the case says; faces have their gaps and the recorded force at the times of the fields."""
    scene = scene_of(open_results(planar_run(tmp_path / "run")), "c")
    assert scene is not None
    assert scene.beam.planar
    assert scene.beam.half[0] == pytest.approx((0.01, 0.006))
    assert [(wall.met.face, wall.met.gap) for wall in scene.walls] == [("base", 0.0), ("gland", 1.07e-4)]
    assert scene.walls[0].along == pytest.approx((0.0, 0.05))
    assert scene.walls[0].force.shape == scene.times.shape == (51,)
    values = scene_values(scene)
    assert sorted(values["motion"]) == ["z"]  # type: ignore[call-overload]
    assert scene_of(open_results(write_results(tmp_path / "bare", np.linspace(0.0, 0.5, 51))), "c") is None


def test_supports_that_give_way_have_orbits() -> None:
    """A support that goes round has its circle with its times; one that stands still has none."""
    time = np.linspace(0.0, 1.0, 101)
    moved = np.zeros((101, 2, 2))
    moved[:, 0] = 1e-3 * np.stack([np.cos(time), np.sin(time)], axis=1)
    history = xr.Dataset(
        {"support_displacement": (("time", "support_body", "support_axis"), moved)},
        {"time": time, "support_body": ["ring", "block"], "support_axis": ["y", "z"]},
    )
    (orbit,) = _body_orbits(history, 1e3, slice(None, None, 10))
    assert orbit.choice == "support ring"
    assert np.hypot(orbit.x, orbit.y) == pytest.approx(1.0)
    assert orbit.times == pytest.approx(time[::10])
