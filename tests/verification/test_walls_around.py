"""Round beams between flat walls, in holes that are not round, out of line and inclined, against statics by hand.

A rigid cylinder of the radius R that is d deep in a plane, which presses along its radii with K per depth along them,
is pressed back, over the length b, with

    F(d) = K R b ((R + d) (a + sin a cos a) - 2 R sin a),    cos a = R / (R + d)
"""

from __future__ import annotations

from math import acos, cos, radians, sin
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI
from scipy.optimize import brentq

import gapbeam
from gapbeam.solver.case.solution_tables import BeamModel, RigidModel
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.models.model import Model, build_model
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import VALUE

LENGTH, DIAMETER, WALL = 0.2, 0.04, 0.004  # m
CLEARANCE, LONG, STIFFNESS = 2.0e-4, 0.02, 1.0e11  # m, m, Pa/m
PLACES = ((0.0, LONG), (LENGTH - LONG, LENGTH))
WHOLE = ((0.0, LENGTH),)
WEIGHT = 4000.0  # N
DOWN = [0.0, 0.0, -1.0]


def model_of(
    region: Any, direction: list[float] = DOWN, model: str = "rigid", cells: int = 4,
    stiffness: float | None = STIFFNESS, places: tuple[tuple[float, float], ...] = PLACES, **placed: float,
) -> Model:  # fmt: skip
    """Return a tube that weighs 4000 N in supports of one kind."""
    supports = [
        {"name": f"s{number}", "from": start, "to": end, "clearance": CLEARANCE, "region": region, **placed}
        for number, (start, end) in enumerate(places)
    ]
    mass = 7850.0 * np.pi / 4.0 * (DIAMETER**2 - (DIAMETER - 2.0 * WALL) ** 2) * LENGTH
    tables = {
        "beam": {"length": LENGTH, "thickness": DIAMETER, "width": DIAMETER, "section": {"type": "tube", "wall": WALL}},
        "material": {"young_modulus": 2.0e11, "poisson_ratio": 0.3, "density": 7850.0},
        "support": supports,
        "mesh": {"dimension": 3, "cells_through_thickness": cells, "cells_across_width": cells},
        "model": {"type": model},
        "contact": {} if stiffness is None else {"stiffness": stiffness},
        "load": [{"type": "gravity", "acceleration": WEIGHT / mass, "direction": direction}],
        "probe": [{"name": "mid", "point": LENGTH / 2.0}, {"name": "end", "point": LENGTH}],
        "time": {"end": 0.1, "step": 1.0e-4},
    }
    return build_model(gapbeam.read_case(tables), MPI.COMM_SELF)


def seated(model: Model, probe: str = "mid") -> Array:
    """Return where a cross-section of the beam rests, across the beam, (2,), m."""
    u = Simulation(model).seat().state.u[VALUE]
    return np.asarray(model.probes[probe].evaluate(u, model.system.operators))[1:]


def depth_of(force: float) -> float:
    """Return how deep a rigid cylinder is pressed into a plane along both supports, m."""
    radius = 0.5 * DIAMETER

    def excess(d: float) -> float:
        a = acos(radius / (radius + d))
        pressed = (radius + d) * (a + sin(a) * cos(a)) - 2.0 * radius * sin(a)
        return STIFFNESS * radius * 2.0 * LONG * pressed - force

    return float(brentq(excess, 0.0, 0.9 * radius))


def resting(walls: list[float], turn: float) -> Array:
    """Return by hand where the tube rests on the two walls that carry it, pulled at an angle from straight down."""
    pulled, *normals = (np.array([sin(t), -cos(t)]) for t in np.radians([turn, *walls]))
    turned = np.array(normals)
    forces = np.linalg.solve(turned.T, WEIGHT * pulled)
    assert np.all(forces > 0.0)
    return np.asarray(np.linalg.solve(turned, [CLEARANCE + depth_of(float(force)) for force in forces]))


@pytest.mark.slow(minutes=0.3)
@pytest.mark.parametrize("turn", [0.0, 8.0])
@pytest.mark.parametrize(
    ("walls", "carrying"),
    [
        ([-45.0, 45.0], [-45.0, 45.0]),
        ([60.0, -30.0], [-30.0, 60.0]),
        ([170.0, -30.0, 45.0], [-30.0, 45.0]),
        ([30.0, 90.0, 150.0, 210.0, 270.0, 330.0], [-30.0, 30.0]),
    ],
)
def test_a_tube_rests_on_two_walls(walls: list[float], carrying: list[float], turn: float) -> None:
    """Both forces follow from statics, both depths from the forces, and the place of the tube from the depths."""
    pull = [0.0, sin(radians(turn)), -cos(radians(turn))]
    wanted = resting(carrying, turn)
    deepest = float(np.linalg.norm(wanted)) - CLEARANCE
    assert seated(model_of({"type": "polygon", "walls": walls}, pull, cells=8)) == pytest.approx(
        wanted, abs=0.04 * deepest
    )  # radii are 0.02 off


def test_recesses_move_walls() -> None:
    """One wall stands farther away: the tube rests that much farther on its side."""
    first, last = (
        seated(model_of({"type": "polygon", "walls": [-45.0, 45.0], "recesses": [0.0, recess]}))
        for recess in (0.0, 1.0e-4)
    )
    assert last - first == pytest.approx(1.0e-4 * np.array([sin(radians(45.0)), -cos(radians(45.0))]), abs=6e-6)


