"""Joints and masses: frequencies by transfer matrices, statics by hand, oscillators in closed form."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from mpi4py import MPI
from scipy.linalg import expm
from scipy.optimize import brentq

import gapbeam
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.models.model import Model, build_model
from gapbeam.solver.seat.contact_modes import held_modes
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import VALUE

LENGTH, THICKNESS, WIDTH = 0.6, 0.012, 0.02
YOUNG, POISSON, DENSITY, GRAVITY = 2.1e11, 0.3, 7919.0, 9.81
AREA, SECOND = WIDTH * THICKNESS, WIDTH * THICKNESS**3 / 12.0
BENDING = YOUNG * SECOND
SHEAR = 10.0 * (1.0 + POISSON) / (12.0 + 11.0 * POISSON) * YOUNG / (2.0 * (1.0 + POISSON)) * AREA  # Cowper (1966)
HEAD, INERTIA = 0.3, 1.0e-4  # kg, kg m^2
SPRING, TURN = 2.0e5, 4.0e3  # N/m, N m/rad
FINE: dict[str, Any] = {"type": "beam", "elements": 200}
ROOT, TIP = 0.0, LENGTH


def tables(model: dict[str, Any] | None = None, **more: Any) -> dict[str, Any]:
    """Return a steel beam in a slot that it does not touch."""
    return {
        "beam": {"length": LENGTH, "thickness": THICKNESS, "width": WIDTH},
        "material": {"young_modulus": YOUNG, "poisson_ratio": POISSON, "density": DENSITY},
        "support": [{"name": "far", "from": 0.30, "to": 0.32, "clearance": 9.0e-3}],
        "mesh": {"size": 0.012, "cells_through_thickness": 2},
        "model": model or FINE,
        "probe": [{"name": "tip", "point": LENGTH}],
        "time": {"end": 0.1, "step": 1.0e-4},
        **more,
    }


def joint(point: float, kind: str, **more: Any) -> dict[str, Any]:
    """Return a joint."""
    return {"name": "root" if point == ROOT else "end", "type": kind, "point": point, **more}


def model_with(*joints: dict[str, Any], **more: Any) -> Model:
    """Return the model of a beam with joints."""
    return build_model(gapbeam.read_case(tables(joint=list(joints), **more)), MPI.COMM_SELF)


def frequencies(model: Model) -> Array:
    """Return the frequencies of a small model, ascending, Hz."""
    assert isinstance(model.system.operators, DenseOperators)
    return np.asarray(np.sqrt(np.maximum(model.system.operators.modes[0], 0.0)) / (2.0 * np.pi))


# Rows that the state (w, theta, M, Q) of an end has to fulfil: A + B s + C s^2 with s = (2 pi f)^2.
HELD = {"clamped": (0, 1), "pinned": (0, 2), "guided": (1, 3), "free": (2, 3)}


def conditions(kind: str) -> Array:
    """Return the two rows of an end, (2, 4)."""
    return np.identity(4)[list(HELD[kind])]


def of_theory(start: Array, end: Any, most: float = 3000.0, count: int = 4) -> Array:
    """Return the frequencies of a Timoshenko beam by its transfer matrix, Hz.

        w' = theta + Q / (kappa G A),  theta' = M / (E I),  M' = -Q - rho I s theta,  Q' = -rho A s w,   s = (2 pi f)^2

    Args:
        start: Rows of the state at x = 0, (2, 4).
        end: Rows at x = L, (2, 4), as a function of s.
        most: Frequency at which the search stops, Hz.
        count: Number of frequencies.
    """
    free = np.linalg.svd(start)[2][2:].T

    def missed(frequency: float) -> float:
        s = (2.0 * np.pi * frequency) ** 2
        field = np.array(
            [
                [0.0, 1.0, 0.0, 1.0 / SHEAR],
                [0.0, 0.0, 1.0 / BENDING, 0.0],
                [0.0, -DENSITY * SECOND * s, 0.0, -1.0],
                [-DENSITY * AREA * s, 0.0, 0.0, 0.0],
            ]
        )
        return float(np.linalg.det(end(s) @ expm(field * LENGTH) @ free))

    places = np.linspace(2.0, most, 1500)
    values = [missed(place) for place in places]
    found = [
        brentq(missed, one, other, xtol=1e-10, rtol=1e-13)
        for one, other, before, after in zip(places, places[1:], values, values[1:], strict=False)
        if before * after < 0.0
    ]
    return np.array(found[:count])


@pytest.mark.parametrize(
    ("left", "right"),
    [("clamped", "free"), ("clamped", "pinned"), ("clamped", "clamped"), ("pinned", "pinned"), ("clamped", "guided")],
)
def test_frequencies_of_beams_with_joints(left: str, right: str) -> None:
    """Two frequencies to 1e-6 by beam elements."""
    joints = [joint(place, kind) for place, kind in ((ROOT, left), (TIP, right)) if kind != "free"]
    theory = of_theory(conditions(left), lambda _: conditions(right), 700.0, 2)
    found = frequencies(model_with(*joints))
    np.testing.assert_allclose(found[: len(theory)], theory, rtol=1e-6)


def test_pinned_beams_have_frequencies_in_closed_form() -> None:
    """Both ends pinned: the transfer matrix of this file itself, against the quadratic equation of Timoshenko."""
    wave = np.pi / LENGTH
    a = DENSITY * SECOND * DENSITY * AREA / SHEAR
    b = -(DENSITY * AREA + wave**2 * (DENSITY * SECOND + DENSITY * AREA * BENDING / SHEAR))
    square = (-b - np.sqrt(b * b - 4.0 * a * BENDING * wave**4)) / (2.0 * a)
    theory = of_theory(conditions("pinned"), lambda _: conditions("pinned"), 100.0, 1)
    assert theory[0] == pytest.approx(np.sqrt(square) / (2.0 * np.pi), rel=1e-9)


def test_frequencies_with_springs_and_a_head() -> None:
    """A beam on springs against displacement and rotation at one end, with a mass and its inertia at the other."""
    start = np.array([[SPRING, 0.0, 0.0, -1.0], [0.0, TURN, -1.0, 0.0]])

    def end(s: float) -> Array:
        return np.array([[HEAD * s, 0.0, 0.0, -1.0], [0.0, INERTIA * s, 0.0, 0.0]]) + np.array(
            [[0.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0]]
        )

    theory = of_theory(start, end, 700.0, 3)
    springs = joint(ROOT, "elastic", stiffness={"vertical": SPRING, "rotation": TURN})
    head = {"name": "head", "point": TIP, "mass": HEAD, "rotary_inertia": INERTIA}
    np.testing.assert_allclose(frequencies(model_with(springs, mass=[head]))[:3], theory, rtol=2e-6)


def test_a_pin_with_a_spring_against_rotation() -> None:
    """Two joints in one place act on different motions: beam elements by the theory, the solid within 1 %."""
    start = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, TURN, -1.0, 0.0]])
    theory = of_theory(start, lambda _: conditions("free"), 700.0, 3)
    joints = joint(ROOT, "pinned"), joint(ROOT, "elastic", stiffness={"rotation": TURN}) | {"name": "spring"}
    np.testing.assert_allclose(frequencies(model_with(*joints))[:3], theory, rtol=2e-6)
    solid = model_with(*joints, model={"type": "reduced"}, mesh={"size": 0.02, "cells_through_thickness": 2})
    np.testing.assert_allclose(held_modes(solid, 3)[0].bending()[0][:3], theory, rtol=1e-2)


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_solid_agrees_with_its_beam(dimension: int) -> None:
    """Clamped and pinned: the reduced solid within 1 % of the theory in bending."""
    mesh = {"size": 0.02, "cells_through_thickness": 2, "dimension": dimension}
    model = model_with(
        joint(ROOT, "clamped"), joint(TIP, "pinned"), model={"type": "reduced"}, mesh=mesh
    )  # fmt: skip
    theory = of_theory(conditions("clamped"), lambda _: conditions("pinned"), 700.0, 2)
    found = held_modes(model, 2)[0].bending()[0]
    np.testing.assert_allclose(found[:2], theory, rtol=1e-2)


def sag(model: dict[str, Any]) -> float:
    """Return how far the tip of a cantilever with a head sags at the seat, m."""
    head = {"name": "head", "point": TIP, "mass": HEAD, "rotary_inertia": INERTIA}
    loads = [{"type": "gravity", "acceleration": GRAVITY}]
    case = tables(model, joint=[joint(ROOT, "clamped")], mass=[head], load=loads)
    simulation = gapbeam.model(gapbeam.read_case(case))
    seat = simulation.seat()
    found = simulation.model.probes["tip"].evaluate(seat.state.u[0], simulation.model.system.operators)
    return -float(found[-1])


def test_the_sag_of_a_cantilever() -> None:
    """Own weight and weight of the head, by bending and shear; full = reduced.

    w = rho A g L^4 / 8 E I + m g L^3 / 3 E I + (rho A L / 2 + m) g L / kappa G A
    """
    line, weight = DENSITY * AREA * GRAVITY, HEAD * GRAVITY
    bent = (line * LENGTH**4 / 8.0 + weight * LENGTH**3 / 3.0) / BENDING
    sheared = (line * LENGTH**2 / 2.0 + weight * LENGTH) / SHEAR
    assert sag(FINE) == pytest.approx(bent + sheared, rel=1e-7)
    full, reduced = sag({"type": "full"}), sag({"type": "reduced"})
    assert full == pytest.approx(bent + sheared, rel=3e-3)
    assert reduced == pytest.approx(full, rel=1e-5)


def test_gravity_and_base_motion_act_on_masses_alike() -> None:
    """In the frame of a base that accelerates upward by 1 m/s^2 the forces are those of a gravity of 1 m/s^2."""
    head = {"name": "head", "point": 0.45, "mass": HEAD, "rotary_inertia": INERTIA}
    shaker = {"type": "base_motion", "name": "shaker", "amplitude": 1.0, "frequency": 10.0}
    for kind in ({"type": "beam", "elements": 24}, {"type": "reduced"}):
        model = model_with(joint(ROOT, "clamped"), mass=[head], load=[{"type": "gravity"}, shaker], model=kind)
        gravity, base = (load.pattern for load in model.system.loads)
        np.testing.assert_allclose(base, gravity, rtol=0.0, atol=1e-12 * np.abs(gravity).max())
        lifted = model.body.patterns[0]  # without the head
        assert np.abs(lifted - gravity).max() > 0.01 * np.abs(gravity).max()


@pytest.mark.slow(minutes=0.1)
def test_a_rigid_beam_on_springs_and_dampers_is_an_oscillator() -> None:
    """Two equal joints at the ends: heave decays with c / 2 m at sqrt(k / m - (c / 2 m)^2) from a sag of m g / k."""
    stiffness, damping = 4.0e4, 6.0
    mass = DENSITY * AREA * LENGTH
    joints = [
        joint(place, "elastic", stiffness={"vertical": stiffness / 2.0}, damping={"vertical": damping / 2.0})
        for place in (ROOT, TIP)
    ]
    case = tables(
        {"type": "rigid"},
        joint=joints,
        load=[{"type": "gravity", "acceleration": GRAVITY}],
        analysis={"type": "transient", "start": "undeformed"},
        time={"end": 0.2, "step": 2.0e-5},
    )
    model = gapbeam.model(gapbeam.read_case(case))
    steps = [step.new for step in model.march()]
    operators = model.model.system.operators
    heights = np.array([model.model.probes["tip"].evaluate(state.u[0], operators)[-1] for state in steps])
    times = np.array([state.time for state in steps])
    fades, rest = damping / (2.0 * mass), mass * GRAVITY / stiffness
    turns = np.sqrt(stiffness / mass - fades**2)
    theory = rest * (np.exp(-fades * times) * (np.cos(turns * times) + fades / turns * np.sin(turns * times)) - 1.0)
    assert np.abs(heights - theory).max() < 1e-4 * rest


@pytest.mark.parametrize("scale", [1e-3, 1.0, 100.0])
def test_a_spring_beside_a_pin_leaves_no_sideways_motion_in_a_symmetric_solid(scale: float) -> None:
    """Pitch and sideways motions have frequency 0 alike; round-off mixed them, and a large boom had no seat.

    The solid hangs on a spring at its end and lies on a soft stop, as its slice does, which cannot move sideways.
    """
    area, places = (scale * THICKNESS) * (scale * WIDTH), (0.30 * scale, 0.32 * scale)
    stiff = DENSITY * area * scale * LENGTH * GRAVITY / (2e-4 * scale)  # N/m: the weight sinks by a share of the length
    given = tables(
        load=[{"type": "gravity"}],
        joint=[joint(ROOT, "pinned"), joint(TIP * scale, "elastic", stiffness={"vertical": stiff})],
        support=[{"name": "far", "from": places[0], "to": places[1], "clearance": 1e-5 * scale, "region": "stop",
                  "support_stiffness": stiff}],
        probe=[{"name": "mid", "point": places[0]}],
        model={"type": "reduced"},
    )  # fmt: skip
    given["beam"] = {key: scale * value for key, value in given["beam"].items()}
    sizes = {"size": 0.05 * scale, "support_size": 0.02 * scale, "cells_through_thickness": 1}
    seats, lowest = [], []
    for dimension in (2, 3):
        case = gapbeam.read_case(given | {"mesh": sizes | {"dimension": dimension}})
        simulation = Simulation(build_model(case, MPI.COMM_SELF))
        row, operators = simulation.model.probes["mid"], simulation.model.system.operators
        seats.append(float(row.evaluate(simulation.seat().state.u[VALUE], operators)[-1]))
        lowest.append(frequencies(simulation.model)[:4])
    assert lowest[1] == pytest.approx(lowest[0], rel=0.01)
    assert seats[1] == pytest.approx(seats[0], rel=0.01)
    assert seats[0] < -2e-5 * scale  # on the stop
