"""Starts in a vibration mode: linear beams stay in the mode, at its frequency, with its energy."""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
import pytest

import gapbeam
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.seat.contact_modes import free_bending_modes
from gapbeam.solver.system.semi_discrete import VALUE, State
from tests.shared.case_texts import assert_says

LENGTH, AMPLITUDE = 0.5, 1.0e-4
CANTILEVER = (1.875104068711961, 4.694091132974175, 7.854757438237612)  # roots of 1 + cos x cosh x


def tables(model: dict[str, Any], mode: dict[str, Any], **more: Any) -> dict[str, Any]:
    """Return a cantilever without weight and damping, far from a stop."""
    return {
        "beam": {"length": LENGTH, "thickness": 0.01, "width": 0.02},
        "material": {"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": 7850.0},
        "joint": [{"name": "root", "type": "clamped", "point": 0.0}],
        "support": [{"name": "stop", "from": 0.4, "to": 0.42, "clearance": 5.0e-3, "region": "stop"}],
        "mesh": {"size": 0.025, "support_size": 0.01, "cells_through_thickness": 2},
        "model": model,
        "probe": [{"name": "tip", "point": LENGTH}, {"name": "middle", "point": 0.25}],
        "load": [],
        "analysis": {
            "type": "transient",
            "start": "undeformed",
            "mode": {"amplitude": AMPLITUDE, "probe": "tip"} | mode,
        },
        "time": {"end": 0.01, "step": 5.0e-6},
        **more,
    }


def started(case: dict[str, Any]) -> tuple[Simulation, State]:
    """Return a simulation and its start."""
    simulation = gapbeam.model(gapbeam.read_case(case))
    return simulation, simulation.start(simulation.seat_or_failure())


def tip_of(simulation: Simulation, state: State, part: str = "u") -> float:
    """Return displacement or velocity of the tip along the bending direction."""
    row = simulation.model.probes["tip"]
    return float(row.evaluate(getattr(state, part)[VALUE], simulation.model.system.operators)[-1])


def shares(simulation: Simulation, state: State, number: int) -> tuple[float, float]:
    """Return the modal coordinate of a bending mode and the largest of all other modes."""
    operators = simulation.model.system.operators
    found = free_bending_modes(simulation.model, number)
    chosen = [place for place, motion in enumerate(found.motions) if motion.kind == "bending"][number - 1]
    sizes = np.array(
        [
            float(shape @ operators.apply_mass(state.u[VALUE])) / np.sqrt(float(shape @ operators.apply_mass(shape)))
            for shape in np.ascontiguousarray(found.shapes.T)
        ]
    )
    return float(sizes[chosen]), float(np.max(np.abs(np.delete(sizes, chosen))))


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("number", [1, 2, 3])
@pytest.mark.parametrize("model", ["beam", "reduced"])
def test_a_cantilever_stays_in_its_mode(model: str, number: int) -> None:
    """Other modes stay below 1e-8 of it; frequency by the tip, energy w^2 a^2 m / 2 with m of the shape."""
    simulation, start = started(tables({"type": model}, {"number": number}))
    operators = simulation.model.system.operators
    assert tip_of(simulation, start) == pytest.approx(AMPLITUDE, rel=1e-12)
    frequency = float(free_bending_modes(simulation.model, number).bending()[0][number - 1])
    theory = CANTILEVER[number - 1] ** 2 / (2 * pi * LENGTH**2) * np.sqrt(2.1e11 * 0.01**2 / 12 / 7850.0)
    assert frequency == pytest.approx(theory, rel=6e-3 * number)
    shape = start.u[VALUE] / AMPLITUDE
    energy = 0.5 * (2 * pi * frequency * AMPLITUDE) ** 2 * float(shape @ operators.apply_mass(shape))
    assert 0.5 * float(start.u[0] @ start.u[2]) == pytest.approx(energy, rel=1e-8)
    rows, last = [(0.0, AMPLITUDE)], start
    for step in simulation.march(start):
        rows.append((step.new.time, tip_of(simulation, step.new)))
        last = step.new
    _, others = shares(simulation, last, number)
    whole, _ = shares(simulation, start, number)
    assert others < 1e-8 * abs(whole)
    times, heights = np.transpose(rows)
    # the scheme is the midpoint rule where nothing touches: tan(w' dt / 2) = w dt / 2
    marched = 2.0 / 5.0e-6 * np.arctan(pi * frequency * 5.0e-6)
    np.testing.assert_allclose(heights, AMPLITUDE * np.cos(marched * times), atol=1e-8 * AMPLITUDE)
    kept = 0.5 * float(last.u[0] @ last.u[2] + last.v[0] @ last.v[1])
    assert kept == pytest.approx(energy, rel=1e-8)


