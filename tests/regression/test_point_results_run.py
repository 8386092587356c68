"""Runs that write results of their contact points: against the faces, the same motion, resumed, drawn, refused."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gapbeam
from gapbeam.postprocess.plot import DATA_FILE, FOLDER
from gapbeam.postprocess.results.columns_of_run import points_of
from gapbeam.solver.case.case import case_to_toml
from gapbeam.solver.messages.errors import CaseError
from gapbeam.solver.schema.record_table import POINTS_FILE
from tests.regression.test_hole_pictures import KEYS
from tests.shared.command import CASE_FOLDER, alone, on_ranks
from tests.shared.interrupted import run_in_parts
from tests.verification.test_rubbing_beam import SLICE

TUBE, POINTS = (CASE_FOLDER / "tube-holes.toml"), "output.points=true"
SHORT: dict[str, Any] = {
    "model": {"type": "beam", "elements": 51},
    "time": {"end": 0.02, "step": 1.0e-4},
    "output": {"errors": "none", "points": True},
}
SMOOTH = {"contact": {"stiffness": 2.0e10}}


def slice_in(folder: Path, changes: Mapping[str, Any]) -> Path:
    """Write the case of a slice that is shaken in its slot, with changes, and return it."""
    path = folder / "case.toml"
    path.write_text(case_to_toml(gapbeam.read_case(SLICE | SHORT | changes)))
    return path


@pytest.fixture(scope="module")
def tube(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Run a rigid tube in two holes, compiled."""
    folder: Path = tmp_path_factory.mktemp("tube") / "run"
    outcome = gapbeam.run(TUBE, (*KEYS, "time.end=0.05", POINTS), folder)
    assert (outcome.exit_status, outcome.summary["loop"]) == (0, "compiled"), outcome.message
    return folder


def refuse_misfit(folder: Path) -> None:
    """Hold the points of a run with a record for every step to its faces.

    The impulses add up to the impulse of the face; the first touch and the largest penetration of a face are those of a
    point of it; a face is in contact where a point is.
    """
    history, found = gapbeam.open_results(folder).history, points_of(folder)
    times = history["time"].values
    assert set(found) == set(map(str, history["face"].values))
    for face, one in found.items():
        records = history.sel(face=face)
        closed = records["contact_time"].values
        assert np.nansum(one.impulse) == pytest.approx(records["impulse"].values[-1], rel=1e-12)
        assert one.deepest.max() == pytest.approx(records["penetration"].values.max(), rel=1e-9, abs=1e-15)
        assert one.touched == bool(closed[-1] > 0.0)
        if one.touched:
            assert np.nanmin(one.first_touch) == times[np.argmax(records["penetration"].values > 0.0)]
        share = closed[-1] / times[-1]
        assert one.share.max() <= share * (1.0 + 1e-9)
        assert one.share.sum() >= share * (1.0 - 1e-9)
        assert np.array_equal(one.share > 0.0, one.deepest > 0.0)
        assert np.array_equal(one.share > 0.0, one.impulse > 0.0)
    assert any(one.touched for one in found.values())


def test_the_points_of_a_compiled_run_are_those_of_its_faces(tube: Path) -> None:
    """A tube that rolls and strikes in two holes: points all around, each with an angle."""
    refuse_misfit(tube)
    assert all(one.around for one in points_of(tube).values())


def test_the_points_of_a_run_in_python_are_those_of_its_faces(tmp_path: Path) -> None:
    """A beam with friction in a slot, whose steps are halved where it touches."""
    outcome = gapbeam.run(slice_in(tmp_path, {}), ["time.adaptive=true"], tmp_path / "run")
    assert outcome.exit_status == 0, outcome.message
    assert outcome.summary["loop"] != "compiled"
    refuse_misfit(tmp_path / "run")


@pytest.mark.slow(minutes=0.1)
def test_the_points_of_a_periodic_response_are_those_of_its_faces(tmp_path: Path) -> None:
    """The records of a search are one period of the response that it has found."""
    coarse = ("model.elements=12", "mesh.support_size=0.0125", "mesh.size=0.06")
    outcome = gapbeam.run((CASE_FOLDER / "periodic.toml"), (*coarse, POINTS), tmp_path / "run")
    assert outcome.exit_status == 0, outcome.message
    assert outcome.summary["periodic"]["periods"] == 1
    refuse_misfit(tmp_path / "run")
    assert gapbeam.open_results(tmp_path / "run").history["time"].values[-1] == pytest.approx(0.05)


