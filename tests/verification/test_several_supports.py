"""Beams in several supports: statics by hand and by enumeration, and what has to be equal to the last bit."""

from __future__ import annotations

from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gapbeam
from gapbeam.solver.run.output.run_summary import describe_seat
from gapbeam.solver.system.operators import Array

LENGTH, THICKNESS, WIDTH = 1.0, 0.01, 0.02
YOUNG, DENSITY, GRAVITY = 2.1e11, 7850.0, 9.81
BENDING = YOUNG * WIDTH * THICKNESS**3 / 12.0
WEIGHT = DENSITY * WIDTH * THICKNESS * GRAVITY  # N/m
NARROW = 1.0e-3  # m: the length of a support that stands for a point


def support(name: str, x: float, clearance: float = 1.0e-3, offset: float = 0.0, **more: Any) -> dict[str, Any]:
    """Return a narrow support around a place."""
    start = min(max(x - 0.5 * NARROW, 0.0), LENGTH - NARROW)
    place = {"from": round(start, 9), "to": round(start + NARROW, 9)}
    return {"name": name, **place, "clearance": clearance, "offset": offset, **more}


def tables(supports: list[dict[str, Any]], **more: Any) -> dict[str, Any]:
    """Return a slender steel beam under its weight, as a beam model."""
    return {
        "beam": {"length": LENGTH, "thickness": THICKNESS, "width": WIDTH},
        "material": {"young_modulus": YOUNG, "poisson_ratio": 0.3, "density": DENSITY},
        "damping": {"frequencies": [20.0, 200.0], "ratios": [0.01, 0.01]},
        "support": supports,
        "mesh": {"size": 0.02, "support_size": 0.5e-3, "cells_through_thickness": 1},
        "model": {"type": "beam", "elements": 200},
        "contact": {"stiffness": 1.0e13},
        "load": [{"type": "gravity", "acceleration": GRAVITY}],
        "probe": [{"name": "tip", "point": LENGTH}],
        "time": {"end": 1.0e-3, "step": 1.0e-4},
        **more,
    }


def reactions(supports: list[dict[str, Any]]) -> dict[str, float]:
    """Return the force on each face at the static seat, N."""
    simulation = gapbeam.model(gapbeam.read_case(tables(supports)))
    found = describe_seat(simulation.seat(), simulation.model)
    return {name.removesuffix("_force"): force for name, force in found.items() if name.endswith("_force")}


def test_two_supports_carry_by_their_levers() -> None:
    """A beam on two supports: moments by hand, to the half of a support where it may press."""
    found = reactions([support("left", 0.2), support("right", 0.9)])
    right = WEIGHT * LENGTH * (0.5 - 0.2) / 0.7
    assert found["right_below"] == pytest.approx(right, rel=2.0 * NARROW / 0.3)
    assert found["left_below"] == pytest.approx(WEIGHT * LENGTH - right, rel=2.0 * NARROW / 0.3)
    assert found["left_above"] == found["right_above"] == 0.0
    assert sum(found.values()) == pytest.approx(WEIGHT * LENGTH, rel=1e-9)


SAG = 5.0 * WEIGHT * LENGTH**4 / (384.0 * BENDING)  # of the pinned beam


@pytest.mark.parametrize("settlement", [0.0, 0.3, 0.8, 1.2, -0.5])
def test_a_settled_middle_support(settlement: float) -> None:
    """Three supports, the middle one lower by a share of the sag: R = (sag - settlement) 48 E I / L^3, never below 0.

    Source: the continuous beam of two spans by superposition, any text on the strength of materials.
    """
    play = 2.0e-2
    outer = 0.5 * NARROW  # supports at the ends press at their inner edges
    span = LENGTH - 2.0 * NARROW
    sag = 5.0 * WEIGHT * span**4 / (384.0 * BENDING)
    supports = [support("left", outer, play), support("right", LENGTH - outer, play)]
    middle = support("middle", 0.5 * LENGTH, play, offset=-settlement * SAG)
    found = reactions([*supports, middle])
    expected = max(0.0, (sag - settlement * SAG) * 48.0 * BENDING / span**3)
    assert found["middle_below"] == pytest.approx(expected, rel=0.01, abs=1e-9 * WEIGHT)
    assert sum(found.values()) == pytest.approx(WEIGHT * LENGTH, rel=1e-8)
    assert (found["middle_below"] == 0.0) == (settlement > 1.0)


