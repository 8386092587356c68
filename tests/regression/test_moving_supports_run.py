"""Runs with supports that move: resumed, swept, on two ranks, and what their history says."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import gapbeam
from gapbeam.postprocess.figures.motion_figures import rooms_at_probes, shifts_at_probes
from gapbeam.postprocess.results.columns_of_run import supports_of, wall_motions
from gapbeam.postprocess.scene.support_surface import support_of
from gapbeam.solver.case.case import case_to_toml
from gapbeam.solver.models.body import body_key
from gapbeam.studies.trials.starts import kicked
from tests.parallel.test_ranks_agree import CLOSE, disagreements
from tests.shared.command import alone, on_ranks
from tests.shared.interrupted import differing, run_in_parts
from tests.verification.test_moving_supports import LEFT, MASS, RIGHT, ROUND, WEIGHT, motion, tables

MODELS = {"rigid": (2,), "full": (70,)}


def written(folder: Path, model: str) -> Path:
    """Write a case: one support shaken, the other one closing, and return its path."""
    closing = {
        "type": "clearance_change", "support": "left", "times": [0.0, 4.0e-3, 8.0e-3], "changes": [0.0, -2e-4, -9e-4],
    }  # fmt: skip
    case = tables(
        [WEIGHT, motion("quake", "right", 1.0e-3, frequency=60.0), closing],
        model={"type": model},
        contact={"stiffness": 1.0e11, "damping": 1.0e6},
        time={"end": 0.0121, "step": 1.0e-4} if model == "full" else {"end": 0.05, "step": 1.0e-4},
        output={"errors": "none", "fields_interval": 4.0e-3},
    )
    path = folder / f"{model}.toml"
    path.write_text(case_to_toml(gapbeam.read_case(case)))
    return path


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("model", MODELS)
def test_a_resumed_run_is_the_same(model: str, tmp_path: Path) -> None:
    """Stopped and continued while walls move, compiled and step by step: no bit differs."""
    case = written(tmp_path, model)
    whole = gapbeam.run(case, (), tmp_path / "whole")
    assert whole.exit_status == 0, whole.message
    assert "accounted for to round-off" in whole.message
    parts = run_in_parts(case, (), tmp_path / "parts", MODELS[model])
    assert parts.exit_status == 0, parts.message
    assert 0.0 < parts.summary["resumed"][0] < whole.summary["convergence"]["steps"]
    assert differing(tmp_path / "whole", tmp_path / "parts") == []
    history = gapbeam.open_results(tmp_path / "whole").history
    assert history["load"].values.tolist() == ["gravity", "quake", "closure"]
    assert np.all(np.max(np.abs(history["load_work"].values), axis=0) > 0.0)
    assert history["wall_motion"]["moving"].values.tolist() == ["quake", "closure"]
    times = history["time"].values
    assert history["wall_motion"].values[:, 0] == pytest.approx(
        1.0e-3 * (np.cos(120.0 * np.pi * times) - 1.0), abs=1e-15
    )
    assert history["wall_motion"].values[-1, 1] == pytest.approx(-9.0e-4, abs=1e-18)


@pytest.mark.slow(minutes=0.1)
def test_results_know_where_walls_are(tmp_path: Path) -> None:
    """Faces of the results, moved by `wall_motion`, stand where the support would be; pictures draw them there."""
    case = written(tmp_path, "rigid")
    assert gapbeam.run(case, (), tmp_path / "run").exit_status == 0
    results = gapbeam.open_results(tmp_path / "run")
    supports = supports_of(results.summary, results.case)
    time = float(results.history["time"].values[123])
    motions = wall_motions(results.history, time)
    lifted = 1.0e-3 * (np.cos(120.0 * np.pi * time) - 1.0)
    assert motions == {"quake": pytest.approx(lifted, abs=1e-15), "closure": pytest.approx(-9.0e-4)}
    gaps = {face.face: face.moved(motions).gap for one in supports for face in one.faces}
    half = 0.5e-3
    assert gaps == {
        "left_below": pytest.approx(half - 4.5e-4), "left_above": pytest.approx(half - 4.5e-4),
        "right_below": pytest.approx(half - lifted), "right_above": pytest.approx(half + lifted),
    }  # fmt: skip
    corners = np.array([[0.0, -0.005, 0.0], [0.4, 0.005, 0.0]])
    boxes = support_of(corners, 2, supports)
    block = next(one for one in boxes.blocks if one.met.face == "right_below")
    top = boxes.box(replace(block, met=block.met.moved(motions)), 10.0)[3]
    assert top == pytest.approx(-0.005 + 10.0 * (lifted - half))
    assert [path.suffix for path in gapbeam.render(tmp_path / "run", film=False)] == [".png", ".png"]


@pytest.mark.slow(minutes=0.1)
def test_orbits_are_those_in_the_support_that_moves(tmp_path: Path) -> None:
    """A probe in a hole that moves aside stays within its clearance of the middle of the hole."""
    holes = [{**one, "clearance": 1.0e-4, "region": "hole"} for one in (LEFT, RIGHT)]
    moved = motion("quake", "right", 1.0e-3, direction=[0.0, 1.0, 0.0], frequency=20.0)
    case = tables(
        [WEIGHT, moved], support=holes, **ROUND, probe=[{"name": "in_right", "point": 0.39}],
        output={"errors": "none"}, contact={"stiffness": 1e12, "damping": 1e7}, time={"end": 0.04, "step": 1e-4},
    )  # fmt: skip
    assert gapbeam.run(case, (), tmp_path / "run").exit_status == 0
    results = gapbeam.open_results(tmp_path / "run")
    supports = supports_of(results.summary, results.case)
    shifts = shifts_at_probes(results.case, supports, results.history)["in_right"]
    path = results.history["displacement"].values[:, 0, 1:]
    assert np.max(np.hypot(*path.T)) > 1.5e-3
    assert np.max(np.hypot(*(path - shifts).T)) < 1.2e-4
    assert rooms_at_probes(results.case, supports)["in_right"].max() == pytest.approx(1.0e-4, rel=1e-3)


def test_kicks_beside_supports_that_move(tmp_path: Path) -> None:
    """Without a force, a kick has up to twice the energy of the beam at the speeds of its supports, at t = 0."""
    model = gapbeam.model(gapbeam.read_case(written(tmp_path, "rigid"))).model
    energies = []
    for number in range(20):
        state = kicked(model, model.case.load, number, seed=1).state
        assert state.time == 0.0
        energies.append(0.5 * float(state.v[0] @ state.v[1]))
    assert min(energies) > 0.0
    closing = model.case.load[2].time_function().value(np.linspace(0.0, 0.008, 8001))
    fastest = np.array([120.0 * np.pi * 1.0e-3, np.max(np.abs(np.diff(closing))) / 1.0e-6])
    assert max(energies) <= 2.0 * 0.5 * MASS * float(np.sum(fastest**2)) * (1.0 + 1e-5)


@pytest.mark.slow(minutes=0.3)
@alone
def test_two_ranks_move_the_same_walls(tmp_path: Path) -> None:
    """The mesh on two ranks, walls on each: histories agree."""
    case = written(tmp_path, "full")
    assert gapbeam.run(case, (), tmp_path / "1").exit_status == 0
    done = on_ranks(2, "run", case, "--output", tmp_path / "2")
    assert done.returncode == 0, done.stderr
    results = [gapbeam.open_results(tmp_path / name) for name in ("1", "2")]
    assert np.max(results[0].history["contact_force"].values) > 0.0
    assert {name: apart for name, apart in disagreements(results).items() if not apart <= CLOSE} == {}


def test_a_sweep_over_a_motion(tmp_path: Path) -> None:
    """Amplitudes are swept by the name of the load, on one body; each response is that of a run with that amplitude."""
    case = written(tmp_path, "rigid")
    cases = [gapbeam.read_case(case, [f"load.quake.amplitude={value}"]) for value in (1.0e-4, 1.0e-3)]
    assert body_key(cases[0]) == body_key(cases[1])
    swept = gapbeam.sweep(case, {"load.quake.amplitude": [1.0e-4, 1.0e-3]}, output=tmp_path / "swept", workers=1)
    assert swept.exit_status == 0, swept.message
    rows = list(csv.DictReader((tmp_path / "swept" / "sweep.csv").read_text().splitlines()))
    for row, one in zip(rows, cases, strict=True):
        alone_run = gapbeam.run(one, (), tmp_path / row["load.quake.amplitude"])
        peaks = alone_run.summary["peak_contact_force"]
        assert float(row["peak_force"]) == pytest.approx(max(peaks.values()), rel=1e-9)