def test_a_phase_begins_with_the_velocity() -> None:
    """At 90 degrees the pose is undeformed and the tip has the velocity w a; at 60, both parts."""
    for phase in (90.0, 60.0):
        simulation, start = started(tables({"type": "beam"}, {"number": 1, "phase": phase}))
        omega = 2 * pi * float(free_bending_modes(simulation.model, 1).bending()[0][0])
        angle = np.radians(phase)
        assert tip_of(simulation, start) == pytest.approx(AMPLITUDE * np.cos(angle), abs=1e-12 * AMPLITUDE)
        assert tip_of(simulation, start, "v") == pytest.approx(omega * AMPLITUDE * np.sin(angle), rel=1e-12)


@pytest.mark.slow(minutes=0.1)
def test_a_full_model_and_a_round_bar_in_space_begin_in_a_mode_of_the_plane() -> None:
    """A full slice; and a round bar, whose modes in two planes share a frequency: it does not move sideways."""
    simulation, start = started(tables({"type": "full"}, {"number": 1}))
    assert tip_of(simulation, start) == pytest.approx(AMPLITUDE, rel=1e-9)
    size, others = shares(simulation, start, 1)
    assert others < 1e-8 * abs(size)
    beam = {"length": LENGTH, "thickness": 0.01, "width": 0.01, "section": "round"}
    hole = [{"name": "hole", "from": 0.4, "to": 0.42, "clearance": 2.0e-4, "region": "hole"}]
    case = tables({"type": "beam", "elements": 20}, {"number": 2}, beam=beam, support=hole, mesh={"dimension": 3})
    simulation, start = started(case)
    moved = simulation.model.probes["tip"].evaluate(start.u[VALUE], simulation.model.system.operators)
    np.testing.assert_allclose(moved, [0.0, 0.0, AMPLITUDE], atol=1e-9 * AMPLITUDE)


def test_rigid_modes_and_nodes_are_refused() -> None:
    """A free beam's first two modes are rigid motions; a probe at a node says nothing about the amplitude."""
    free = tables({"type": "beam"}, {"number": 2}, joint=[])
    with pytest.raises(gapbeam.UserError) as caught:
        started(free)
    assert_says(str(caught.value), ["number = 2 is a rigid motion", "number = 3"])
    even = {"type": "beam", "elements": 102}  # of equal length: the mode is as antisymmetric as the beam
    free = tables(even, {"number": 4, "probe": "middle"}, joint=[])
    with pytest.raises(gapbeam.UserError) as caught:
        started(free)
    assert_says(str(caught.value), ["mode 4", "has a node there"])


def test_a_mode_that_reaches_into_a_face_is_refused() -> None:
    """With the stop in the way of the amplitude, nothing starts."""
    with pytest.raises(gapbeam.UserError) as caught:
        started(tables({"type": "beam"}, {"number": 1, "amplitude": -0.02}))
    assert_says(str(caught.value), ["[analysis.mode]", "into stop_below", "expected a start between the faces"])


def test_more_modes_than_the_model_has_are_refused() -> None:
    """The message says how many there are."""
    with pytest.raises(gapbeam.UserError) as caught:
        started(tables({"type": "beam", "elements": 4}, {"number": 500}))
    assert_says(str(caught.value), ["bending mode 500 was asked for", "expected 1 to"])
