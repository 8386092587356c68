"""Advice to give a support its own stiffness: what it says is typed, and narrows the interval of the force."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import gapbeam
from gapbeam.studies.error_estimate.stiff_supports import own_stiffness_advice


def reed(scale: float = 1.0, model: str = "beam", **support: Any) -> dict[str, Any]:
    """Return a reed of bronze that a force closes on its contact, as large as asked for."""
    L = 12.0e-3 * scale
    return {
        "beam": {"length": L, "thickness": L / 60.0, "width": L / 6.0},
        "material": {"young_modulus": 1.2e11, "poisson_ratio": 0.33, "density": 8800.0},
        "damping": {"frequencies": [500.0 / scale, 5000.0 / scale], "ratios": [0.005, 0.005]},
        "joint": [{"name": "root", "type": "clamped", "point": 0.0}],
        "support": [
            {"name": "stop", "from": 23 * L / 24, "to": L, "clearance": L / 240.0, "region": "stop"} | support,
        ],
        "load": [
            {
                "type": "step_force",
                "name": "magnet",
                "point": 0.75 * L,
                "amplitude": 0.1 * scale**2,
                "direction": [0.0, -1.0],
                "start": 1.0e-3 * scale,
                "ramp": 0.5e-3 * scale,
            }
        ],
        "probe": [{"name": "tip", "point": L}],
        "model": {"type": model},
        "time": {"end": 4.0e-3 * scale},
    }


def force_of(tables: dict[str, Any], output: Path) -> tuple[float, list[str]]:
    """Return the error of the largest force over the force, and the warnings about it."""
    summary = gapbeam.run(tables, output=output).summary
    assert summary is not None
    figures = [one for one in summary["errors"]["figures"] if re.fullmatch(r"stop_below largest .* force", one["name"])]
    last = figures[-1]
    return last["error"] / last["value"], [one for one in summary["warnings"] if one.startswith("wide intervals")]


@pytest.mark.parametrize("scale", [0.01, 1.0, 30.0])
def test_the_advised_stiffness_narrows_the_force(scale: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A reed, a switch of micrometers and a plank: the advised stiffness leaves less than half of the error."""
    monkeypatch.setenv("GAPBEAM_ERRORS", "companions")
    wide, (words,) = force_of(reed(scale), tmp_path / "computed")
    advised = re.search(r"support\.stop\.support_stiffness, up to (\S+) N/m", words)
    assert advised, words
    narrow, left = force_of(reed(scale, support_stiffness=float(advised[1])), tmp_path / "own")
    assert narrow < 0.5 * wide
    assert not left


@given(st.floats(1e-3, 1e3), st.sampled_from(["beam", "reduced", "full"]), st.booleans())
@settings(max_examples=20, deadline=None)
def test_the_advice_follows_the_scene(scale: float, model: str, own: bool) -> None:
    """The advised stiffness scales with the scene; supports that have a stiffness of their own get no advice."""
    computed = {"contact.stiffness": 1.0e13 / scale}
    stiffer = {"support_stiffness": 1.0e5} if own else {}
    case = gapbeam.read_case(reed(scale, model, **stiffer))
    words = own_stiffness_advice(case, computed)
    assert bool(words) is not own
    if own:
        return
    (value,) = re.findall(r"up to (\S+) N/m", words)
    assert float(value) / scale == pytest.approx(1.0e5, rel=0.6)
    given_ = gapbeam.read_case({**reed(scale, model), "contact": {"stiffness": 1.0e13 / scale}})
    assert own_stiffness_advice(given_, computed) == ""
