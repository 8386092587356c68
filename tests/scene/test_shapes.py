"""Shapes of structures in space: displacements and gaps against closed forms, and their picture in reports."""

from __future__ import annotations

import json
import os
import signal
from itertools import pairwise
from pathlib import Path
from typing import Any

import h5py
import meshio
import numpy as np
import pytest

import gapbeam as gb
from gapbeam.postprocess.figures.shape_figures import film_frames, film_times
from gapbeam.postprocess.results_errors import OptionError
from gapbeam.solver.run.output import shape_file
from gapbeam.solver.run.output.shape_file import ShapeFrames
from gapbeam.solver.scene.marcher import Marcher


@pytest.mark.slow(minutes=0.2)
def test_a_run_draws_its_frame_with_the_gaps_of_its_supports(tmp_path: Path) -> None:
    """A cantilever that a force bends at the start: its shape is that of beam theory; a slot and a disc are drawn."""
    steel, round_ = gb.material(2e11, 7800.0, 0.3), gb.SpaceSection(5e-5, 2e-10, 2e-10, 4e-10)
    tip = (1.0, [0.0, 0.0, 1.0])
    points = {"tip": tip, "hole": (0.5, [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])}
    arm = gb.frame([[0, 0, 0], [1, 0, 0]], round_, steel, points, clamped=[0.0], elements=8, name="arm")
    law = gb.KelvinVoigt(stiffness=1e4)
    stop = gb.Contact(arm["tip"], gb.Slot(0.03, center=2e-3), law, name="stop", offset=1e-3)
    hole = gb.Contact(arm["hole"], gb.Disc(0.04), law, name="hole")
    scene = gb.Scene(arm, contacts=[stop, hole], loads=[gb.Force(arm["tip"], 1.0, name="push")])
    outcome = gb.run(scene, step=1e-3, end=0.2, start=gb.seat(scene), output=tmp_path / "a", errors=False)
    assert outcome.exit_status == 0
    shapes = json.loads((tmp_path / "a" / "shapes.json").read_text())
    [body] = shapes["structures"]
    x, u = np.array(body["places"])[:, 0], np.array(body["shapes"]["start"])
    assert u[:, 2] == pytest.approx(x**2 * (3.0 - x) / (6.0 * 2e11 * 2e-10), rel=1e-8, abs=1e-12)
    assert np.abs(u[:, :2]).max() < 1e-12
    walls = {one["name"]: np.array(one["walls"]) for one in shapes["supports"]}
    assert np.sort(walls["stop"][:, 0]) == pytest.approx([-0.014, 0.016], rel=1e-9)
    assert np.linalg.norm(walls["hole"], axis=1) == pytest.approx(0.04, rel=1e-9)
    gb.report(tmp_path / "a", tmp_path / "a.html", pdf=False)
    assert 'src="data:image/png;base64,' in (tmp_path / "a.html").read_text()


def arm_in_a_gap() -> gb.Scene:
    """Return a cantilever that is shaken against a stop on one side."""
    steel, round_ = gb.material(2e11, 7800.0, 0.3), gb.SpaceSection(5e-5, 2e-10, 2e-10, 4e-10)
    points = {"tip": (1.0, [0.0, 0.0, 1.0])}
    arm = gb.frame([[0, 0, 0], [1, 0, 0]], round_, steel, points, clamped=[0.0], elements=8, name="arm")
    stop = gb.Contact(arm["tip"], gb.HalfPlane(2e-3), gb.KelvinVoigt(stiffness=1e4), name="stop")
    push = gb.Force(arm["tip"], lambda t: 2.0 * np.sin(30.0 * t), name="push")
    return gb.Scene(arm, contacts=[stop], loads=[push])


ASKED: dict[str, Any] = {"step": 5e-4, "end": 0.3, "every": 3, "errors": False}


@pytest.mark.parametrize(("every", "count"), [(None, 201), (7, 87)])
def test_shapes_over_a_run_are_those_of_its_history(every: int | None, count: int, tmp_path: Path) -> None:
    """Evenly spaced in time, the last at the end; ParaView's file has them, and a step of the march each is."""
    outcome = gb.run(arm_in_a_gap(), output=tmp_path / "a", **{**ASKED, "every": 1, "shapes": every})
    assert outcome.exit_status == 0
    with meshio.xdmf.TimeSeriesReader(tmp_path / "a" / "shapes.xdmf") as file:
        places, [cells] = file.read_points_cells()
        found = [file.read_data(k)[:2] for k in range(file.num_steps)]
    assert (cells.type, len(cells.data), len(places)) == ("line", 8, 9)
    times = np.array([t for t, _ in found])
    spacing = 5e-4 * (every or 3)
    assert len(times) == count
    assert times[:-1] == pytest.approx(spacing * np.arange(count - 1), abs=1e-12)
    assert times[-1] == pytest.approx(0.3)
    tip = int(np.argmax(places[:, 0]))
    moved = np.array([one["displacement"][tip, 2] for _, one in found])
    record = outcome.history["displacement"].sel(probe="tip", component="y")
    assert moved == pytest.approx(np.interp(times, record["time"], record), rel=1e-9, abs=1e-15)


