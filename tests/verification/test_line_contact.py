"""Round sections that meet flat walls along lines: against the integral over the section, and against many points.

Of a rigid cylinder of the radius R that is d deep in a plane, what lies at an angle t from the plane's normal is
R cos t - (R - d) deep; a foundation presses it, along the length b, with

    F = b R int <K (d - R (1 - cos t)) + c d'> dt
"""

from __future__ import annotations

from math import acos, ceil, cos, radians, sin
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpi4py import MPI
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

import gapbeam
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.model_choice import bending_wavelength, line_radii
from gapbeam.solver.case.solution_tables import BeamModel, RigidModel
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.models.model import build_model
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import VALUE
from gapbeam.studies.error_estimate.companions import FINEST, companions_of
from gapbeam.studies.trials.response import respond
from gapbeam.studies.trials.starts import seated

LENGTH, DIAMETER, WALL = 0.06, 0.02, 0.002  # m
RADIUS, CLEARANCE, STIFFNESS, SPEED = 0.5 * DIAMETER, 1.0e-5, 2.0e11, 0.2  # m, m, Pa/m, m/s
DENSITY, STEP, LASTS = 8000.0, 1.0e-6, 3.0e-4  # kg/m^3, s, s
MASS = DENSITY * np.pi * (RADIUS**2 - (RADIUS - WALL) ** 2) * LENGTH
STATIONS = {"type": "beam", "stations": 2}
RIGID_SECTIONS = {"type": "reduced", "sections": "rigid", "stations": 2}


def tube(walls: list[float], model: Any = STATIONS, **tables: Any) -> Simulation:
    """Return a stiff tube that lies along flat walls all of its length."""
    return gapbeam.model(tables_of(walls, model, **tables))


def tables_of(walls: list[float], model: Any = STATIONS, **tables: Any) -> dict[str, Any]:
    """Return the tables of such a tube."""
    mesh = {"dimension": 3, "size": 0.03, "support_size": 0.03, "cells_through_thickness": 4, "cells_across_width": 4}
    return {
            "beam": {
                "length": LENGTH, "thickness": DIAMETER, "width": DIAMETER, "section": {"type": "tube", "wall": WALL}
            },
            "material": {"young_modulus": 1.0e15, "poisson_ratio": 0.3, "density": DENSITY},
            "support": [
                {
                    "name": "plate", "from": 0.0, "to": LENGTH, "clearance": CLEARANCE,
                    "region": {"type": "polygon", "walls": walls},
                }
            ],
            "model": model,
            "mesh": mesh,
            "contact": {"stiffness": STIFFNESS},
            "restraint": {"axial": 1.0},
            "probe": [{"name": "mid", "point": 0.5 * LENGTH}],
            "time": {"end": 2.0e-3, "step": 1.0e-6},
        **tables,
    }  # fmt: skip


def resultant(depth: float, rate: float = 0.0, damping: float = 0.0, whole: bool = False) -> float:
    """Return F of a tube that is so deep in a wall and moves deeper at a rate, by quadrature, N.

    Damping does not pull anywhere; or, where it is clipped on the whole, it pulls at most as much as the rest presses.
    """
    if depth <= 0.0:
        return 0.0

    def pressed(t: float) -> float:
        pressure = STIFFNESS * (depth - RADIUS * (1.0 - cos(t))) + damping * rate
        return pressure if whole else max(pressure, 0.0)

    half = acos(1.0 - depth / RADIUS)
    return 2.0 * LENGTH * RADIUS * max(float(quad(pressed, 0.0, half, epsrel=1.0e-9)[0]), 0.0)


def seat(simulation: Simulation) -> Array:
    """Return where the axis rests across the beam, (2,), m."""
    u = simulation.seat().state.u[VALUE]
    return np.asarray(simulation.model.probes["mid"].evaluate(u, simulation.model.system.operators))[1:]


