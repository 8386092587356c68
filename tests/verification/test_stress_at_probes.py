"""Stress at probes against beam theory: bending, tension, and what a run writes of it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI

import gapbeam
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.models.model import Model, build_model
from gapbeam.solver.run.assumptions.pose_rows import gauges_of
from gapbeam.solver.system.semi_discrete import VALUE

LENGTH, THICKNESS, WIDTH = 0.4, 0.02, 0.02  # m
WEIGHT = 7850.0 * 490.5  # N/m^3: under 50 g
PLACE = 0.15  # m
SOLID = {"dimension": 3, "size": 0.02, "support_size": 0.02, "cells_through_thickness": 2}
SLICE = {"dimension": 2, "size": 0.01, "support_size": 0.01, "cells_through_thickness": 4}
ROUND = {"beam": {"section": "round"}, "mesh": {**SOLID, "cells_through_thickness": 4, "cells_across_width": 4}}


def model_of(direction: list[float] | None, **more: Any) -> Model:
    """Return a cantilever under its weight, with stress at its upper surface, its lower one and its axis."""
    axes = 1 if more.get("mesh", SLICE)["dimension"] == 2 else 2
    aside = [[0.0] * (axes - 1) + [height] for height in (0.5 * THICKNESS, -0.5 * THICKNESS, 0.0)]
    tables: dict[str, Any] = {
        "material": {"young_modulus": 2.0e11, "poisson_ratio": 0.3, "density": 7850.0},
        "joint": [{"name": "root", "type": "clamped", "point": 0.0}],
        "support": [{"name": "s", "from": 0.38, "to": LENGTH, "clearance": 0.1, "region": "stop"}],
        "mesh": SLICE,
        "load": [{"type": "gravity", "acceleration": 490.5} | ({"direction": direction} if direction else {})],
        "probe": [
            {"name": name, "point": [PLACE, *place], "stress": True}
            for name, place in zip(("top", "bottom", "axis"), aside, strict=True)
        ],
        "time": {"end": 0.01, "step": 1.0e-4},
    }
    beam = {"length": LENGTH, "thickness": THICKNESS, "width": WIDTH, **more.pop("beam", {})}
    return build_model(gapbeam.read_case(tables | {"beam": beam} | more), MPI.COMM_SELF)


def stresses(model: Model) -> tuple[np.ndarray, np.ndarray]:
    """Return axial and von Mises stress at rest, (3,) each, Pa."""
    gauges = gauges_of(model.case, model)
    assert gauges is not None
    axial, equivalent = gauges.stresses(Simulation(model).seat().state.u[VALUE][None])
    return axial[0], equivalent[0]


MODELS: dict[str, dict[str, Any]] = {
    "full slice": {"model": {"type": "full"}},
    "reduced slice": {"model": {"type": "reduced"}},
    "beam": {"model": {"type": "beam", "elements": 40}},
    "full solid": {"model": {"type": "full"}, "mesh": SOLID},
    "reduced solid": {"model": {"type": "reduced"}, "mesh": SOLID},
    "round solid": {"model": {"type": "full"}, **ROUND},
    "round beam": {"model": {"type": "beam", "elements": 40}, **ROUND},
}


@pytest.mark.slow(minutes=0.3)
@pytest.mark.parametrize("name", MODELS)
def test_bending_under_weight(name: str) -> None:
    """Tension above and compression below: M c / I with M = w (L - x)^2 / 2; no bending stress on the axis."""
    axial, equivalent = stresses(model_of(None, **MODELS[name]))
    section = 0.25 * THICKNESS if "round" in name else THICKNESS / 3.0  # 2 I / (A c)
    wanted = WEIGHT * (LENGTH - PLACE) ** 2 / section
    assert axial[:2] == pytest.approx([wanted, -wanted], rel=0.01)
    assert equivalent[:2] == pytest.approx([wanted, wanted], rel=0.015)
    assert abs(axial[2]) < 0.01 * wanted


@pytest.mark.parametrize("name", ["full slice", "full solid"])
def test_tension_under_weight(name: str) -> None:
    """A beam that hangs from its root carries its weight below: w (L - x), everywhere across it."""
    along = [1.0, 0.0] if name == "full slice" else [1.0, 0.0, 0.0]
    axial, equivalent = stresses(model_of(along, **MODELS[name]))
    wanted = np.full(3, WEIGHT * (LENGTH - PLACE))
    assert axial == pytest.approx(wanted, rel=1e-3)
    assert equivalent == pytest.approx(wanted, rel=1e-3)


def released(times: np.ndarray) -> np.ndarray:
    """Return the stress of Euler and Bernoulli at the upper surface after the release from rest, by eight modes, Pa."""
    roots = np.array([1.8751041, 4.6940911, 7.8547574, 10.9955407, *(np.pi * (np.arange(5, 9) - 0.5))])
    beta, sigma = roots / LENGTH, (np.cosh(roots) + np.cos(roots)) / (np.sinh(roots) + np.sin(roots))
    squares = 2.0e11 * THICKNESS**2 / 12.0 / 7850.0 * beta**4
    pulled = 490.5 * 2.0 * sigma / roots / squares
    at = beta * PLACE
    bend = beta**2 * (np.cosh(at) + np.cos(at) - sigma * (np.sinh(at) + np.sin(at)))
    swings = 1.0 - np.cos(np.sqrt(squares) * times[:, None])
    return np.asarray(2.0e11 * 0.5 * THICKNESS * swings @ (pulled * bend))


@pytest.mark.slow(minutes=0.1)
def test_a_run_records_stresses_with_their_errors(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The history holds both stresses over time, the summary errors of their figures; other runs have neither."""
    case = model_of(None, model={"type": "reduced"}).case
    monkeypatch.setenv("GAPBEAM_ERRORS", "companions")
    outcome = gapbeam.run(case, {"analysis.start": "undeformed", "time.step": 2.0e-5}, tmp_path / "run")
    assert outcome.exit_status in (0, 5)
    results = gapbeam.open_results(tmp_path / "run")
    top = results.history["axial_stress"].sel(gauge="top").values
    assert results.history["von_mises_stress"].dims == ("time", "gauge")
    assert top[0] == 0.0
    wanted = released(results.history["time"].values)
    early = results.history["time"].values < 4.0e-3  # later, shear has moved the phases of the second mode
    assert np.ptp(wanted[early]) > 0.4 * np.ptp(wanted)
    assert np.abs(top - wanted)[early].max() < 0.03 * np.ptp(wanted)
    figures = {one["name"]: one for one in results.summary["errors"]["figures"]}
    assert figures["top peak-to-peak axial stress"]["value"] == pytest.approx(np.ptp(top), rel=0.02)
    assert 0.0 < figures["top peak-to-peak axial stress"]["error"] < 0.2 * np.ptp(top)
