"""Shipped cases on the model that "auto" stands for move as on their reduced models."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gapbeam
from tests.shared.command import CASE_FOLDER

CASES = sorted(path.stem for path in CASE_FOLDER.glob("*.toml"))
HEAVY = {"bar-vblocks", "dovetail-slide", "tube-baffles", "tube-holes", "tube-turbulence", "valve", "li2013"}
STEPS = 400
TOLERANCE = 0.02  # of the rms of the motion of the tip
OF_BLOCKS = 0.15  # of a bar in V-blocks as long as it is thick, in which the model beam expects errors of 16 to 23 %


def _tip(folder: Path, path: Path, model: dict[str, Any]) -> Any:
    """Return how the tip moves from its seat in the first steps, (times, components), m, and the type of the model."""
    base = gapbeam.read_case(path)
    end = STEPS * float(base.time.step)
    changes = {
        "model": model,
        "time.end": end,
        "analysis": {
            "type": "transient",
            "start": base.analysis.start if base.analysis.type == "transient" else "seat",
        },
        "output.errors": "none",
        "output.history_interval": float(base.time.step),
        "output.fields_interval": end,
        "output.checkpoint_interval": 0.0,
    }
    outcome = gapbeam.run(path, changes, folder)
    assert outcome.exit_status == 0, outcome.message
    moved = gapbeam.open_results(folder).history["displacement"].sel(probe="tip").values
    return moved - moved[0], outcome.summary["model"]


def _check(name: str, folder: Path, tolerance: float = TOLERANCE) -> None:
    path = CASE_FOLDER / f"{name}.toml"
    given = gapbeam.read_case(path).model
    keys = given.model_dump(exclude_none=True, exclude={"reasons"}) if given.type == "reduced" else {"type": "reduced"}
    reduced, _ = _tip(folder / "reduced", path, keys)
    chosen, model = _tip(folder / "auto", path, {"type": "auto"})
    assert model["reasons"][-1].startswith(model["type"])
    size = np.sqrt(np.mean(np.sum(reduced**2, axis=1)))
    assert np.sqrt(np.mean(np.sum(chosen**2, axis=1))) == pytest.approx(size, rel=tolerance)


@pytest.mark.slow(minutes=0.1)
def test_the_demo_moves_as_reduced(tmp_path: Path) -> None:
    """A slender beam in play, under a force."""
    _check("demo", tmp_path)


@pytest.mark.slow(minutes=0.5)
@pytest.mark.parametrize("name", [name for name in CASES if name not in HEAVY | {"demo"}])
def test_slices_move_as_reduced(name: str, tmp_path: Path) -> None:
    """All slices."""
    _check(name, tmp_path)


@pytest.mark.slow(minutes=4)
@pytest.mark.parametrize(("name", "tolerance"), [("bar-vblocks", OF_BLOCKS), ("tube-holes", TOLERANCE)])
def test_solids_move_as_reduced(name: str, tolerance: float, tmp_path: Path) -> None:
    """A bar on V-blocks and a tube in holes, which move in two planes."""
    _check(name, tmp_path, tolerance)
