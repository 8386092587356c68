"""Stations along supports: their rule, and tubes that lie askew in slots, against integrals in closed form.

A round section d deep in a flat wall is pressed by k d^(3/2) per length, k = 4/3 K sqrt(2 R). Where the depth grows
from 0 to d over the length b at the end of a support, d = t b with the tilt t, force and couple about that end are

    F = k t^(3/2) b^(5/2) / (5/2),    F times the lever 2/7 b.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import root

import gapbeam
from gapbeam.solver.assembly.gauss_rule import stations_along
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.models.model import Model
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import VALUE
from gapbeam.studies.trials.response import respond
from gapbeam.studies.trials.starts import seated

LENGTH, DIAMETER, WALL, START, END = 0.2, 0.02, 0.002, 0.06, 0.1  # m
CLEARANCE, STIFFNESS = 2.0e-5, 1.0e12  # m, Pa/m
PLATE, HALF = END - START, 0.5 * (END - START)
SPRING = 4.0 / 3.0 * STIFFNESS * DIAMETER**0.5  # k, N/m^(5/2)
POLYGON = {"type": "polygon", "walls": [0.0, 180.0]}


def tube(
    forces: list[tuple[float, float]], model: Any = "rigid", region: Any = "slot", stiffness: float = STIFFNESS,
    **tables: Any,
) -> Simulation:  # fmt: skip
    """Return a tube in one support, pushed upward by forces at x."""
    model = {"type": model} if isinstance(model, str) else model
    play = CLEARANCE if region == "slot" else 0.5 * CLEARANCE
    size = {"dimension": 3, "size": 0.05, "support_size": 0.02, "cells_through_thickness": 2, "cells_across_width": 2}
    return gapbeam.model(
        {
            "beam": {
                "length": LENGTH, "thickness": DIAMETER, "width": DIAMETER, "section": {"type": "tube", "wall": WALL}
            },
            "material": {"young_modulus": 2.0e11, "poisson_ratio": 0.3, "density": 8000.0},
            "support": [{"name": "plate", "from": START, "to": END, "clearance": play, "region": region}],
            "model": model,
            "mesh": size,
            "contact": {"stiffness": stiffness},
            "restraint": {"axial": 1.0e-3, "lateral": 1.0e-3},
            "load": [
                {"type": "constant_force", "name": f"f{n}", "point": x, "direction": [0.0, 0.0, 1.0], "amplitude": f}
                for n, (x, f) in enumerate(forces)
            ],
            "probe": [{"name": "start", "point": START}, {"name": "end", "point": END}],
            "time": {"end": 1.0e-3, "step": 1.0e-6},
            **tables,
        }
    )  # fmt: skip


def heights(simulation: Simulation) -> Array:
    """Return how high the axis rests at both edges of the support, (2,), m."""
    u, model = simulation.seat().state.u[VALUE], simulation.model
    return np.array([model.probes[name].evaluate(u, model.system.operators)[-1] for name in ("start", "end")])


def pressed(low: float, high: float, at: float = 0.0) -> tuple[float, float]:
    """Return force and couple about x = at of depths that are linear between the edges of the support, N and N m."""
    b, steepness = PLATE, abs(high - low) / PLATE
    if steepness * PLATE < 1.0e-9 * max(abs(low), abs(high)):
        whole = SPRING * max(low, 0.0) ** 1.5 * b
        return whole, whole * (0.5 * (START + END) - at)
    whole = moment = 0.0
    edge, inward = (END, -1.0) if high > low else (START, 1.0)
    for depth, sign in ((max(low, high), 1.0), (min(low, high), -1.0)):
        if depth > 0.0:  # a wedge to where the depth is 0, less the part of it beyond the support
            reach = depth / steepness
            part = sign * SPRING * steepness**1.5 * reach**2.5 / 2.5
            tip = edge + inward * (max(low, high) / steepness - reach)
            whole += part
            moment += part * (tip + inward * reach * 2.0 / 7.0 - at)
    return whole, moment


@given(st.integers(1, 64), st.floats(-1.0, 1.0), st.floats(1.0e-3, 10.0), st.integers(0, 125))
@settings(max_examples=60, deadline=None, derandomize=True)
def test_the_rule_integrates_polynomials(count: int, start: float, length: float, degree: int) -> None:
    """Nodes at both edges from three on; n of them integrate the degree 2 n - 3, one and two 1 and 3."""
    places, shares = stations_along(start, start + length, count)
    along = (places - start) / length
    assert np.all(shares > 0.0)
    assert np.all(np.diff(places) > 0.0)
    assert (places[0] == start and along[-1] == pytest.approx(1.0, abs=1e-12)) == (count > 2)
    degree %= 2 * count - (2 if count > 2 else 0)
    assert shares @ (2.0 * along - 1.0) ** degree == pytest.approx((1 + (-1) ** degree) / 2 / (degree + 1), abs=1e-12)


@cache
def placed(region: str) -> Model:
    """Return the model of a rigid tube in a region, with the stations that nobody asked for."""
    return tube([(0.0, 1.0)], region="slot" if region == "slot" else POLYGON).model


@pytest.mark.parametrize("region", ["slot", "polygon"])
@given(st.floats(0.27, 1.0), st.floats(1.0e-7, 3.0e-6), st.booleans())
@settings(max_examples=20, deadline=None, derandomize=True)
def test_a_wedge_of_depths_has_force_and_couple_of_the_integral(
    region: str, part: float, depth: float, first: bool
) -> None:
    """Depths that grow over part of the length: the couple about the middle within 1 %, the force within 2 %."""
    model, middle = placed(region), 0.5 * (START + END)
    contact = model.system.contact
    assert contact.size == 16
    x, below = contact.positions[:, 0], contact.across[:, 1] > 0.5
    other = depth * (1.0 - 1.0 / part)
    low, high = (depth, other) if first else (other, depth)
    depths = np.where(below, low + (high - low) * (x - START) / PLATE, -1.0)
    forces = contact.weights * model.law.static(depths).pressure
    force, couple = pressed(low, high, middle)
    assert forces.sum() == pytest.approx(force, rel=2.0e-2)
    assert forces @ (x - middle) == pytest.approx(couple, rel=1.0e-2)


def resting(forces: list[tuple[float, float]], stiffness: float) -> Array:
    """Return the heights of the axis at both edges where walls below and above balance the forces, (2,), m."""
    scale = stiffness / STIFFNESS
    unit = sum(abs(force) for _, force in forces)

    def excess(heights: Array) -> list[float]:
        low, high = CLEARANCE * heights
        lifted = pressed(-low - 0.5 * CLEARANCE, -high - 0.5 * CLEARANCE)
        lowered = pressed(low - 0.5 * CLEARANCE, high - 0.5 * CLEARANCE)
        force = sum(force for _, force in forces) + scale * (lifted[0] - lowered[0])
        couple = sum(x * force for x, force in forces) + scale * (lifted[1] - lowered[1])
        return [force / unit, (couple - 0.5 * (START + END) * force) / (unit * PLATE)]

    first = np.array([-0.6, 0.6]) if forces[-1][1] > 0.0 else np.array([0.6, -0.6])
    found = root(excess, first, tol=1.0e-12)
    assert found.success
    return np.asarray(CLEARANCE * found.x)


COUPLE = [(0.0, -1.0), (LENGTH, 1.0)]
WEIGHT = [(0.5 * (END + LENGTH), -1.0)]


@pytest.mark.parametrize("forces", [COUPLE, WEIGHT], ids=["couple", "one edge"])
@given(st.floats(0.0, 3.0), st.floats(11.0, 15.0))
@settings(max_examples=8, deadline=None, derandomize=True)
def test_a_tube_that_tilts_rests_as_by_the_integral(
    forces: list[tuple[float, float]], size: float, stiffness: float
) -> None:
    """A couple, and a weight beyond the support on one edge below and the other above; from soft to all but rigid."""
    acting = [(x, force * 10.0**size) for x, force in forces]
    found, wanted = heights(tube(acting, stiffness=10.0**stiffness)), resting(acting, 10.0**stiffness)
    assert found == pytest.approx(wanted, abs=2.0e-2 * np.abs(wanted).max())


@pytest.mark.parametrize("forces", [COUPLE, WEIGHT], ids=["couple", "one edge"])
def test_rigid_edges_leave_the_whole_play(forces: list[tuple[float, float]]) -> None:
    """Walls without give: half the clearance down at one edge and up at the other, with forces by statics there."""
    simulation = tube(forces, stiffness=1.0e20)
    sign = -1.0 if forces is COUPLE else 1.0
    assert heights(simulation) == pytest.approx(0.5 * CLEARANCE * np.array([sign, -sign]), rel=1.0e-4)
    contact = simulation.model.system.contact
    pressure = contact.weights * simulation.seat().state.pressure
    at_edges = np.isin(np.abs(contact.positions[:, 0] - 0.5 * (START + END)).round(9), round(HALF, 9))
    couple = sum((x - END) * force for x, force in forces) / PLATE  # about one edge, over the distance of the other
    assert pressure[at_edges].sum() == pytest.approx(pressure.sum(), rel=1.0e-9)
    assert pressure.max() == pytest.approx(max(abs(couple), abs(sum(f for _, f in forces) + couple)), rel=1.0e-6)


def test_tilts_converge_with_the_stations() -> None:
    """The largest error of the tilt over couples of three decades falls by 2^1.7 or more as stations double."""
    errors = []
    for stations in (4, 8, 16, 32):
        found = [
            heights(tube([(x, force * size) for x, force in COUPLE], {"type": "rigid", "stations": stations}))[1]
            / resting([(x, force * size) for x, force in COUPLE], STIFFNESS)[1]
            for size in np.geomspace(0.1, 100.0, 10)
        ]
        errors.append(float(np.abs(np.array(found) - 1.0).max()))
    assert errors[1] < 2.0e-2
    assert np.log2(np.array(errors[:-1]) / errors[1:]).min() > 1.7


RUBS = {"contact": {"stiffness": STIFFNESS, "friction": {"coefficient": 0.3}}}


@pytest.mark.parametrize(
    ("model", "tables"),
    [
        ("rigid", {}),
        ("beam", {}),
        ("beam", RUBS),
        pytest.param({"type": "reduced", "sections": "rigid"}, {}, marks=pytest.mark.slow(minutes=0.2)),
    ],
)
def test_a_slot_is_two_walls(model: Any, tables: dict[str, Any]) -> None:
    """Between planes a round tube has the points, the seat and the motion that it has between walls at 0 and 180."""
    push = [(0.0, -3.0), (0.7 * LENGTH, 5.0)]
    start = {"type": "transient", "start": "undeformed", "motion": {"velocity": -0.05, "spin": 1.0}}
    slot, walls = (tube(push, model, region, analysis=start, **tables) for region in ("slot", POLYGON))
    assert slot.model.system.contact.size == walls.model.system.contact.size == 16
    assert model != "rigid" or slot.model.system.operators.size == 2  # heave and pitch: nothing twists it
    assert heights(slot) == pytest.approx(heights(walls), rel=1.0e-6)
    moved = [
        respond(one.model, seated(one.model).state, 600, 1.0e-6).history["displacement"][..., -1]
        for one in (slot, walls)
    ]
    assert np.abs(moved[0]).max() > 0.6 * CLEARANCE
    near = 1.0e-3 if tables else 1.0e-6  # friction acts at the mean height of a strip, whose points have other weights
    assert moved[0] == pytest.approx(moved[1], abs=near * CLEARANCE)


@pytest.mark.slow(minutes=0.2)
@pytest.mark.parametrize(("coefficient", "force"), [(0.1, 75.0), (0.2, 60.0), (0.3, 60.0)])
def test_friction_is_solved_where_an_edge_lets_go(coefficient: float, force: float) -> None:
    """A force that lets go within a step is what round-off leaves of the one before: these runs ended there."""
    places = {"left": (0.1, "slot"), "middle": (0.5, "slot"), "right": (0.9, "stop")}
    supports = [
        {"name": name, "from": x, "to": x + 0.02, "clearance": 2.0e-4, "region": region}
        for name, (x, region) in places.items()
    ]
    down = {"direction": [0.0, 0.0, -1.0]}
    shaken = {"name": "shaker", "point": 0.3, "amplitude": force, "frequency": 40.0}
    simulation = tube(
        [], "beam",
        beam={"length": 1.0, "thickness": DIAMETER, "width": DIAMETER, "section": {"type": "tube", "wall": WALL}},
        material={"young_modulus": 2.0e11, "poisson_ratio": 0.3, "density": 7850.0},
        support=supports,
        mesh={"dimension": 3},
        contact={"friction": {"coefficient": coefficient}},
        load=[{"type": "gravity", **down}, {"type": "harmonic_force", **shaken, **down}],
        probe=[{"name": "mid", "point": 0.3}],
        time={"end": 0.1, "step": 4.0e-5},
        restraint={},
    )  # fmt: skip
    response = respond(simulation.model, seated(simulation.model).state, 2500, 4.0e-5)
    assert response.verdict == "passed"
    assert float(np.max(response.history["contact_force"])) > 100.0