def euler_bernoulli(elements: int) -> tuple[Array, Array]:
    """Return K and the loads of a beam of cubic elements under its weight, written anew: DOFs w, w' of each node."""
    h = LENGTH / elements
    element = (
        BENDING / h**3
        * np.array([
            [12.0, 6.0 * h, -12.0, 6.0 * h], [6.0 * h, 4.0 * h**2, -6.0 * h, 2.0 * h**2],
            [-12.0, -6.0 * h, 12.0, -6.0 * h], [6.0 * h, 2.0 * h**2, -6.0 * h, 4.0 * h**2],
        ])
    )  # fmt: skip
    stiffness, load = np.zeros((2 * elements + 2, 2 * elements + 2)), np.zeros(2 * elements + 2)
    for number in range(elements):
        dofs = np.arange(2 * number, 2 * number + 4)
        stiffness[np.ix_(dofs, dofs)] += element
        load[dofs] -= WEIGHT * h * np.array([0.5, h / 12.0, 0.5, -h / 12.0])
    return stiffness, load


def complementary(stiffness: Array, load: Array, rows: Array, gaps: Array) -> Array:
    """Return the forces F >= 0 with g + G u >= 0 and F . (g + G u) = 0, by trying every set of closed planes.

    Args:
        stiffness: K, (n, n), whose rigid motions the closed planes hold.
        load: f, (n,).
        rows: G, (m, n).
        gaps: g, (m,).
    """
    count, size = len(gaps), len(load)
    for closed in product((False, True), repeat=count):
        held = np.array(closed)
        if held.sum() < 2:
            continue
        matrix = np.block([[stiffness, -rows[held].T], [rows[held], np.zeros((held.sum(), held.sum()))]])
        if np.linalg.matrix_rank(matrix) < len(matrix):
            continue
        found = np.linalg.solve(matrix, np.concatenate([load, -gaps[held]]))
        u, forces = found[:size], np.zeros(count)
        forces[held] = found[size:]
        if np.all(forces >= -1e-9) and np.all(gaps + rows @ u >= -1e-12):
            return forces
    raise AssertionError("no set of closed planes fits")


@pytest.mark.parametrize("seed", range(6))
def test_forces_are_those_of_the_complementarity_problem(seed: int) -> None:
    """Four supports out of line, with play of the size of the sag: which planes carry, and how much."""
    chance = np.random.default_rng(seed)
    places = np.array([0.05, 0.35, 0.6, 0.95])
    offsets, plays = SAG * chance.uniform(-0.3, 0.3, 4), SAG * chance.uniform(0.02, 0.3, 4)
    plan = list(zip(places, plays, offsets, strict=True))
    found = reactions([support(f"s{number}", x, c, o) for number, (x, c, o) in enumerate(plan)])
    stiffness, load = euler_bernoulli(20)
    rows, gaps = np.zeros((8, len(load))), np.empty(8)
    for number, (x, play, offset) in enumerate(plan):
        node = 2 * round(20 * x)
        rows[2 * number, node], rows[2 * number + 1, node] = 1.0, -1.0
        gaps[2 * number : 2 * number + 2] = 0.5 * play - offset, 0.5 * play + offset
    expected = complementary(stiffness, load, rows, gaps)
    names = [f"s{number}_{side}" for number in range(4) for side in ("below", "above")]
    forces = np.array([found[name] for name in names])
    assert list(forces > 0.0) == list(expected > 0.0)
    assert forces == pytest.approx(expected, rel=0.02, abs=0.005 * WEIGHT)


def test_forces_above_take_part_somewhere() -> None:
    """Of the drawn problems, some press against planes above the beam: the test before this one can tell."""
    stiffness, load = euler_bernoulli(20)
    rows, gaps = np.zeros((3, len(load))), np.array([0.0, 0.0, -SAG])
    rows[0, 2], rows[1, 38], rows[2, 20] = 1.0, 1.0, -1.0
    forces = complementary(stiffness, load, rows, gaps)
    assert np.all(forces > 0.0)
    supports = [support("left", 0.05, 1e-2), support("right", 0.95, 1e-2)]
    for one in supports:
        one |= {"region": {"type": "stop"}, "clearance": 0.0}
    above = support("high", 0.5, -SAG, region={"type": "stop", "side": "above"})
    found = reactions([*supports, above])
    assert [found[name] for name in ("left_below", "right_below", "high_above")] == pytest.approx(forces, rel=0.02)


RATTLE = {
    "model": "reduced",
    "mesh": {"size": 0.05, "cells_through_thickness": 1},
    "contact": {},
    "load": [
        {"type": "gravity"},
        {"type": "base_motion", "name": "shaker", "amplitude": 30.0, "frequency": 30.0, "ramp": 0.02},
    ],
    "time": {"end": 0.05, "step": 1.0e-4},
}


