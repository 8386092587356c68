"""Errors of runs include what `reduce` leaves out, and elements: the same file without it, or with more, is right."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp

import gapbeam as gb

STEEL = {"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": 7850.0}
CONTACT = {"type": "kelvin-voigt", "stiffness": 5e4, "damping": 10.0}


def chain(folder: Path, modes: int | None) -> dict[str, Any]:
    """Twelve masses in a row, driven at one end, with a stop at the other."""
    n = 12
    K = 800.0 * np.eye(n) - 400.0 * (np.eye(n, k=1) + np.eye(n, k=-1))
    K[-1, -1] = 400.0
    for name, matrix in (("k", K), ("m", np.eye(n))):
        scipy.io.mmwrite(folder / f"{name}.mtx", sp.coo_matrix(matrix))
    model = {"type": "matrices", "stiffness": str(folder / "k.mtx"), "mass": str(folder / "m.mtx"), "units": "m-kg-s"}
    points = {"drive": {"dof": "0"}, "tip": {"dof": "11"}}
    return scene(model, points, modes, {"amplitude": 30.0, "frequency": 1.4}, 0.02, 2.0, 1e-3)


def beam(folder: Path, modes: int | None) -> dict[str, Any]:
    """A cantilever that is shaken near its clamp and strikes a stop at its tip."""
    del folder
    model = {"type": "beam", "length": 0.5, "thickness": 0.01, "width": 0.02, "elements": 12, "material": STEEL}
    points = {"drive": {"at": 0.2}, "tip": {"at": 0.5}}
    tables = scene(model, points, modes, {"amplitude": 40.0, "frequency": 25.0}, 2e-4, 0.2, 2e-5)
    return tables | {"joint": [{"type": "clamped", "structure": "body", "at": 0.0}]}


def frame(folder: Path, modes: int | None) -> dict[str, Any]:
    """An angle of pipe, shaken at its corner, with a stop at its end."""
    del folder
    route = [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 1.0]]
    section = {"type": "tube", "wall": 3e-3}
    model = {"type": "frame", "route": route, "thickness": 0.05, "section": section, "material": STEEL, "elements": 16}
    points = {
        "drive": {"nearest": [0.0, 0.0, 1.0], "direction": [1.0, 0.0, 0.0]},
        "tip": {"nearest": [1.0, 0.0, 1.0], "direction": [0.0, 0.0, 1.0]},
    }
    tables = scene(model, points, modes, {"amplitude": 100.0, "frequency": 11.0}, 2e-4, 0.4, 1e-4)
    return tables | {"joint": [{"type": "clamped", "structure": "body", "at": 0.0}]}


def scene(
    model: dict[str, Any], points: dict[str, Any], modes: int | None, load: dict[str, Any], clearance: float,
    end: float, step: float,
) -> dict[str, Any]:  # fmt: skip
    body: dict[str, Any] = {"name": "body", "model": model}
    if modes is not None:
        body["reduce"] = {"modes": modes}
    region = {"type": "half-plane", "clearance": clearance}
    return {
        "structure": [body],
        "point": [{"name": name, "structure": "body", **one} for name, one in points.items()],
        "pair": [{"name": "stop", "between": ["body.tip"], "region": region, "law": CONTACT}],
        "load": [{"type": "harmonic_force", "point": "body.drive", **load}],
        "time": {"end": end, "step": step},
    }


@pytest.mark.parametrize("modes", [1, 2, 3, 5])
@pytest.mark.parametrize("made", [chain, beam, frame])
def test_errors_cover_the_modes_that_are_left_out(
    made: Any, modes: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each figure of the reduced structure is within its error of the figure of all DOFs; with one mode, twice that."""
    monkeypatch.setenv("GAPBEAM_ERRORS", "companions")
    whole = gb.run(made(tmp_path, None), output=tmp_path / "whole")
    some = gb.run(made(tmp_path, modes), output=tmp_path / "some")
    right = {(one["span"], one["name"]): one for one in whole.figures}
    compared = [one for one in some.figures if one["error"] is not None]
    assert len(compared) >= 4
    for one in compared:
        exact = right[one["span"], one["name"]]
        assert abs(one["value"] - exact["value"]) <= (1 + (modes == 1)) * one["error"] + exact["error"], one["name"]
    assert max(one["differences"].get("finer structures", 0.0) for one in some.summary["errors"]["figures"]) > 0.0


@pytest.mark.parametrize("elements", [2, 4, 7])
@pytest.mark.parametrize("made", [beam, frame])
def test_errors_cover_few_elements(made: Any, elements: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each figure with few elements is within its error of the figure with many."""
    monkeypatch.setenv("GAPBEAM_ERRORS", "companions")
    tables = [made(tmp_path, None) for _ in range(2)]
    for one, count in zip(tables, (elements, 48), strict=True):
        one["structure"][0]["model"]["elements"] = count
    few, many = (gb.run(one, output=tmp_path / str(number)) for number, one in enumerate(tables))
    right = {(one["span"], one["name"]): one for one in many.figures}
    compared = [one for one in few.figures if one["error"] is not None]
    assert len(compared) >= 4
    for one in compared:
        exact = right[one["span"], one["name"]]
        assert abs(one["value"] - exact["value"]) <= one["error"] + exact["error"], one["name"]


def test_a_scene_of_python_gives_its_finer_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A function of the caller makes it; whatever else that returns is named, and the run stays."""
    monkeypatch.setenv("GAPBEAM_ERRORS", "companions")
    n = 12
    K = 800.0 * np.eye(n) - 400.0 * (np.eye(n, k=1) + np.eye(n, k=-1))
    row = gb.Structure(np.eye(n), K, points={"drive": 0, "tip": n - 1})

    def made(modes: int) -> gb.Scene:
        body = gb.reduced_at_points(row, modes)
        return gb.Scene(body, loads=[gb.Force(body["drive"], gb.sine, amplitude=30.0, frequency=3.0)])

    asked: dict[str, Any] = {"step": 1e-3, "end": 2.0, "overwrite": True, "output": tmp_path / "run"}
    few = gb.run(made(2), finer=lambda: (made(4), None), **asked)
    many = gb.run(made(11), **asked)
    for one, exact in zip(few.figures, many.figures, strict=True):
        assert one["name"] == exact["name"]
        assert abs(one["value"] - exact["value"]) <= one["error"] + exact["error"], one["name"]
    wrong = gb.run(made(2), finer=lambda: made(4), **asked)
    assert "expected a scene and its start" in wrong.summary["errors"]["failed_companions"]["finer structures"]