def test_shapes_of_a_run_that_was_stopped_are_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Those before the checkpoint are kept."""
    gb.run(arm_in_a_gap(), output=tmp_path / "whole", **ASKED)
    advance, blocks = Marcher.advance, []

    def stopping(self: Marcher, steps: int, record: bool = False, energies: bool = False) -> Any:
        blocks.append(steps)
        if len(blocks) == 90:
            os.kill(os.getpid(), signal.SIGTERM)
        return advance(self, steps, record, energies)

    monkeypatch.setattr(Marcher, "advance", stopping)
    assert gb.run(arm_in_a_gap(), output=tmp_path / "part", **ASKED).exit_status == 143
    assert gb.run(arm_in_a_gap(), output=tmp_path / "part", resume=True, **ASKED).exit_status == 0
    assert film_times(tmp_path / "part").tolist() == film_times(tmp_path / "whole").tolist()
    for name in ("shapes.json", "shapes.xdmf"):
        assert (tmp_path / "part" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()
    one, other = (h5py.File(tmp_path / name / "shapes.h5") for name in ("part", "whole"))
    with one, other:
        for number in (0, 100, 200):
            np.testing.assert_array_equal(one[f"displacement/{number}"], other[f"displacement/{number}"])


def test_large_structures_keep_fewer_shapes(monkeypatch: pytest.MonkeyPatch) -> None:
    """As many numbers as a limit allows, two shapes at least beside the start; more where the run says so."""
    marcher = Marcher(arm_in_a_gap(), 1e-3)
    monkeypatch.setattr(shape_file, "AT_ONCE", 20 * marcher.scene.size)
    assert len(ShapeFrames(marcher, 6000, None).times) == 21
    assert len(ShapeFrames(marcher, 6000, 10).times) == 601
    monkeypatch.setattr(shape_file, "AT_ONCE", 1)
    assert len(ShapeFrames(marcher, 6000, None).times) == 3


def test_films_show_structures_and_walls_that_are_touched(tmp_path: Path) -> None:
    """A wall is orange in frames in which its contact has a force, black in others; the file has all frames."""
    outcome = gb.run(arm_in_a_gap(), output=tmp_path / "a", **ASKED)
    forces = outcome.history["contact_force"].sel(face="stop")
    times = film_times(tmp_path / "a")
    pressed = [bool(np.any(forces.sel(time=slice(a + 1e-9, b + 1e-9)) > 0.0)) for a, b in pairwise(times)]
    chosen = [pressed.index(True) + 1, pressed.index(False) + 1]
    frames = list(film_frames(tmp_path / "a", outcome.history, chosen, (640, 360), 1e-9))  # the arm itself hardly moves
    orange = [int((np.abs(one[..., :3].astype(int) - [213, 94, 0]).max(axis=-1) < 40).sum()) for one in frames]
    assert orange[0] > orange[1] + 20
    assert all(one.shape == (360, 640, 4) for one in frames)
    counted = list[tuple[int, int]]()
    files = gb.render(tmp_path / "a", frames=4, size=(320, 200), progress=lambda k, n: counted.append((k, n)))
    assert [one.stem for one in files] == ["shapes", "film"]
    assert all(one.stat().st_size > 1000 for one in files)
    assert counted == [(1, 4), (2, 4), (3, 4), (4, 4)]
    assert [one.stem for one in gb.render(tmp_path / "a", tmp_path / "b", film=False)] == ["shapes"]


def test_structures_without_places_and_their_stresses_are_not_drawn(tmp_path: Path) -> None:
    """In words, with what is missing."""
    mass = gb.mass(1.0, stiffness=100.0, name="box")
    scene = gb.Scene(mass, loads=[gb.Force(mass["at"], 1.0)])
    gb.run(scene, output=tmp_path / "box", step=1e-2, end=1.0, errors=False)
    assert not list((tmp_path / "box").glob("shapes.*"))
    with pytest.raises(gb.RenderError, match="no structure has nodes with a place in space: masses"):
        gb.render(tmp_path / "box")
    gb.run(arm_in_a_gap(), output=tmp_path / "a", **ASKED)
    with pytest.raises(OptionError, match="drawn as lines, without stress"):
        gb.render(tmp_path / "a", stress="axial")
    os.truncate(tmp_path / "a" / "shapes.h5", 900)
    with pytest.raises(gb.ResultsError, match=r"shapes\.h5"):
        gb.render(tmp_path / "a")
    with pytest.raises(gb.UserError, match="found shapes = 0"):
        gb.run(arm_in_a_gap(), output=tmp_path / "c", **ASKED, shapes=0)