def history(case: dict[str, Any], folder: Path, *overrides: str) -> Any:
    """Return the history of a run without error estimate."""
    outcome = gapbeam.run(gapbeam.read_case(case), [*overrides, "output.errors=none"], output=folder)
    assert outcome.exit_status == 0, outcome.message
    return gapbeam.open_results(folder).history


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("model", ["full", "reduced", "beam"])
def test_one_slot_is_the_base_and_gland(model: str, tmp_path: Path) -> None:
    """A slot from x = 0, moved up by half of its clearance, is the support of the paper: equal to the last bit."""
    paper = tables([], **RATTLE) | {"support": {"length": 0.1, "clearance": 2.0e-4}, "model": model}
    slot = {"name": "front", "from": 0.0, "to": 0.1, "clearance": 2.0e-4, "offset": 1.0e-4}
    one, other = history(paper, tmp_path / "one"), history(paper | {"support": [slot]}, tmp_path / "other")
    assert other["face"].values.tolist() == ["front_below", "front_above"]
    assert float(one["contact_force"].isel(face=1).max()) > 0.0
    for name in ("displacement", "velocity", "contact_force", "penetration", "load_work"):
        np.testing.assert_array_equal(one[name].values, other[name].values)


@pytest.mark.slow(minutes=0.1)
def test_a_beam_turned_end_for_end_moves_as_before(tmp_path: Path) -> None:
    """Supports and probe mirrored about the middle: the same motion to round-off, up to the first impacts."""
    places = [(0.1, 0.15), (0.5, 0.52), (0.9, 0.95)]
    plays = (1.0e-3, 3.0e-4, 5.0e-4)

    def placed(mirrored: bool) -> list[dict[str, Any]]:
        ends = [(LENGTH - b, LENGTH - a) if mirrored else (a, b) for a, b in places]
        named = zip("abc", ends, plays, strict=True)
        return [{"name": name, "from": a, "to": round(b, 9), "clearance": c} for name, (a, b), c in named]

    runs = []
    for mirrored in (False, True):
        case = tables(placed(mirrored), **RATTLE) | {"model": "full"}
        case["time"] = {"end": 0.02, "step": 1.0e-4}
        case["probe"] = [{"name": "tip", "point": 0.4 if mirrored else 0.6}]
        runs.append(history(case, tmp_path / str(mirrored)))
    one, other = (run["displacement"].values[:, 0, 1] for run in runs)
    assert np.abs(one - other).max() < 1e-7 * np.abs(one).max()
    forces = [run["contact_force"].sel(face=name).max().item() for run in runs for name in ("a_below", "c_below")]
    assert min(forces) > 0.0


@pytest.mark.parametrize("model", ["full", "reduced"])
def test_models_agree_on_the_seat(model: str) -> None:
    """Mesh, basis and beam elements sit alike in three slots, of which one is out of line."""
    supports = [support("left", 0.1), support("middle", 0.5, offset=2.0e-4), support("right", 0.9)]
    case = tables(supports) | {"mesh": {"size": 0.01, "support_size": 0.5e-3, "cells_through_thickness": 2}}
    forces = []
    for kind in (model, {"type": "beam", "elements": 200}):
        simulation = gapbeam.model(gapbeam.read_case(case | {"model": kind}))
        found = describe_seat(simulation.seat(), simulation.model)
        forces.append([found[f"{name}_below_force"] for name in ("left", "middle", "right")])
    assert forces[0] == pytest.approx(forces[1], rel=0.01)


def test_a_beam_that_tips_over_has_no_seat() -> None:
    """One stop below, up to x = 0.3: a beam of 1 m falls off, and one held down on the other side by a mass rests.

    Source: the center of mass, at 0.5 m without the mass and at 0.2 m with three times the beam's mass at 0.1 m.
    """
    stop = {"name": "stop", "from": 0.0, "to": 0.3, "clearance": 1.0e-4, "region": {"type": "stop"}}
    simulation = gapbeam.model(gapbeam.read_case(tables([stop])))
    with pytest.raises(gapbeam.NotConverged, match=r"tips it about x = 0\.3 m, with its end at x = 1 m down"):
        simulation.seat()
    heavy = 3.0 * WEIGHT * LENGTH / GRAVITY
    held = tables([stop], mass=[{"name": "block", "point": 0.1, "mass": heavy}])
    simulation = gapbeam.model(gapbeam.read_case(held))
    found = describe_seat(simulation.seat(), simulation.model)
    assert found["stop_below_force"] == pytest.approx(4.0 * WEIGHT * LENGTH, rel=1e-6)
