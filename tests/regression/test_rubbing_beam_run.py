"""Runs of beam models that move along their axis, twist and rub: resumed, swept, on two ranks, in periodic searches."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gapbeam
from gapbeam.solver.case.case import case_to_toml
from gapbeam.solver.march.compiled.compiled_march import why_not_compiled
from gapbeam.solver.messages.errors import CaseError
from gapbeam.solver.models.body import body_key
from tests.parallel.test_ranks_agree import CLOSE, disagreements
from tests.shared.command import alone, on_ranks
from tests.shared.interrupted import differing, run_in_parts
from tests.verification.test_rubbing_beam import SLICE

RUBBING: dict[str, Any] = {"model": {"type": "beam", "elements": 51}, "output": {"errors": "none"}}
SMOOTH: dict[str, Any] = RUBBING | {"contact": {"stiffness": 2.0e10}}
SHORT = {"time": {"end": 0.02, "step": 1.0e-4}}
LENGTH, DENSITY, YOUNG, AREA = 0.51, 7919.0, 2.1e11, 0.012 * 0.02


def written(folder: Path, changes: dict[str, Any]) -> Path:
    """Write a case and return its path."""
    path = folder / "rubbing.toml"
    path.write_text(case_to_toml(gapbeam.read_case(SLICE | SHORT | changes)))
    return path


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize(("changes", "stops"), [(RUBBING, (2,)), (SMOOTH, (2,))], ids=["rubbing", "smooth"])
def test_a_resumed_run_is_the_same(changes: dict[str, Any], stops: tuple[int, ...], tmp_path: Path) -> None:
    """Stopped and continued, with friction and without it: no bit differs."""
    case = written(tmp_path, changes)
    assert why_not_compiled(gapbeam.model(gapbeam.read_case(case)).plan) is None
    whole = gapbeam.run(case, (), tmp_path / "whole")
    assert whole.exit_status == 0, whole.message
    assert "accounted for to round-off" in whole.message
    assert list(whole.summary["model"]["motions"]) == ["bending", "axial"]
    parts = run_in_parts(case, (), tmp_path / "parts", stops)
    assert parts.exit_status == 0, parts.message
    assert 0.0 < parts.summary["resumed"][0] < whole.summary["convergence"]["steps"]
    assert differing(tmp_path / "whole", tmp_path / "parts") == []
    displacement = gapbeam.open_results(tmp_path / "whole").history["displacement"]
    assert float(np.ptp(displacement.values[:, 0, 0])) > 1e-6


@pytest.mark.slow(minutes=0.3)
@alone
def test_two_ranks(tmp_path: Path) -> None:
    """Friction and motion agree on one rank and on two."""
    case = written(tmp_path, RUBBING)
    assert gapbeam.run(case, (), tmp_path / "1").exit_status == 0
    done = on_ranks(2, "run", case, "--output", tmp_path / "2")
    assert done.returncode == 0, done.stderr
    results = [gapbeam.open_results(tmp_path / name) for name in ("1", "2")]
    assert {name: apart for name, apart in disagreements(results).items() if not apart <= CLOSE} == {}


def test_a_sweep_over_the_coefficient_shares_the_body(tmp_path: Path) -> None:
    """The coefficient of friction is cheap to change; friction at all asks for an axial motion, and is not."""
    case = written(tmp_path, RUBBING)
    read = [gapbeam.read_case(case, [f"contact.friction.coefficient={value}"]) for value in (0.1, 0.5, 0.0)]
    assert body_key(read[0]) == body_key(read[1]) != body_key(read[2])
    swept = gapbeam.sweep(case, {"contact.friction.coefficient": [0.1, 0.5]}, output=tmp_path / "swept", workers=1)
    assert swept.exit_status == 0, swept.message
    table = (tmp_path / "swept" / "sweep.csv").read_text()
    rows = list(csv.DictReader(table.splitlines()))
    assert [row["verdict"] for row in rows] == ["passed", "passed"]
    assert float(rows[0]["peak_force"]) > 1.01 * float(rows[1]["peak_force"]) > 0.0


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("method", ["shooting", "harmonic-balance"])
def test_periodic_responses_along_the_beam(method: str, tmp_path: Path) -> None:
    """A clamped beam is pulled to and fro: F tan(k L) / (E A k) at its end, k = 2 pi f / c. Friction is refused."""
    frequency, force = 400.0, 200.0
    pull = {"type": "harmonic_force", "name": "pull", "point": LENGTH, "amplitude": force, "frequency": frequency,
            "direction": [1.0, 0.0]}  # fmt: skip
    tables = SMOOTH | {
        "joint": [{"name": "root", "type": "clamped", "point": 0.0}],
        "support": [{"name": "far", "from": 0.2, "to": 0.25, "clearance": 1.0e-3}],
        "load": [pull],
        "analysis": {"type": "periodic", "method": method},
        "time": {"end": 0.02, "step": 1.0e-5},
    }
    done = gapbeam.run(written(tmp_path, tables), (), tmp_path / "run")
    assert done.exit_status == 0, done.message
    wave = 2.0 * np.pi * frequency / np.sqrt(YOUNG / DENSITY)
    wanted = force * np.tan(wave * LENGTH) / (YOUNG * AREA * wave)
    moved = gapbeam.open_results(tmp_path / "run").history["displacement"].values[:, 0, 0]
    assert 0.5 * float(np.ptp(moved)) == pytest.approx(wanted, rel=2e-3)
    with pytest.raises(CaseError, match="no friction"):
        gapbeam.read_case(SLICE | tables | {"contact": SLICE["contact"]})
