"""Starts with velocity and rotation vectors: a rigid body by hand, in every model that has the directions."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import gapbeam
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.system.semi_discrete import VALUE, State

LENGTH, THICKNESS, WIDTH, DENSITY, GRAVITY = 0.2, 0.02, 0.03, 7850.0, 9.81
MASS = DENSITY * LENGTH * THICKNESS * WIDTH
SQUARES = np.array([LENGTH, WIDTH, THICKNESS]) ** 2  # along x, y, z
INERTIA = MASS / 12.0 * (np.sum(SQUARES) - SQUARES)
CENTER = np.array([0.5 * LENGTH, 0.0, 0.0])
PLACES = {"end": np.zeros(3), "tip": np.array([LENGTH, 0.0, 0.0]), "corner": np.array([LENGTH, 0.015, 0.01])}
VECTORS = {
    "displacement": [1.0e-4, -2.0e-4, 3.0e-4],
    "rotation": [1.0e-3, 2.0e-4, -3.0e-4],
    "velocity": [0.03, 0.02, -0.01],
    "spin": [0.3, -0.2, 0.1],
}


def tables(model: dict[str, Any], motion: dict[str, Any], **more: Any) -> dict[str, Any]:
    """Return a steel block in a wide slot in its middle, without weight and hardly restrained."""
    return {
        "beam": {"length": LENGTH, "thickness": THICKNESS, "width": WIDTH},
        "material": {"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": DENSITY},
        "support": [{"name": "slot", "from": 0.08, "to": 0.12, "clearance": 4.0e-3}],
        "restraint": {"axial": 1.0e-6, "lateral": 1.0e-6},
        "mesh": {"dimension": 3, "size": 0.04, "cells_through_thickness": 2, "cells_across_width": 2},
        "model": model,
        "probe": [{"name": name, "point": list(map(float, place))} for name, place in PLACES.items()],
        "load": [],
        "analysis": {"type": "transient", "start": "undeformed", "motion": motion},
        "time": {"end": 1.0e-3, "step": 1.0e-4},
        **more,
    }


def probed(simulation: Simulation, state: State, part: str) -> dict[str, np.ndarray]:
    """Return displacement or velocity of all probes."""
    operators = simulation.model.system.operators
    return {name: row.evaluate(getattr(state, part)[VALUE], operators) for name, row in simulation.model.probes.items()}


def started(case: dict[str, Any]) -> tuple[Simulation, State]:
    """Return a simulation and its start."""
    simulation = gapbeam.model(gapbeam.read_case(case))
    return simulation, simulation.start(simulation.seat_or_failure())


@pytest.mark.parametrize("model", ["rigid", "full", "reduced", "beam"])
def test_a_body_spins_and_flies_by_its_vectors(model: str) -> None:
    """At the start u = t + w x (X - p), later u + v t; the energy is that of mass and moments of inertia."""
    modes = {"modes": 4} if model == "reduced" else {}
    simulation, start = started(tables({"type": model, **modes}, VECTORS))
    shift, turn, speed, spin = (np.array(VECTORS[name]) for name in ("displacement", "rotation", "velocity", "spin"))
    *_, last = simulation.march(start)
    for name, place in PLACES.items():
        moved, rate = shift + np.cross(turn, place - CENTER), speed + np.cross(spin, place - CENTER)
        np.testing.assert_allclose(probed(simulation, start, "u")[name], moved, atol=1e-12)
        np.testing.assert_allclose(probed(simulation, start, "v")[name], rate, atol=1e-10)
        np.testing.assert_allclose(probed(simulation, last.new, "u")[name], moved + 1e-3 * rate, atol=1e-10)
    energy = 0.5 * float(start.v[0] @ start.v[1])
    assert energy == pytest.approx(0.5 * MASS * speed @ speed + 0.5 * INERTIA @ spin**2, rel=1e-8)


def test_a_beam_in_space_flies_sideways() -> None:
    """A beam of elements bends across its plane because its start asks for it; its motion is that of its axis."""
    motion = {"velocity": [0.0, 0.02, -0.01], "spin": [0.0, -0.2, 0.1], "point": [0.0, 0.0, 0.0]}
    simulation, start = started(tables({"type": "beam", "elements": 8}, motion))
    *_, last = simulation.march(start)
    for name in ("end", "tip"):
        rate = np.array(motion["velocity"]) + np.cross(motion["spin"], PLACES[name])
        np.testing.assert_allclose(probed(simulation, start, "v")[name], rate, atol=1e-12)
        np.testing.assert_allclose(probed(simulation, last.new, "u")[name], 1e-3 * rate, atol=1e-10)


def test_a_rotation_leaves_its_point() -> None:
    """The named point stays in its place, beside the axis too."""
    motion = {"rotation": [1.0e-3, 2.0e-4, -3.0e-4], "point": [LENGTH, 0.015, 0.01]}
    simulation, start = started(tables({"type": "rigid"}, motion))
    np.testing.assert_allclose(probed(simulation, start, "u")["corner"], 0.0, atol=1e-15)
    assert np.all(probed(simulation, start, "u")["end"] != 0.0)


def test_numbers_and_vectors_say_the_same() -> None:
    """Lift, tilt, velocity and spin are components of the vectors; a slice has [x, y]."""
    numbers = {"lift": 1.0e-4, "tilt": 2.0e-4, "velocity": 0.02, "spin": -0.05}
    vectors = {
        "displacement": [0.0, 0.0, 1.0e-4],
        "rotation": [0.0, -2.0e-4, 0.0],
        "velocity": [0.0, 0.0, 0.02],
        "spin": [0.0, 0.05, 0.0],
    }
    one, other = (started(tables({"type": "rigid"}, motion))[1] for motion in (numbers, vectors))
    np.testing.assert_array_equal(one.u, other.u)
    np.testing.assert_array_equal(one.v, other.v)
    slice_mesh = {"mesh": {"dimension": 2}, "probe": [{"name": "tip", "point": LENGTH}]}
    simulation, start = started(tables({"type": "rigid"}, {"velocity": [0.03, 0.02]}, **slice_mesh))
    np.testing.assert_allclose(probed(simulation, start, "v")["tip"], [0.03, 0.02], rtol=1e-12)


def test_a_projectile() -> None:
    """Thrown upward and sideways, the block flies along z = v t - g t^2 / 2, y = u t."""
    load = [{"type": "gravity", "acceleration": GRAVITY}]
    motion = {"velocity": [0.0, 0.05, 0.1]}
    simulation, start = started(tables({"type": "rigid"}, motion, load=load, time={"end": 0.01, "step": 1.0e-3}))
    for step in simulation.march(start):
        t = step.new.time
        found = probed(simulation, step.new, "u")["tip"]
        np.testing.assert_allclose(found, [0.0, 0.05 * t, 0.1 * t - 0.5 * GRAVITY * t**2], atol=1e-10)


def test_a_ball_between_two_plates() -> None:
    """Started in the middle with v, it touches after c / 2 v, and then once in c / v and half a period on the contact.

    The contact is a spring K of the whole face: it throws the body back after pi (m / K)^(1/2).
    """
    clearance, speed, stiffness = 1.0e-3, 0.5, 1.0e12
    case = tables({"type": "rigid"}, {"velocity": speed}, mesh={"dimension": 2})
    case |= {"probe": [{"name": "tip", "point": LENGTH}], "time": {"end": 0.012, "step": 1.0e-6}}
    case["support"] = [{"name": "plates", "from": 0.08, "to": 0.12, "clearance": clearance}]
    case |= {"contact": {"stiffness": stiffness}}
    case["analysis"]["start"] = "centered"
    simulation, start = started(case)
    contact = simulation.model.system.contact
    assert np.max(np.abs(contact.initial_gap - 0.5 * clearance)) < 1e-15
    closed, touches = False, []
    for step in simulation.march(start):
        pressed = bool(np.any(step.new.pressure > 0.0))
        if pressed and not closed:
            touches.append(step.new.time)
        closed = pressed
    thrown = np.pi * np.sqrt(MASS / (stiffness * 0.04 * WIDTH))
    wanted = 0.5 * clearance / speed + np.arange(6) * (clearance / speed + thrown)
    np.testing.assert_allclose(touches, wanted[wanted < 0.012], atol=3e-6)
    energy = 0.5 * float(step.new.v[0] @ step.new.v[1])
    assert energy == pytest.approx(0.5 * MASS * speed**2, rel=1e-6)


def test_a_tube_flies_from_the_middle_of_its_hole_to_the_wall() -> None:
    """Centered in a hole that is beside and above its axis, thrown sideways: it is at the wall after c / v.

    Contact points lie up to 10 degrees beside the direction of flight, which makes that up to 1.6 % later.
    """
    clearance, speed, aside, above = 2.0e-4, 0.1, 5.0e-5, 8.0e-5
    hole = {"region": "hole", "clearance": clearance, "lateral": aside, "offset": above}
    case = tables({"type": "rigid"}, {"velocity": [0.0, speed, 0.0]}, time={"end": 3.0e-3, "step": 1.0e-5})
    case |= {"beam": {"length": LENGTH, "thickness": THICKNESS, "width": THICKNESS, "section": "round"}}
    case["support"] = [{"name": "hole", "from": 0.08, "to": 0.12, **hole}]
    case |= {"probe": [{"name": "tip", "point": LENGTH}]}
    case["analysis"]["start"] = "centered"
    simulation, start = started(case)
    tip = probed(simulation, start, "u")["tip"]
    np.testing.assert_allclose(tip, [0.0, aside, above], atol=1e-15)
    touched = next(step.new for step in simulation.march(start) if np.any(step.new.pressure > 0.0))
    assert clearance / speed - 1e-5 < touched.time < 1.016 * clearance / speed + 1e-5
    moved = [0.0, aside + speed * touched.time, above]
    np.testing.assert_allclose(probed(simulation, touched, "u")["tip"], moved, atol=1e-6)
