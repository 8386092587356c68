"""The figure of what contact points have met: values where they belong, a closed circle, nothing without data."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection, QuadMesh

from gapbeam.postprocess.figures.figure_style import journal_style
from gapbeam.postprocess.figures.motion_figures import draw_contact_map
from gapbeam.postprocess.plot import DATA_FILE, FOLDER, plot
from gapbeam.postprocess.results.columns_of_run import PointMap, points_of
from gapbeam.postprocess.results_errors import ResultsError
from gapbeam.solver.schema.record_table import POINT_COLUMNS, POINTS_FILE, SUMMARY_FILE
from tests.regression.test_postprocess_plot import sine_records
from tests.unit.test_postprocess_synthetic import write_results

PLACES, TURNS = np.array([0.45, 0.47, 0.5]), np.arange(-165.0, 180.0, 30.0)
AREA = 2.0e-6  # m^2


def ring(places: np.ndarray = PLACES, turns: np.ndarray = TURNS) -> np.ndarray:
    """Return rows of points around a beam that lies at the bottom left of its hole, and lifts off at one end."""
    x, angle = (one.ravel() for one in np.meshgrid(places, turns))
    lean = np.cos(np.radians(angle + 60.0)) * (1.0 - 10.0 * (x - places[0]))
    share = np.maximum(lean, 0.0)
    touched = np.where(share > 0.0, 1.0e-3 * (1.0 + x), np.nan)
    columns = (x, 0.0 * x, angle, np.full(len(x), AREA), share, 1.0e-6 * lean, 0.02 * share, touched)
    return np.column_stack(columns)


def map_of(rows: np.ndarray) -> PointMap:
    """Return the points of a face."""
    return PointMap(*rows.T[[0, 2, 3, 4, 5, 6, 7]])


def run_with(folder: Path, faces: dict[str, np.ndarray]) -> Path:
    """Write a run whose points have these rows, in a collar around the beam and on a stop."""
    time = np.linspace(0.0, 0.5, 501)
    write_results(folder, time, sine_records(time), dimension=3)
    summary = json.loads((folder / SUMMARY_FILE).read_text(encoding="utf-8"))
    below = {"name": "stop_below", "side": "below", "gap": 0.0}
    summary["model"] = {"supports": [
        {"name": "collar", "from": 0.4, "to": 0.55, "clearance": 1e-4,
         "faces": [{"name": "collar_hole", "side": "around", "gap": 1e-4}]},
        {"name": "stop", "from": 0.9, "to": 1.0, "clearance": 1e-3, "faces": [below]},
    ]}  # fmt: skip
    (folder / SUMMARY_FILE).write_text(json.dumps(summary), encoding="utf-8")
    lines = [f"face,{','.join(POINT_COLUMNS)}"]
    for face, rows in faces.items():
        lines += [",".join([face, *("" if np.isnan(cell) else repr(float(cell)) for cell in row)]) for row in rows]
    (folder / POINTS_FILE).write_text("\n".join(lines) + "\n")
    return folder


def shown(panel: Axes, x: float, angle: float) -> float:
    """Return the value of the cell of a map over a place, in the units of the axes."""
    (mesh,) = [one for one in panel.collections if isinstance(one, QuadMesh)]
    corners, values = np.asarray(mesh.get_coordinates()), np.asarray(mesh.get_array())
    column = int(np.searchsorted(corners[0, :, 0], x)) - 1
    row = int(np.searchsorted(corners[:, 0, 1], angle)) - 1
    return float(values[row, column])


def test_values_stand_where_they_belong() -> None:
    """Over x and angle, in the units of the labels; a cell that lies across the top is shown at both ends."""
    one = map_of(ring())
    with journal_style():
        figure = draw_contact_map({"collar_hole": one})
    panels = [axes for axes in figure.axes if axes.get_xlabel() == "x (mm)"]
    bars = [axes.get_xlabel() for axes in figure.axes if axes not in panels]
    assert bars == ["contact share (%)", "impulse per area (N s/m$^2$)", "largest penetration (µm)"]
    assert (panels[0].get_title(), panels[0].get_ylabel()) == ("collar_hole", "angle from straight down (°)")
    wanted = (100.0 * one.share, one.impulse / AREA, 1.0e6 * np.maximum(one.deepest, 0.0))
    for panel, values in zip(panels, wanted, strict=True):
        assert panel.get_ylim() == (-180.0, 180.0)
        for x, angle, value in zip(one.x, one.angle, values, strict=True):
            assert shown(panel, 1.0e3 * x, angle) == pytest.approx(value)
        assert panel.get_xlim()[0] < 450.0
    turned = map_of(ring(turns=TURNS + 15.0))  # the last one at 180
    with journal_style():
        panel = draw_contact_map({"hole": turned}).axes[0]
    top = turned.share[(turned.angle == 180.0) & (turned.x == PLACES[0])].item()
    assert [shown(panel, 450.0, angle) for angle in (-179.0, -166.0, 166.0, 179.0)] == pytest.approx([100.0 * top] * 4)


def test_walls_far_apart_have_marks() -> None:
    """Two walls of a V-block are no map: what lies between them is met by nothing."""
    one = map_of(ring(turns=np.array([-45.0, 45.0])))
    with journal_style():
        panel = draw_contact_map({"block_walls": one}).axes[0]
    (marks,) = [found for found in panel.collections if isinstance(found, PathCollection)]
    assert np.asarray(marks.get_array()) == pytest.approx(100.0 * one.share)


def test_planes_have_curves() -> None:
    """Means over the width, of penetrations the largest."""
    x, angle = np.repeat(PLACES, 2), np.zeros(6)
    share, deepest = np.array([0.2, 0.4, 0.0, 0.0, 1.0, 0.5]), np.array([1.0, 3.0, -1.0, -2.0, 4.0, 2.0]) * 1e-6
    one = PointMap(x, angle, np.full(6, AREA), share, deepest, share, share)
    with journal_style():
        figure = draw_contact_map({"stop_below": one})
    curves = [axes.get_lines()[0].get_ydata() for axes in figure.axes]
    assert curves[0] == pytest.approx([30.0, 0.0, 75.0])
    assert curves[1] == pytest.approx(np.array([0.3, 0.0, 0.75]) / AREA)
    assert curves[2] == pytest.approx([3.0, 0.0, 4.0])


def maps_drawn(folder: Path) -> list[str]:
    """Return the maps among the figures of a run, which are made and not written."""
    plot(folder, formats=())
    drawn = json.loads((folder / FOLDER / DATA_FILE).read_text(encoding="utf-8"))["figures"]
    return [name for name in drawn if name.startswith("contact_map")]


def test_supports_that_were_touched_have_a_map(tmp_path: Path) -> None:
    """One picture a support; none of a support that nothing touched, nor of a run without the file."""
    still = ring(turns=np.array([0.0]))
    still[:, 4:7], still[:, 7] = 0.0, np.nan
    folder = run_with(tmp_path / "run", {"collar_hole": ring(), "stop_below": still})
    assert points_of(folder)["collar_hole"].share == pytest.approx(ring()[:, 4])
    assert maps_drawn(folder) == ["contact_map_collar"]
    (folder / POINTS_FILE).unlink()
    assert maps_drawn(folder) == []


@pytest.mark.parametrize("change", ["short", "words", "share"])
def test_damaged_files_are_refused(change: str, tmp_path: Path) -> None:
    """A line cut short, words, and a share that is not there."""
    folder = run_with(tmp_path / "run", {"collar_hole": ring()})
    text = (folder / POINTS_FILE).read_text().splitlines()
    cells = text[3].split(",")
    text[3] = {"short": ",".join(cells[:-2]), "words": text[3].replace("-06", "x"), "share": ""}[change]
    if change == "share":
        text[3] = ",".join([*cells[:5], "", *cells[6:]])
    (folder / POINTS_FILE).write_text("\n".join(text) + "\n")
    with pytest.raises(ResultsError, match="expected results of contact points"):
        plot(folder)