def weighed(force: float, turn: float) -> list[dict[str, Any]]:
    """Return a weight of a force that pulls at an angle from straight down, degrees."""
    pulled = [0.0, sin(radians(turn)), -cos(radians(turn))]
    return [{"type": "gravity", "acceleration": force / MASS, "direction": pulled}]


@pytest.mark.parametrize("model", [STATIONS, pytest.param(RIGID_SECTIONS, marks=pytest.mark.slow(minutes=0.2))])
@given(st.integers(2, 6), st.floats(-0.3, 0.3), st.floats(1.0, 1.0e3))
@settings(max_examples=4, deadline=None, derandomize=True)
def test_a_tube_rests_on_drawn_walls(model: Any, count: int, aside: float, force: float) -> None:
    """Two to six walls, pulled between two of them: forces by statics, depths by the integral, and one point a wall."""
    apart = min(360.0 / count, 120.0)
    walls = [-0.5 * apart + 360.0 * number / max(count, 3) for number in range(count)]
    walls = [(angle + 180.0) % 360.0 - 180.0 for angle in walls]
    turn = aside * 0.5 * apart
    simulation = tube(walls, model, load=weighed(force, turn))
    assert simulation.model.system.contact.size == 2 * count
    normals = np.array([[sin(t), -cos(t)] for t in np.radians(walls)])
    pull = np.array([sin(radians(turn)), -cos(radians(turn))])
    carrying = np.argsort(normals @ pull)[-2:]
    shares = np.linalg.solve(normals[carrying].T, force * pull)
    assert np.all(shares > 0.0)
    depths = [brentq(lambda d, share=share: resultant(d) - share, 0.0, 1.0e-3, xtol=1.0e-12) for share in shares]
    moved = normals[carrying] @ seat(simulation) - CLEARANCE
    assert moved == pytest.approx(depths, rel=1.0e-4 + max(depths) / RADIUS)


@pytest.mark.slow(minutes=0.2)
@pytest.mark.parametrize(("cells", "force", "near"), [(24, 5.0e3, True), (24, 1.0e3, True), (4, 10.0, False)])
def test_many_points_around_a_section_come_to_the_line(cells: int, force: float, near: bool) -> None:
    """A rigid tube on 256 points around it sinks as on lines, but for d / R; few points leave it to the mesh."""
    load = weighed(force, 0.0)
    line = -seat(tube([0.0, 180.0], load=load))[1] - CLEARANCE
    mesh = {"dimension": 3, "size": 0.03, "support_size": 0.03}
    mesh |= {"cells_through_thickness": cells, "cells_across_width": cells}
    case = gapbeam.read_case(tables_of([0.0, 180.0], "rigid", load=load, mesh=mesh))
    at_points = build_model(case.model_copy(update={"model": RigidModel(type="rigid")}), MPI.COMM_SELF)
    points = -seat(Simulation(at_points))[1] - CLEARANCE
    assert (abs(points / line - 1.0) < 2.0e-3 + line / RADIUS) == near
    assert near or abs(points / line - 1.0) > 0.2


LAWS: dict[str, dict[str, Any]] = {
    "elastic": {"stiffness": STIFFNESS},
    "damped": {"stiffness": STIFFNESS, "damping": 2.0e6},
    "hunt-crossley": {"stiffness": STIFFNESS, "law": {"type": "hunt-crossley", "restitution": 0.6}},
}


