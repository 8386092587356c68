"""Round beams in round holes: pressing, whirling and resting against closed forms, and against the solid.

A rigid disc that stands r > c beside the middle of a hole with the clearance c reaches r cos t - c into its wall at the
angle t, up to cos a = c / r. With a pressure K per depth on the area R b dt, the wall presses with

    F(r) = K R b (r (a + sin a cos a) - 2 c sin a)
"""

from __future__ import annotations

from math import acos, cos, hypot, pi, sin
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI
from scipy.optimize import brentq

import gapbeam
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.models.model import Model, build_model
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import VALUE

LENGTH, DIAMETER, WALL = 0.2, 0.04, 0.004  # m
CLEARANCE, LONG, STIFFNESS = 2.0e-4, 0.02, 2.0e9  # m, m, Pa/m
HOLES = ((0.0, LONG), (LENGTH - LONG, LENGTH))
MASS = 7850.0 * pi / 4.0 * (DIAMETER**2 - (DIAMETER - 2.0 * WALL) ** 2) * LENGTH
SPRING, DAMPER = 2.0e6, 500.0  # N/m, N s/m: both joints together
FREQUENCY, FORCE = 60.0, 1200.0  # Hz, N: of the force that turns around the beam


def model_of(load: list[dict[str, Any]], cells: int = 4, **more: Any) -> Model:
    """Return a tube in two holes, by default as a rigid body on soft contact."""
    holes = [
        {"name": f"s{number}", "from": start, "to": end, "clearance": CLEARANCE, "region": "hole"}
        for number, (start, end) in enumerate(HOLES)
    ]
    tables = {
        "beam": {"length": LENGTH, "thickness": DIAMETER, "width": DIAMETER, "section": {"type": "tube", "wall": WALL}},
        "material": {"young_modulus": 2.0e11, "poisson_ratio": 0.3, "density": 7850.0},
        "support": holes,
        "mesh": {"dimension": 3, "cells_through_thickness": cells, "cells_across_width": cells},
        "model": {"type": "rigid"},
        "contact": {"stiffness": STIFFNESS},
        "load": load,
        "probe": [{"name": "mid", "point": LENGTH / 2.0}],
        "time": {"end": 0.1, "step": 1.0e-4},
    }
    return build_model(gapbeam.read_case(tables | more), MPI.COMM_SELF)


def gravity(times: float, direction: list[float]) -> dict[str, Any]:
    """Return a weight in any direction."""
    return {"type": "gravity", "acceleration": 9.81 * times, "direction": direction}


def motion(model: Model, u: Array) -> Array:
    """Return the motion of the middle of the beam, (3,), m."""
    return np.asarray(model.probes["mid"].evaluate(u, model.system.operators))


def seated(model: Model) -> Array:
    """Return where the middle of the beam rests, (3,), m."""
    return motion(model, Simulation(model).seat().state.u[VALUE])


