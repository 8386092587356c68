"""Contact points that wear each by itself: a bar that is pressed on a floor and pushed to and fro along it."""

from __future__ import annotations

from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import gapbeam
from gapbeam.solver.messages.errors import CaseError
from gapbeam.studies.life.case_rates import CaseRates, PointRates
from gapbeam.studies.life.worn_case import of_faces
from gapbeam.studies.life.worn_march import Blocks, Worn, wear_to_limits

LENGTH, WIDTH, MASS = 0.2, 0.02, 7850.0 * 0.2 * 0.01 * 0.02
GRAVITY, STIFFNESS, COEFFICIENT = 1000.0, 1.0e9, 1.0e-13  # m/s^2, Pa/m, 1/Pa
AXIAL, DAMPER, FORCE, FREQUENCY = 1.0e6, 200.0, 100.0, 20.0  # N/m, N s/m, N, Hz
LIMIT, DEEP, TILT = 2.0e-5, 2.0e-4, 5.0e-3  # m, m, m/m


def speed() -> float:
    """Return the mean |v| of the bar, 4 A f, with its amplitude A on the spring and damper along it, m/s."""
    omega = 2.0 * pi * FREQUENCY
    return 4.0 * FREQUENCY * FORCE / abs(complex(AXIAL - MASS * omega**2, omega * DAMPER))


def rubbing(growth: str, tilt: float = 0.0, limit: float = LIMIT) -> dict[str, Any]:
    """Return a rigid bar that may not turn, on a floor that rises along it by its tilt."""
    spring = {"axial": AXIAL, "rotation": 1.0e9}
    floor = {"name": "floor", "from": 0.0, "to": LENGTH, "region": "stop", "clearance": 0.0, "tilt": tilt}
    area = {"area": LENGTH * WIDTH} if growth == "even" else {}
    return {
        "beam": {"length": LENGTH, "thickness": 0.01, "width": WIDTH},
        "material": {"young_modulus": 2.0e11, "poisson_ratio": 0.3, "density": 7850.0},
        "support": [floor],
        "joint": [
            {"name": "rod", "type": "elastic", "point": LENGTH / 2, "stiffness": spring, "damping": {"axial": DAMPER}}
        ],
        "contact": {"stiffness": STIFFNESS},
        "mesh": {"dimension": 2, "size": 0.02, "support_size": 0.02, "cells_through_thickness": 2},
        "model": {"type": "rigid"},
        "load": [
            {"type": "gravity", "acceleration": GRAVITY},
            {
                "type": "harmonic_force",
                "name": "rod",
                "point": LENGTH / 2,
                "amplitude": FORCE,
                "frequency": FREQUENCY,
                "direction": [1.0, 0.0],
            },
        ],
        "probe": [{"name": "tip", "point": LENGTH}],
        "time": {"end": 5.5, "step": 5.0e-4, "scheme": "discrete-gradient"},
        "output": {"errors": "none"},
        "wear": {"coefficient": COEFFICIENT, "depth_limit": limit, "growth": growth} | area,
    }


def test_even_wear_has_the_life_of_even_growth(tmp_path: Path) -> None:
    """A floor without tilt: L A / (k m g v) both ways, 0.2 %; every point is worn to the limit, and files say so."""
    exact = LIMIT * LENGTH * WIDTH / (COEFFICIENT * MASS * GRAVITY * speed())
    even = gapbeam.life(rubbing("even"), output=tmp_path / "even")
    local = gapbeam.life(rubbing("local"), output=tmp_path / "local")
    assert even.exit_status == local.exit_status == 0
    assert even.worn.life == pytest.approx(exact, rel=2e-3)
    assert local.worn.life == pytest.approx(even.worn.life, rel=1e-6)
    assert local.profiles is not None
    assert local.profiles.states[-1].depths == pytest.approx(LIMIT, rel=1e-6)
    lines = (tmp_path / "local" / "profiles.csv").read_text().splitlines()
    assert len(lines) == 1 + local.profiles.contact.size
    assert float(lines[-1].split(",")[-1]) == pytest.approx(LIMIT, rel=1e-6)


