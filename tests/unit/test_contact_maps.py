"""Contact pressures of a scene: the points of faces, and pressures known in closed form taken back from the fields."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from meshio import CellBlock

from gapbeam.postprocess.report.moving_scene import SceneWall, scene_values
from gapbeam.postprocess.report.sections.scene_section import scene_of
from gapbeam.postprocess.report.station_motion import contact_maps_of, face_points, within_room
from gapbeam.postprocess.results.columns_of_run import RunFace
from gapbeam.postprocess.results.field_reader import Frame
from gapbeam.postprocess.results.results import open_results
from gapbeam.solver.schema.record_table import SUMMARY_FILE
from tests.regression.test_postprocess_plot import sine_records
from tests.unit.test_moving_scene import planar_run
from tests.unit.test_postprocess_synthetic import write_fields, write_results

RADIUS, AROUND = 0.01, 24
STATIONS = np.linspace(0.0, 1.2, 9)
COLLAR, STOP = (0.45, 0.75), (0.9, 1.2)
PERIOD = 0.4  # s, in which the pressure goes around


def annulus() -> tuple[np.ndarray, np.ndarray]:
    """Return points and hexahedra of a tube of one layer, whose points at the lowest line come first."""
    turns = 2.0 * np.pi * np.arange(AROUND) / AROUND
    rings = [radius * np.stack([np.sin(turns), -np.cos(turns)], axis=1) for radius in (0.8 * RADIUS, RADIUS)]
    points = np.array([(x, *place) for x in STATIONS for ring in rings for place in ring])
    cells = []
    for k in range(len(STATIONS) - 1):
        for n in range(AROUND):
            base, next_ = 2 * AROUND * k, (n + 1) % AROUND
            face = [base + n, base + next_, base + AROUND + next_, base + AROUND + n]
            cells.append([*face, *(number + 2 * AROUND for number in face)])
    return points, np.array(cells)


def collar_pressure(x: np.ndarray, angle: np.ndarray, time: float) -> np.ndarray:
    """Return a pressure that goes around the collar and grows along it, Pa; angles in degrees."""
    return 4e6 * (x - 0.3) * np.maximum(0.0, np.cos(np.radians(angle - 360.0 * time / PERIOD))) ** 3


def stop_pressure(x: np.ndarray, time: float) -> np.ndarray:
    """Return a pressure on the stop that comes and goes, Pa."""
    return 1e6 * x * max(0.0, np.sin(2.0 * np.pi * time / PERIOD))


def pressure_at(points: np.ndarray, time: float) -> np.ndarray:
    """Return both pressures at the points of the mesh."""
    x, y, z = points.T
    angle, outside = np.degrees(np.arctan2(y, -z)), np.hypot(y, z) > 0.99 * RADIUS
    on_collar = outside & (x > COLLAR[0] - 1e-9) & (x < COLLAR[1] + 1e-9)
    on_stop = outside & (x > STOP[0] - 1e-9) & (np.abs(angle) < 1.0)
    return np.where(on_collar, collar_pressure(x, angle, time), np.where(on_stop, stop_pressure(x, time), 0.0))


def pressed_run(folder: Path) -> Path:
    """Write a run of a tube in a collar and over a stop with fields every 10 ms, and a cover that is never pressed."""
    time = np.linspace(0.0, 0.5, 501)
    write_results(folder, time, sine_records(time), dimension=3)
    points, cells = annulus()
    frames = [(moment, np.zeros_like(points), pressure_at(points, moment)) for moment in time[::10]]
    write_fields(folder, points, cells, "Hexahedron", frames)
    summary = json.loads((folder / SUMMARY_FILE).read_text(encoding="utf-8"))
    faces = [{"name": "stop_below", "side": "below", "gap": 0.0}, {"name": "stop_above", "side": "above", "gap": 1e-3}]
    summary["model"] = {"supports": [
        {"name": "collar", "from": COLLAR[0], "to": COLLAR[1], "clearance": 1e-4,
         "faces": [{"name": "collar_hole", "side": "around", "gap": 1e-4}]},
        {"name": "stop", "from": STOP[0], "to": STOP[1], "clearance": 1e-3, "faces": faces},
    ]}  # fmt: skip
    (folder / SUMMARY_FILE).write_text(json.dumps(summary), encoding="utf-8")
    return folder


def walls() -> list[SceneWall]:
    """Return a collar, a stop below and a cover above."""
    hole = RunFace("hole", False, 1e-4, around=True)
    parts = ((hole, COLLAR), (RunFace("below", True, 0.0), STOP), (RunFace("above", False, 0.0), STOP))
    return [SceneWall(met, met.face, along, -RADIUS, RADIUS) for met, along in parts]


@pytest.mark.parametrize("shape", ["hexahedron", "tetra"])
def test_faces_are_the_outer_points_beside_their_walls(shape: str) -> None:
    """A hole has all points of the outer radius, planes those of its lower and upper half; the bore has none."""
    points, cells = annulus()
    if shape == "tetra":  # six around the diagonal of each
        paths = [(1, 2), (2, 3), (3, 7), (7, 4), (4, 5), (5, 1)]
        cells = np.concatenate([cells[:, [0, 6, *path]] for path in paths])
    found = face_points(points, [CellBlock(shape, cells)], 3, walls())
    outside = np.hypot(points[:, 1], points[:, 2]) > 0.99 * RADIUS
    collar, stop = ((points[:, 0] > low - 1e-9) & (points[:, 0] < high + 1e-9) for low, high in (COLLAR, STOP))
    assert np.array_equal(found[0], np.flatnonzero(outside & collar))
    low, high = points[:, 2] < 1e-9, points[:, 2] > -1e-9
    assert np.array_equal(found[1], np.flatnonzero(outside & stop & low))
    assert np.array_equal(found[2], np.flatnonzero(outside & stop & high))


def test_pressures_are_those_of_the_fields(tmp_path: Path) -> None:
    """Over x and angle on the collar, the top at both ends; over x on the stop; triangles fill the whole map."""
    scene = scene_of(open_results(pressed_run(tmp_path / "run")), "c")
    assert scene is not None
    collar, stop = scene.maps
    assert [collar.support, stop.support, collar.around, stop.around] == ["collar", "stop", True, False]
    (hole,), (below, above) = collar.faces, stop.faces
    for k, time in enumerate(scene.times):
        assert hole.pressures[k] == pytest.approx(collar_pressure(hole.x, hole.angles, time), abs=1e-3)
        assert below.pressures[k] == pytest.approx(stop_pressure(below.x, time), abs=1e-3)
    assert not above.pressures.any()
    assert below.x == pytest.approx(STATIONS[6:])
    assert np.ptp(hole.angles) == pytest.approx(360.0)
    corners = np.stack([hole.x, hole.angles], axis=1)[hole.triangles]
    sides = corners[:, 1:] - corners[:, :1]
    areas = 0.5 * np.abs(sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0])
    assert areas.sum() == pytest.approx(360.0 * (COLLAR[1] - COLLAR[0]))
    assert "over x and the angle around the beam" in scene.caption


def test_runs_without_pressures_have_no_maps(tmp_path: Path) -> None:
    """Fields without contact pressure have none, and the caption does not speak of them."""
    scene = scene_of(open_results(planar_run(tmp_path / "run")), "c")
    assert scene is not None
    assert scene.maps == []
    assert scene_values(scene)["maps"] == []
    assert "pressure" not in scene.caption


def test_scattered_points_are_gathered_in_bins() -> None:
    """Where every point has a place of its own, the curve has the largest pressure of each bin."""
    points, cells = annulus()
    random = np.random.default_rng(2)
    inner = (points[:, 0] > 0.01) & (points[:, 0] < 1.19) & (np.abs(points[:, 0] - STOP[0]) > 0.01)
    points[inner, 0] += random.uniform(-0.03, 0.03, inner.sum())
    pressure = np.where(points[:, 2] < -0.99 * RADIUS, 1e6, 0.0)
    frame = Frame(0.0, 0.0 * points, 0.0 * points, pressure)
    (one,) = contact_maps_of(points, [CellBlock("hexahedron", cells)], 3, walls()[1:2], [frame])
    assert 3 <= len(one.faces[0].x) <= 9
    assert np.all(np.diff(one.faces[0].x) > 0.0)
    assert one.largest == 1e6


def test_the_largest_pressures_have_room_first(tmp_path: Path) -> None:
    """Where there is no room for all, the largest stay, and the others are named."""
    scene = scene_of(open_results(pressed_run(tmp_path / "run")), "c")
    assert scene is not None
    collar, stop = scene.maps
    assert collar.largest > stop.largest
    assert within_room(scene.maps) == ([collar, stop], [])
    assert within_room(scene.maps, collar.size) == ([collar], ["stop"])
    assert within_room(scene.maps, 0) == ([], ["collar", "stop"])