def wall_force(r: float) -> float:
    """Return the force of both holes on a beam that stands r beside their middle, N."""
    if r <= CLEARANCE:
        return 0.0
    a = acos(CLEARANCE / r)
    return 2.0 * STIFFNESS * DIAMETER / 2.0 * LONG * (r * (a + sin(a) * cos(a)) - 2.0 * CLEARANCE * sin(a))


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("direction", [[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [0.0, 1.0, 1.0], [0.0, -0.3, 1.0]])
@pytest.mark.parametrize(("times", "depth"), [(1.0, 0.01), (100.0, 0.0005)])
def test_a_tube_is_pressed_into_its_holes(times: float, depth: float, direction: list[float]) -> None:
    """The depth under a force in any direction follows the closed form, and the tube hardly moves aside."""
    along = np.array(direction) / np.linalg.norm(direction)
    wanted = brentq(lambda r: wall_force(r) - MASS * 9.81 * times, CLEARANCE, 10.0 * CLEARANCE)
    found = seated(model_of([gravity(times, direction)]))
    assert found @ along - CLEARANCE == pytest.approx(wanted - CLEARANCE, rel=depth)
    aside = float(np.linalg.norm(found - (found @ along) * along))
    assert aside < max(depth * (wanted - CLEARANCE), 0.006 * CLEARANCE)  # 0.006 rad between contact points


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize(("cells", "accuracy"), [(2, 0.01), (4, 1e-3), (8, 1e-4)])
def test_more_cells_around_find_the_depth(cells: int, accuracy: float) -> None:
    """A contact over 68 degrees to either side, with 8, 16 and 32 cells around."""
    wanted = brentq(lambda r: wall_force(r) - MASS * 981.0, CLEARANCE, 10.0 * CLEARANCE)
    found = -seated(model_of([gravity(100.0, [0.0, 0.0, -1.0])], cells))[2]
    assert found - CLEARANCE == pytest.approx(wanted - CLEARANCE, rel=accuracy)


def whirling(cells: int, steps: int) -> Array:
    """Return the distance from the middle in the last period under a force that turns around the beam, m."""
    joints = [
        {
            "name": f"j{number}",
            "type": "elastic",
            "point": point,
            "stiffness": {"vertical": SPRING / 2, "lateral": SPRING / 2, "rotation": 1e4, "lateral_rotation": 1e4},
            "damping": {"vertical": DAMPER / 2, "lateral": DAMPER / 2, "rotation": 5.0, "lateral_rotation": 5.0},
        }
        for number, point in enumerate((0.0, LENGTH))
    ]
    forces = [
        {
            "type": "harmonic_force",
            "name": name,
            "point": LENGTH / 2.0,
            "amplitude": FORCE,
            "frequency": FREQUENCY,
            "direction": direction,
            "phase": phase,
            "ramp": 0.05,
        }
        for name, direction, phase in (("z", [0.0, 0.0, 1.0], 0.0), ("y", [0.0, 1.0, 0.0], 90.0))
    ]
    end = 0.25
    model = model_of(forces, cells, joint=joints, time={"end": end, "step": 1.0 / FREQUENCY / steps})
    march = Simulation(model).march()
    last = [step.new.u[VALUE] for step in march if step.new.time > end - 1.0 / FREQUENCY]
    return np.array([hypot(*motion(model, u)[1:]) for u in last])


@pytest.mark.slow(minutes=0.3)
def test_a_whirling_tube_rubs_all_around() -> None:
    """Full annular rub: ((k - m W^2) r + F(r))^2 + (c W r)^2 = P^2, on a circle, at every phase.

    Source: the textbook equation of rotor rub, with F(r) of a hole instead of a linear spring.
    """
    omega = 2.0 * pi * FREQUENCY

    def excess(r: float) -> float:
        return hypot((SPRING - MASS * omega**2) * r + wall_force(r), DAMPER * omega * r) - FORCE

    wanted = brentq(excess, CLEARANCE, 20.0 * CLEARANCE)
    assert wanted > 1.5 * CLEARANCE
    free = FORCE / hypot(SPRING - MASS * omega**2, DAMPER * omega)
    assert free > 1.3 * wanted  # the holes hold the tube
    radius = whirling(4, 200)
    assert float(radius.mean()) == pytest.approx(wanted, rel=5e-4)
    assert float(np.ptp(radius)) < 3e-5 * wanted


def test_nothing_but_its_springs_holds_a_tube_that_touches_no_wall() -> None:
    """Up and aside it vibrates alike on a spring; the weak spring about its axis does not pull it to the middle."""
    spring = {"vertical": SPRING, "lateral": SPRING}
    joint = [{"name": "j", "type": "elastic", "point": LENGTH / 2, "stiffness": spring}]
    load = {"type": "harmonic_force", "name": "z", "point": LENGTH / 2, "amplitude": 1.0, "frequency": 1.0}
    operators = model_of([load], joint=joint).system.operators
    assert isinstance(operators, DenseOperators)
    squares = operators.modes[0]
    assert np.sum(np.isclose(squares, SPRING / MASS, rtol=1e-3)) == 2
    assert np.sum(squares < 1e-2 * SPRING / MASS) == 4  # along and about the axis, and both rotations


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("offset", [0.0, 1.0e-4])
def test_a_tube_rests_as_its_solid_does(offset: float) -> None:
    """Reduced and full models in two holes, one of them out of line: same forces and places; the weight is carried."""
    places = {}
    for name in ("full", "reduced", "beam"):
        holes = [
            {"name": "a", "from": 0.0, "to": 0.02, "clearance": CLEARANCE, "region": "hole"},
            {"name": "b", "from": 0.6, "to": 0.62, "clearance": CLEARANCE, "region": "hole", "offset": offset},
        ]
        beam = {"length": 0.8, "thickness": DIAMETER, "width": DIAMETER, "section": {"type": "tube", "wall": WALL}}
        model = model_of(
            [gravity(1.0, [0.0, 0.0, -1.0])], 2, beam=beam, support=holes, model={"type": name}, contact={},
            probe=[{"name": "mid", "point": 0.8}],
        )  # fmt: skip
        seat = Simulation(model).seat()
        contact, pressure = model.system.contact, seat.state.pressure
        places[name] = motion(model, seat.state.u[VALUE])
        lifted = float(np.sum(contact.weights * pressure * contact.across[:, 1]))
        assert lifted == pytest.approx(9.81 * 4.0 * MASS, rel=1e-3)
    slope = offset / 0.6
    by_hand = -CLEARANCE + offset + slope * 0.19
    assert places["full"][2] == pytest.approx(by_hand, abs=0.03 * CLEARANCE)
    assert places["reduced"] == pytest.approx(places["full"], abs=2e-3 * CLEARANCE)
    assert places["beam"] == pytest.approx(places["full"], abs=0.01 * CLEARANCE)


def test_beam_elements_move_alike_in_all_directions() -> None:
    """A blow on a tube in its holes, upward or aside: the same motion, turned by a quarter."""
    moved = []
    for direction in ([0.0, 0.0, 1.0], [0.0, 1.0, 0.0]):
        load = {"type": "harmonic_force", "name": "f", "point": 0.03, "amplitude": 2000.0, "frequency": 400.0}
        model = model_of(
            [load | {"direction": direction}],
            model={"type": "beam", "elements": 10},
            analysis={"type": "transient", "start": "undeformed"},
            damping={"mass": 0.0, "stiffness": 1e-5},
        )
        moved.append(np.array([motion(model, step.new.u[VALUE]) for step in Simulation(model).march(None, 60)]))
    upward, aside = moved
    assert np.ptp(upward[:, 2]) > 2.0 * CLEARANCE
    assert aside[:, 1] == pytest.approx(upward[:, 2], abs=1e-6 * CLEARANCE)
    assert np.abs(aside[:, 2]).max() < 1e-6 * CLEARANCE


def test_motions_of_the_points_of_a_hole() -> None:
    """Gaps close by what points move outward; turning about the axis slides them around, and moves no gap."""
    model = model_of(
        [gravity(1.0, [0.0, 0.0, -1.0])], 4, model={"type": "full"}, contact={"friction": {"coefficient": 0.2}}
    )
    contact, space = model.system.contact, model.space
    places = space.tabulate_dof_coordinates()
    radii = np.hypot(contact.positions[:, 1], contact.positions[:, 2])
    assert contact.initial_gap == pytest.approx(CLEARANCE + radii.max() - radii, abs=1e-15)
    assert contact.area == pytest.approx(2.0 * pi * DIAMETER / 2.0 * 2.0 * LONG, rel=1e-3)
    turn = np.stack([0.0 * places[:, 0], -places[:, 2], places[:, 1]], axis=1).reshape(-1)
    values = contact.interface.trace(turn, model.system.operators)
    assert contact.gap_matrix @ values == pytest.approx(np.zeros(contact.size), abs=1e-4 * DIAMETER)
    slip = contact.slip(values)
    assert slip[:, 0] == pytest.approx(np.zeros(contact.size), abs=1e-12)
    assert np.abs(slip[:, 1]) == pytest.approx(radii, rel=1e-3)
    for axis, moved in ((1, contact.positions[:, 1] / radii), (2, contact.positions[:, 2] / radii)):
        lift = np.zeros_like(places)
        lift[:, axis] = 1.0
        values = contact.interface.trace(lift.reshape(-1), model.system.operators)
        assert contact.gap_matrix @ values == pytest.approx(-moved, abs=1e-9)
        assert np.sum(contact.slip(values) ** 2, axis=1) + moved**2 == pytest.approx(np.ones(contact.size), abs=1e-9)


def test_another_clearance_and_offset_move_the_gaps() -> None:
    """What a sweep changes without a new mesh is what a new model has."""
    model = model_of([gravity(1.0, [0.0, 0.0, -1.0])])
    holes = [
        {"name": f"s{number}", "from": start, "to": end, "clearance": 3e-4, "offset": 1e-4, "region": "hole"}
        for number, (start, end) in enumerate(HOLES)
    ]
    other = model_of([gravity(1.0, [0.0, 0.0, -1.0])], support=holes)
    moved = model.body.contact.with_gaps_of(other.case.layout.faces)
    assert moved.initial_gap == pytest.approx(other.system.contact.initial_gap, abs=1e-15)
    assert np.ptp(moved.initial_gap) == pytest.approx(2e-4, rel=0.01)