def worn_points(factor: float = 1.0) -> tuple[Worn, PointRates]:
    """Return the march of the points of a floor with tilt."""
    rates = PointRates(gapbeam.read_case(rubbing("local", TILT, DEEP)))
    limits = np.full(len(rates.owners), DEEP)
    return wear_to_limits(rates, limits, Blocks(1.0, factor=factor)), rates


def test_a_contact_at_one_end_wears_there() -> None:
    """Against SciPy: dd/dt = k K <z - g - d> v with z from the weight; depths 1 % of the limit, the life 1 %.

    Blocks of half the length change the life by less than the error that is reported.
    """
    worn, rates = worn_points()
    contact = rates.unworn.system.contact
    gap, area = contact.initial_gap, contact.weights

    def pressure(depth: np.ndarray) -> np.ndarray:
        """Return the pressures of the heights at which they carry the weight, (m,), Pa."""

        def missing(height: float) -> float:
            return float(area @ (STIFFNESS * np.maximum(height - gap - depth, 0.0))) - MASS * GRAVITY

        height = brentq(missing, float((gap + depth).min()), float((gap + depth).max()) + 1.0e-3, xtol=1e-15)
        return np.asarray(STIFFNESS * np.maximum(height - gap - depth, 0.0))

    def done(_time: float, depth: np.ndarray) -> float:
        return float(depth.max() - DEEP)

    done.terminal = True  # type: ignore[attr-defined]
    scale = DEEP / (COEFFICIENT * float(pressure(np.zeros(len(gap))).max()) * speed())
    exact = solve_ivp(
        lambda _time, depth: COEFFICIENT * speed() * pressure(depth),
        (0.0, 20.0 * scale), np.zeros(len(gap)), rtol=1e-8, atol=1e-14, events=done, dense_output=True,
    )  # fmt: skip
    life = float(exact.t_events[0][0])
    assert worn.reason == "reached"
    assert worn.life == pytest.approx(life, rel=0.01)
    for state in worn.states:
        assert state.depths == pytest.approx(exact.sol(min(state.time, life)), abs=0.01 * DEEP)
    last = worn.states[-1].depths
    high = contact.positions[:, 0] > 0.5 * LENGTH
    assert last[high].max() == pytest.approx(DEEP)
    assert np.count_nonzero(last == 0.0) > 3
    assert not np.any(last[contact.positions[:, 0] < 0.2 * LENGTH])
    assert of_faces(worn, rates.owners).states[-1].depths == pytest.approx([DEEP])
    halved, _ = worn_points(0.5)
    assert halved.life is not None
    assert worn.life is not None
    assert halved.runs > worn.runs
    assert abs(halved.life - worn.life) < worn.block_error


def test_points_add_up_to_their_face() -> None:
    """On gaps that are not worn, the volumes of all points add up to the volume of the face in even growth."""
    points = PointRates(gapbeam.read_case(rubbing("local", TILT)))
    found = points(np.zeros(len(points.owners)), 0)
    (even,) = CaseRates(gapbeam.read_case(rubbing("even", TILT)))(np.zeros(1), 0).values
    assert np.count_nonzero(found.values == 0.0) > 3
    assert points.unworn.system.contact.weights @ found.values == pytest.approx(even * LENGTH * WIDTH, rel=1e-12)


def test_an_area_beside_local_growth_is_a_fault() -> None:
    """Points wear over areas of their own."""
    tables = rubbing("local")
    with pytest.raises(CaseError, match=r'area\n  found:    1e-05 m\^2, with growth = "local"'):
        gapbeam.read_case(tables | {"wear": tables["wear"] | {"area": 1e-5}})
    with pytest.raises(CaseError, match='expected: "even" or "local"'):
        gapbeam.read_case(tables | {"wear": tables["wear"] | {"growth": "odd"}})
