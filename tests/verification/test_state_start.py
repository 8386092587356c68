"""Runs that start from the state that another run left: one march in two parts, and states of other models."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gapbeam
from tests.shared.case_texts import assert_says
from tests.shared.command import alone, called

HALF = 8.0e-3  # s
STEP = 2.0e-5  # s
MODELS: dict[str, dict[str, Any]] = {
    "beam": {"type": "beam", "elements": 16},
    "reduced": {"type": "reduced"},
    "full": {"type": "full"},
}


def tables(
    model: str = "beam", end: float = HALF, analysis: dict[str, Any] | None = None, **more: Any
) -> dict[str, Any]:
    """Return a clamped steel beam that swings in a slot under its weight, and strikes it."""
    motion = {"velocity": 0.1, "spin": 0.0}
    return {
        "beam": {"length": 0.4, "thickness": 0.01, "width": 0.02},
        "material": {"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": 7850.0},
        "support": [{"name": "slot", "from": 0.3, "to": 0.32, "clearance": 1.0e-4}],
        "mesh": {"size": 0.02, "support_size": 5.0e-3, "cells_through_thickness": 2},
        "model": MODELS[model],
        "contact": {"stiffness": 1.0e10},
        "damping": {"mass": 0.0, "stiffness": 1.0e-6},
        "probe": [{"name": "tip", "point": 0.4}],
        "load": [{"type": "gravity"}],
        "analysis": {"type": "transient", "start": "centered", "motion": motion} if analysis is None else analysis,
        "time": {"end": end, "step": STEP},
        **more,
    }


def motion_of(folder: Path) -> np.ndarray:
    """Return displacement and velocity of the tip, and the forces of the faces, at all records."""
    history = gapbeam.open_results(folder).history
    parts = [history[name].sel(probe="tip").values for name in ("displacement", "velocity")]
    forces = history["contact_force"].values
    return np.column_stack([*(part.reshape(len(part), -1) for part in parts), forces.reshape(len(forces), -1)])


@pytest.mark.parametrize(
    "model", ["beam", *(pytest.param(name, marks=pytest.mark.slow) for name in ("reduced", "full"))]
)
def test_two_parts_are_one_march(model: str, tmp_path: Path) -> None:
    """2 T in one run are T, and T from the state that the first T left."""
    keep = {"keep_checkpoint": True}
    assert gapbeam.run(tables(model, 2.0 * HALF), output=tmp_path / "whole").exit_status == 0
    assert gapbeam.run(tables(model, output=keep), output=tmp_path / "first").exit_status == 0
    state = {"type": "transient", "state": str(tmp_path / "first")}
    assert gapbeam.run(tables(model, analysis=state), output=tmp_path / "second").exit_status == 0
    whole, second = motion_of(tmp_path / "whole"), motion_of(tmp_path / "second")
    later = whole[len(whole) - len(second) :]
    assert np.max(later[:, -2:]) > 0.0  # it strikes the slot
    scale = np.abs(whole).max(axis=0).clip(1e-12)
    np.testing.assert_allclose(second[1:] / scale, later[1:] / scale, rtol=0.0, atol=1e-9)
    assert not (tmp_path / "second" / "checkpoint").exists()


MIDDLE = 250  # steps: within an impact


@pytest.mark.parametrize(
    "model", ["beam", *(pytest.param(name, marks=pytest.mark.slow) for name in ("reduced", "full"))]
)
def test_a_state_in_the_middle_is_the_march_from_there(model: str, tmp_path: Path) -> None:
    """T is T/2 and T/2 from the state that the run kept then; what a run keeps changes no bit of it."""
    first = tables(model, output={"keep_states": [MIDDLE * STEP, 333 * STEP]})
    assert gapbeam.run(tables(model), output=tmp_path / "plain").exit_status == 0
    assert gapbeam.run(first, output=tmp_path / "first").exit_status == 0
    assert len(list((tmp_path / "first" / "checkpoint").glob("step-*"))) == 2
    state = {"type": "transient", "state": str(tmp_path / "first"), "state_time": MIDDLE * STEP}
    rest = HALF - MIDDLE * STEP
    assert gapbeam.run(tables(model, rest, analysis=state), output=tmp_path / "second").exit_status == 0
    whole, second = motion_of(tmp_path / "first"), motion_of(tmp_path / "second")
    np.testing.assert_array_equal(motion_of(tmp_path / "plain"), whole)
    later = whole[MIDDLE:]
    assert later[0, -2:].max() > 0.0  # the state presses on the slot
    scale = np.abs(whole).max(axis=0).clip(1e-12)
    np.testing.assert_allclose(second[1:] / scale, later[1:] / scale, rtol=0.0, atol=1e-9)


@pytest.mark.slow(minutes=0.1)
def test_other_loads_and_steps_are_allowed(tmp_path: Path) -> None:
    """The beam that the second run has is that which the first one left, whatever acts on it then."""
    first = tables(output={"keep_checkpoint": True})
    assert gapbeam.run(first, output=tmp_path / "first").exit_status == 0
    state = {"type": "transient", "state": str(tmp_path / "first")}
    other = tables(analysis=state, end=1.0e-3, load=[], time={"end": 1.0e-3, "step": 1.0e-5})
    assert gapbeam.run(other, output=tmp_path / "second").exit_status == 0
    count = gapbeam.open_results(tmp_path / "first").history["velocity"].sel(probe="tip").shape[-1]
    np.testing.assert_allclose(
        motion_of(tmp_path / "second")[0, : 2 * count], motion_of(tmp_path / "first")[-1, : 2 * count], rtol=1e-9
    )


CASE = """
beam = { length = 0.4, thickness = 0.01, width = 0.02 }
material = { young_modulus = 2.1e11, poisson_ratio = 0.3, density = 7850.0 }
model = { type = "beam", elements = ELEMENTS }
contact = { stiffness = 1e10 }
load = [{ type = "gravity" }]
time = { end = 1e-3, step = 2e-5 }
support = [{ name = "slot", from = 0.3, to = 0.32, clearance = 1e-4 }]
probe = [{ name = "tip", point = 0.4 }]
"""
KEEP = ("--set", "output.keep_checkpoint=true")
STATE = '[analysis]\ntype = "transient"\nstate = "FOLDER"\n'


@pytest.mark.slow(minutes=0.1)
@alone
def test_states_that_cannot_be_used(tmp_path: Path) -> None:
    """No folder, no checkpoint, another model, the own folder: status 2, and what to try."""
    start = '[analysis]\ntype = "transient"\nstart = "centered"\n'
    first = tmp_path / "first.toml"
    first.write_text(CASE.replace("ELEMENTS", "8") + start, encoding="utf-8")
    assert called("run", first, "--output", tmp_path / "bare").returncode == 0
    kept = called("run", first, "--output", tmp_path / "kept", *KEEP)
    assert kept.returncode == 0, kept.stderr
    second = tmp_path / "second.toml"

    def refused(elements: str, folder: str, words: list[str], output: str = "second", more: str = "") -> None:
        second.write_text(CASE.replace("ELEMENTS", elements) + STATE.replace("FOLDER", folder) + more, encoding="utf-8")
        found = called("run", second, "--output", tmp_path / output, "--overwrite")
        assert found.returncode == 2, found.stderr
        assert_says(" ".join(found.stderr.split()), ["[analysis] state", *words, "expected", "try"])
        assert "Traceback" not in found.stderr

    refused("8", "nowhere", ["nowhere is no folder"])
    refused("8", "bare", ["holds no checkpoint", "output.keep_checkpoint = true"])
    heavy = first.read_text(encoding="utf-8").replace('"gravity"', '"gravity", acceleration = 3e4')
    first.write_text(heavy, encoding="utf-8")
    assert called("run", first, "--output", tmp_path / "failed", *KEEP, "--set", "time.end=5e-3").returncode == 4
    refused("8", "failed", ["holds no checkpoint", "its run ended with status 4", "a run that passes"])
    refused("10", "kept", ["is of another model", "model.elements: found 10, expected 8"])
    refused("8", "kept", ["state_time = 0.0005", "one of 0.001 s", "= [0.0005]"], more="state_time = 5e-4\n")
    refused("8", "kept", ["is where the results of this run go"], "kept")
    broken = next((tmp_path / "kept" / "checkpoint").glob("step-*.checkpoint"))
    broken.write_bytes(broken.read_bytes()[:-40])
    refused("8", "kept", ["cannot be used", "bytes"])


def test_a_state_replaces_a_pose() -> None:
    """Both at once are refused, as are checkpoints of a search, times after the run, and a time of no run."""
    both = {"type": "transient", "start": "centered", "state": "first"}
    with pytest.raises(gapbeam.CaseError) as caught:
        gapbeam.read_case(tables(analysis=both))
    assert_says(str(caught.value), ['a state together with start = "centered"', "one of both"])
    with pytest.raises(gapbeam.CaseError) as caught:
        gapbeam.read_case(tables(analysis={"type": "periodic"}, output={"keep_checkpoint": True}))
    assert_says(str(caught.value), ["keep_checkpoint", "no checkpoints"])
    for wrong, words in (
        ({"analysis": {"type": "periodic"}, "output": {"keep_states": [1e-3]}}, ["keep_states", "no checkpoints"]),
        ({"output": {"keep_states": [1e-3, 9e-3]}}, ["keep_states", "0.009 s", "ends at 0.008 s"]),
        ({"analysis": {"type": "transient", "state_time": 1e-3}}, ["state_time", "without a state"]),
    ):
        with pytest.raises(gapbeam.CaseError) as caught:
            gapbeam.read_case(tables(**wrong))
        assert_says(str(caught.value), words)