def test_the_maps_of_the_holes_are_drawn(tube: Path) -> None:
    """One for each support."""
    gapbeam.plot(tube, formats=())
    drawn = json.loads((tube / FOLDER / DATA_FILE).read_text(encoding="utf-8"))["figures"]
    assert [name for name in drawn if name.startswith("contact_map")] == ["contact_map_left", "contact_map_right"]


def test_points_change_no_bit_of_the_run(tube: Path, tmp_path: Path) -> None:
    """Without them the records are the same, and there is no file."""
    assert gapbeam.run(TUBE, (*KEYS, "time.end=0.05"), tmp_path / "without").exit_status == 0
    histories = [gapbeam.open_results(path).history for path in (tube, tmp_path / "without")]
    assert histories[0].identical(histories[1])
    assert not (tmp_path / "without" / POINTS_FILE).exists()


def test_few_records_leave_the_impulses_of_the_faces(tube: Path, tmp_path: Path) -> None:
    """A record every fifth step sees less of the penetrations; the impulses still add up to those of the march."""
    keys = (*KEYS, "time.end=0.05", POINTS, "output.history_interval=5e-4")
    assert gapbeam.run(TUBE, keys, tmp_path / "coarse").exit_status == 0
    impulse = gapbeam.open_results(tube).history["impulse"]
    for face, one in points_of(tmp_path / "coarse").items():
        assert one.impulse.sum() == pytest.approx(impulse.sel(face=face).values[-1], rel=1e-12)
        assert np.all(one.deepest <= points_of(tube)[face].deepest)


@pytest.mark.parametrize("rubs", [False, True], ids=["compiled", "python"])
def test_a_resumed_run_has_the_same_points(rubs: bool, tmp_path: Path) -> None:
    """Stopped and continued: extremes to the last bit, sums to round-off."""
    case = slice_in(tmp_path, {} if rubs else SMOOTH)
    assert gapbeam.run(case, (), tmp_path / "whole").exit_status == 0
    parts = run_in_parts(case, (), tmp_path / "parts", (60 if rubs else 2,))
    assert parts.exit_status == 0, parts.message
    assert parts.summary["resumed"]
    found = [points_of(tmp_path / name) for name in ("whole", "parts")]
    for face, one in found[0].items():
        for name in ("deepest", "first_touch"):
            assert np.array_equal(getattr(one, name), getattr(found[1][face], name), equal_nan=True)
        for name in ("share", "impulse"):
            assert getattr(one, name) == pytest.approx(getattr(found[1][face], name), rel=1e-12)


@pytest.mark.slow(minutes=0.3)
@alone
@pytest.mark.parametrize("model", [{"type": "full"}, {"type": "beam", "elements": 51}], ids=["full", "beam"])
def test_two_ranks(model: dict[str, Any], tmp_path: Path) -> None:
    """A full model, whose points are shared out, and a compiled beam: they agree on one rank and on two."""
    case = slice_in(tmp_path, SMOOTH | {"model": model, "time": {"end": 2.0e-3, "step": 1.0e-4}})
    assert gapbeam.run(case, (), tmp_path / "1").exit_status == 0
    done = on_ranks(2, "run", case, "--output", tmp_path / "2")
    assert done.returncode == 0, done.stderr
    refuse_misfit(tmp_path / "2")
    one, two = (points_of(tmp_path / name) for name in ("1", "2"))
    for face, of_face in one.items():
        for name in ("x", "share", "impulse", "deepest"):
            values, others = (np.sort(getattr(found, name)) for found in (of_face, two[face]))
            assert others == pytest.approx(values, rel=1e-6, abs=1e-6 * np.abs(values).max())


@pytest.mark.parametrize("formulation", ["unilateral", "nitsche", "augmented-lagrangian"])
def test_exact_contact_is_refused(formulation: str) -> None:
    """What such points have met is not in their penetration."""
    changes = {"contact": {"formulation": formulation}, "model": {"type": "full"}}
    with pytest.raises(CaseError, match=f"(?s)output.*points.*with the formulation {formulation}"):
        gapbeam.read_case(SLICE | SHORT | changes)