@pytest.mark.slow(minutes=0.2)
def test_an_even_profile_is_a_hole() -> None:
    """Recesses that are equal everywhere are a larger clearance, and those of a circle aside are a hole aside."""
    even = model_of({"type": "profile", "angles": [0, 90, 180, 270], "recesses": [1e-4] * 4})
    plain = model_of("hole")
    assert even.system.contact.initial_gap == pytest.approx(plain.system.contact.initial_gap + 1e-4, abs=1e-15)
    turns = list(range(-180, 180, 3))
    aside = [1e-4 * sin(radians(turn)) - 5e-5 * -cos(radians(turn)) for turn in turns]
    circle = model_of({"type": "profile", "angles": turns, "recesses": aside})
    moved = model_of("hole", lateral=1e-4, offset=-5e-5)
    assert circle.system.contact.initial_gap == pytest.approx(moved.system.contact.initial_gap, abs=1e-7)
    assert seated(circle) == pytest.approx(seated(moved), abs=1e-7)


@pytest.mark.slow(minutes=0.1)
def test_a_worn_hole_lets_the_tube_down() -> None:
    """In a groove at the bottom that is wider than the contact, the tube rests as in a hole as wide as the groove."""
    worn = {"type": "profile", "angles": [-60, -40, 40, 60, 180], "recesses": [0.0, 2e-4, 2e-4, 0.0, 0.0]}
    found = seated(model_of(worn, stiffness=2e11, clearance=1e-3))
    assert found[1] < -1.2e-3
    assert found == pytest.approx(seated(model_of("hole", stiffness=2e11, clearance=1.2e-3)), abs=1e-10)


@pytest.mark.slow(minutes=0.1)
def test_a_hole_aside_holds_the_tube_aside() -> None:
    """Pulled toward +y, the tube rests the lateral offset farther than in a hole in line."""
    aside, plain = (seated(model_of("hole", [0.0, 1.0, 0.0], lateral=lateral)) for lateral in (1.5e-4, 0.0))
    assert aside == pytest.approx(plain + np.array([1.5e-4, 0.0]), abs=1e-9)


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("region", ["hole", "slot", {"type": "polygon", "walls": [-60.0, 60.0]}])
def test_inclined_supports_incline_the_beam(region: Any) -> None:
    """A rigid beam in one long support with the tilt t rests with the slope t, about the middle of the support."""
    even, inclined = (model_of(region, cells=4, places=WHOLE, tilt=tilt) for tilt in (0.0, 1.0e-3))
    rises = [seated(inclined, probe)[1] - seated(even, probe)[1] for probe in ("mid", "end")]
    assert rises == pytest.approx([0.0, 1.0e-3 * LENGTH / 2.0], abs=1e-3 * 1.0e-3 * LENGTH)


def test_a_face_rises_along_the_beam() -> None:
    """The gap of an inclined plane below the beam closes along it, that above it opens."""
    contact = model_of("slot", DOWN, "full", 4, places=WHOLE, tilt=1.0e-3).system.contact
    for face, sign in ((0, -1.0), (1, 1.0)):
        here = contact.faces == face
        x = contact.positions[here, 0]
        height = np.abs(contact.positions[here, 2])
        gaps = contact.initial_gap[here] - (height.max() - height)
        assert gaps == pytest.approx(0.5 * CLEARANCE + sign * 1.0e-3 * (x - 0.5 * LENGTH), abs=1e-12)


MOVED = {"clearance": 3e-4, "offset": 5e-5, "lateral": -4e-5, "tilt": 1e-3}
REGIONS = ["hole", {"type": "polygon", "walls": [-45.0, 45.0, 180.0], "recesses": [0.0, 1e-5, 0.0]}]


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("region", REGIONS)
def test_another_place_moves_the_gaps(region: Any) -> None:
    """What a sweep changes without a new mesh is what a new model has."""
    plain, other = model_of(region, cells=4), model_of(region, cells=4, **MOVED)
    moved = plain.system.contact.with_gaps_of(other.case.layout.faces)
    assert np.ptp(moved.initial_gap - plain.system.contact.initial_gap) > 1e-5
    assert moved.initial_gap == pytest.approx(other.system.contact.initial_gap, abs=1e-15)


@pytest.mark.slow(minutes=0.1)
def test_a_tube_between_walls_rests_as_its_solid_does() -> None:
    """Reduced and beam models against the solid, in a V-block."""
    block = {"type": "polygon", "walls": [-45.0, 60.0]}
    models = {name: model_of(block, DOWN, name, 4, 1e11) for name in ("full", "reduced", "beam")}
    for name, table in {"beam": BeamModel(type="beam"), "rigid": RigidModel(type="rigid")}.items():
        at_points = models["beam"].case.model_copy(update={"model": table})
        models[f"{name} at points"] = build_model(at_points, MPI.COMM_SELF)
    places = {name: seated(model) for name, model in models.items()}
    assert places["reduced"] == pytest.approx(places["full"], abs=0.01 * CLEARANCE)
    # its section keeps its shape
    assert places["beam at points"] == pytest.approx(places["full"], abs=0.05 * CLEARANCE)
    # stations meet walls along lines, as by hand; radii at points are 0.02 off
    nearer = places["rigid at points"] - resting([-45.0, 60.0], 0.0)
    assert places["beam at points"] - places["beam"] == pytest.approx(nearer, abs=0.02 * CLEARANCE)