@pytest.mark.parametrize("name", LAWS)
def test_a_tube_bounces_off_a_wall(name: str) -> None:
    """Depth, duration and speed of return: the integral over the section and DOP853; the restitution that is asked."""
    start = {"type": "transient", "start": "undeformed", "motion": {"velocity": -SPEED}}
    model = tube([0.0, 180.0], contact=LAWS[name], analysis=start, time={"end": 2.0e-3, "step": STEP}).model
    response = respond(model, seated(model).state, round((CLEARANCE / SPEED + LASTS) / STEP), STEP)
    depth, speed = (-response.history[key][:, 0, 2] for key in ("displacement", "velocity"))
    depth = depth - CLEARANCE
    if name == "hunt-crossley":
        assert -speed[-1] == pytest.approx(0.6 * SPEED, rel=2.0e-3)
        return
    damping = LAWS[name].get("damping", 0.0)
    times = np.arange(0.0, LASTS, STEP)
    wanted, by_points = (
        solve_ivp(
            lambda _, state, whole=whole: [state[1], -resultant(state[0], state[1], damping, whole) / MASS],
            (0.0, LASTS), [0.0, SPEED], "DOP853", times, rtol=1.0e-7, atol=1.0e-12,
        ).y
        for whole in (True, False)
    )  # fmt: skip
    assert depth.max() == pytest.approx(wanted[0].max(), rel=2.0e-3)
    assert np.sum(depth > 0.0) == pytest.approx(np.sum(wanted[0] > 0.0), abs=2)
    assert speed[-1] == pytest.approx(wanted[1, -1], rel=2.0e-3)
    assert speed[-1] == pytest.approx(by_points[1, -1], rel=1.0e-2)
    if name == "elastic":  # an oscillator on k d^(3/2), as spheres that collide
        stiffness = 4.0 / 3.0 * STIFFNESS * LENGTH * DIAMETER**0.5
        assert depth.max() == pytest.approx((1.25 * MASS * SPEED**2 / stiffness) ** 0.4, rel=2.0e-3)


def returned(damping: float, whole: bool) -> float:
    """Return the speed at which a mass comes back from a wide strip, where mass, stiffness and first speed are 1."""

    def force(depth: float, rate: float) -> float:
        if whole or rate > 0.0:
            return max(4.0 / 3.0 * depth**1.5 + 2.0 * damping * depth**0.5 * rate, 0.0)
        return 4.0 / 3.0 * max(depth + damping * rate, 0.0) ** 1.5

    def left(_: float, state: Array) -> float:
        return float(state[0])

    left.terminal, left.direction = True, -1  # type: ignore[attr-defined]
    found = solve_ivp(
        lambda _, state: [state[1], -force(max(state[0], 0.0), state[1])],
        (0.0, 50.0), [1.0e-12, 1.0], events=left, rtol=1.0e-8, atol=1.0e-12,
    )  # fmt: skip
    return -float(found.y[1, -1])


@pytest.mark.parametrize(("restitution", "slower"), [(0.9, 0.002), (0.8, 0.007), (0.7, 0.016), (0.5, 0.045)])
def test_a_damper_of_the_whole_strip_takes_what_the_page_says(restitution: float, slower: float) -> None:
    """Points whose damper would pull open one by one; the strip as a whole later: the mass comes back slower."""
    damping = brentq(lambda c: returned(c, whole=False) - restitution, 1.0e-3, 5.0)
    assert 1.0 - returned(damping, whole=True) / restitution == pytest.approx(slower, abs=6.0e-4)


def long_tube(width: float, **tables: Any) -> Case:
    """Return a tube of 4 m in three plates of a width, its model chosen by itself."""
    plates = [
        {
            "name": f"plate{number}", "from": number - 0.5 * width, "to": number + 0.5 * width, "clearance": 1.0e-4,
            "region": {"type": "polygon", "walls": [-90.0, 0.0, 90.0, 180.0]},
        }
        for number in (1, 2, 3)
    ]  # fmt: skip
    return gapbeam.read_case(
        {
            "beam": {"length": 4.0, "thickness": 0.02, "width": 0.02, "section": {"type": "tube", "wall": 0.001}},
            "material": {"young_modulus": 2.0e11, "poisson_ratio": 0.3, "density": 8000.0},
            "joint": [{"name": "foot", "type": "clamped", "point": 0.0}],
            "support": plates,
            "model": "auto",
            "mesh": {"dimension": 3},
            "contact": {"stiffness": STIFFNESS},
            "load": [{"type": "gravity", "direction": [0.0, 0.0, -1.0]}],
            "probe": [{"name": "tip", "point": 4.0}],
            "time": {"end": 0.01, "step": 2.0e-5, "frequency": 400.0},
            **tables,
        }
    )


@pytest.mark.parametrize("width", [0.02, 0.2, 0.3])
def test_auto_takes_as_many_stations_as_bending_waves_ask_for(width: float) -> None:
    """Eight, or sixteen in a wave; it is said; the finest companion has twice as many, and the same kind of contact."""
    case = long_tube(width)
    wave = bending_wavelength(case.profile.pieces[0], 400.0)
    assert isinstance(case.model, BeamModel)
    assert case.model.stations == max(8, ceil(16.0 * width / wave))
    assert "flat walls along lines" in case.model.reasons[-1]
    plan = companions_of(case, 2.0e-5, STIFFNESS, computed=False)
    finest = next(one.changes["model"] for one in plan.companions if one.name == FINEST)
    assert finest["stations"] == 2 * case.model.stations
    assert any("stay round" in words for words in plan.left_out)


@pytest.mark.parametrize(
    "change",
    [
        {"contact": {"stiffness": STIFFNESS, "law": {"type": "piecewise-linear", "depths": [1e-5], "factors": [2.0]}}},
        {"contact": {"formulation": "unilateral"}},
    ],
    ids=["a law without a line", "constraints"],
)
def test_other_contact_keeps_its_area(change: dict[str, Any]) -> None:
    """Laws whose resultant is not known, and formulations without a law."""
    case = long_tube(0.02, **change)
    assert line_radii(case) == (None, None, None)
    assert not any("along lines" in words for words in case.model.reasons)


def test_a_line_beside_a_circle_and_a_law_of_its_own() -> None:
    """Each support has the exponent of its law and of its shape: 3/2 on lines, 1 in circles, n + 1/2 of an own law."""
    case = long_tube(0.02)
    tables = case.model_dump(mode="json", by_alias=True, exclude_unset=True)
    plates = [dict(one) for one in tables["support"]]
    plates[1]["region"] = {"type": "hole", "contact": "circle"}
    plates[2] |= {"law": {"type": "hunt-crossley", "exponent": 1.5, "restitution": 0.5}, "stiffness": 1.0e15}
    model = gapbeam.model(long_tube(0.02, support=plates)).model
    table = model.law.table(model.system.contact.size)
    faces = model.system.contact.faces
    assert [set(table.rows[table.owner[faces == face], 0]) for face in range(3)] == [{1.5}, {1.0}, {2.0}]
    assert [int(np.sum(faces == face)) for face in range(3)] == [32, 8, 32]


def test_motion_along_walls_meets_nothing() -> None:
    """A cantilever sags between walls beside it as in the open, w L^4 / (8 E I) + w L^2 / (2 kappa G A)."""
    case = long_tube(0.02)
    plates = [
        dict(one) | {"clearance": 1.0e-5, "region": {"type": "polygon", "walls": [-90.0, 90.0]}}
        for one in case.model_dump(mode="json", by_alias=True, exclude_unset=True)["support"]
    ]
    weight = [{"type": "gravity", "acceleration": 0.05, "direction": [0.0, 0.0, -1.0]}]
    simulation = gapbeam.model(long_tube(0.02, support=plates, load=weight))
    state, model = simulation.seat().state, simulation.model
    tip = np.ravel(model.probes["tip"].evaluate(state.u[VALUE], model.system.operators))
    area, second = np.pi * (0.01**2 - 0.009**2), 0.25 * np.pi * (0.01**4 - 0.009**4)
    assert tip[-1] == pytest.approx(-8000.0 * area * 0.05 * 4.0**4 / (8.0 * 2.0e11 * second), rel=1.0e-3)
    assert abs(tip[-1]) > 50.0e-5
    assert not np.any(state.pressure)
