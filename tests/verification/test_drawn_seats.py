"""Seats where long faces peel, and refusals by a rigid motion: drawn scenes, beams on a rigid floor by theory."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import gapbeam
from benchmarks.drawn_seats import drawn
from gapbeam.solver.seat.escape import RigidMotions, find_escape

LENGTH, THICKNESS, WIDTH = 2.0, 0.005, 0.02
E, DENSITY, GRAVITY = 2.1e11, 7850.0, 9.81
LINE_LOAD = DENSITY * THICKNESS * WIDTH * GRAVITY  # N/m
BENDING = E * WIDTH * THICKNESS**3 / 12.0
LIFT = 3.0  # N
PEELED = 2.0 * LIFT / LINE_LOAD  # m


def strip(*supports: dict[str, Any], **more: Any) -> dict[str, Any]:
    """Return a strip of steel in stops, under its weight."""
    return {
        "beam": {"length": LENGTH, "thickness": THICKNESS, "width": WIDTH},
        "material": {"young_modulus": E, "poisson_ratio": 0.3, "density": DENSITY},
        "support": list(supports),
        "model": {"type": "beam", "elements": 100},
        "mesh": {"dimension": 2, "support_size": 0.02, "cells_through_thickness": 1},
        "load": [{"type": "gravity"}],
        "probe": [{"name": "end", "point": LENGTH}],
        "time": {"end": 1.0e-3, "step": 1.0e-4},
    } | more


def stop(start: float, end: float, side: str = "below", **more: Any) -> dict[str, Any]:
    """Return a stop without clearance."""
    region = {"type": "stop", "side": side}
    return {"name": f"{side}{round(1e3 * start)}", "from": start, "to": end, "clearance": 0.0, "region": region} | more


def force(x: float, size: float, name: str = "hook") -> dict[str, Any]:
    """Return a constant force upward."""
    return {"type": "exciter", "name": name, "point": x, "amplitude": 0.0, "frequency": 10.0, "preload": size}


def seated(tables: dict[str, Any]) -> tuple[float, float]:
    """Return the force of all contacts, N, and the displacement of the end, m."""
    simulation = gapbeam.model(gapbeam.read_case(tables))
    seat, model = simulation.seat(), simulation.model
    end = model.probes["end"].evaluate(seat.state.u[0], model.system.operators)
    return float(model.system.contact.weights @ seat.state.pressure), float(end[-1])


@pytest.mark.slow(minutes=0.1)
def test_drawn_scenes_are_seated_or_leave_by_a_rigid_motion() -> None:
    """Thirty of them: statics confirm each seat, and a linear program of its own each refusal."""
    found = drawn(30)
    assert [one.fault for one in found if one.fault] == []
    assert sum(one.verdict == "edge" for one in found) <= 1
    assert {"seated", "refused"} <= {one.verdict for one in found}


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"contact": {"stiffness": 1.0e9}},
        {"contact": {"stiffness": 1.0e17}},
        {"contact": {"stiffness": 1.0e16, "law": {"type": "hunt-crossley", "exponent": 1.5, "restitution": 0.9}}},
        {"model": {"type": "reduced"}},
        {"model": {"type": "full"}, "contact": {"formulation": "unilateral"}},
    ],
    ids=["auto", "soft", "hard", "power", "reduced", "unilateral"],
)
def test_a_strip_is_lifted_at_its_end(changes: dict[str, Any]) -> None:
    """It touches from a = 2 F / q, its end rises by q a^4 / (24 E I), and the table carries the rest of the weight.

    Within 1 % of the beam on a rigid floor. Source: balance of moments of the lifted part, whose curvature is 0 where
    it touches, and Euler-Bernoulli bending. A reduced basis has few shapes of a peeling face: within 5 %.
    """
    load = [{"type": "gravity"}, force(LENGTH, LIFT)]
    carried, raised = seated(strip(stop(0.0, LENGTH), load=load, **changes))
    assert carried == pytest.approx(LINE_LOAD * LENGTH - LIFT, rel=1e-4)
    tolerance = 5e-2 if changes.get("model", {}).get("type") == "reduced" else 1e-2
    assert raised == pytest.approx(LINE_LOAD * PEELED**4 / (24.0 * BENDING), rel=tolerance)


@pytest.mark.parametrize(("part", "size"), [(0.51, 1.0), (0.55, 1.0e-3), (0.53, 1.0e2)], ids=["", "small", "large"])
def test_a_strip_rests_exactly_on_the_ends_of_a_table(part: float, size: float) -> None:
    """Exact contact, fine cells: where an overhang c arches the rest, a, of a strip, end and edge alone touch.

    The end sinks by c (q c^2 a / 6 - q a^3 / 24) / (E I) + q c^4 / (8 E I), at all sizes within 1 %: its slope at the
    other end is upward for a < sqrt(2) c. Source: Euler-Bernoulli beam on two supports.
    """
    length, thickness = size * LENGTH, 2.0 * size * THICKNESS
    case = strip(
        stop(0.0, part * length),
        beam={"length": length, "thickness": thickness, "width": size * WIDTH},
        model="full",
        contact={"formulation": "unilateral"},
        mesh={"dimension": 2, "size": thickness, "support_size": thickness / 3.0, "cells_through_thickness": 2},
        probe=[{"name": "end", "point": length}],
    )
    carried, end = seated(case)
    line, bending = DENSITY * thickness * size * WIDTH * GRAVITY, E * size * WIDTH * thickness**3 / 12.0
    a, c = part * length, (1.0 - part) * length
    sunk = (c * (line * c**2 * a / 6.0 - line * a**3 / 24.0) + line * c**4 / 8.0) / bending
    assert carried == pytest.approx(line * length, rel=1e-4)
    assert -end == pytest.approx(sunk, rel=1e-2)


def test_a_strip_pressed_against_a_ceiling_hangs_from_it() -> None:
    """Forces of 1.5 weights press it upward against a long stop above: the same face, upside down."""
    weight = LINE_LOAD * LENGTH
    load = [{"type": "gravity"}, force(0.6, 0.75 * weight, "a"), force(1.4, 0.75 * weight, "b")]
    carried, _ = seated(strip(stop(0.0, LENGTH, "above"), load=load))
    assert carried == pytest.approx(0.5 * weight, rel=1e-4)


@pytest.mark.parametrize(
    ("supports", "load", "words"),
    [
        ([stop(0.0, 0.7)], [], "tips it about x = 0.699 m, with its end at x = 2 m down"),
        ([stop(1.2, 2.0)], [], "tips it about x = 1.2 m, with its end at x = 0 m down"),
        (
            [stop(0.4, 0.6), stop(1.4, 1.6)],
            [force(0.0, -40.0)],
            "tips it about x = 0.402 m, with its end at x = 0 m down",
        ),
        ([stop(0.0, 2.0)], [force(1.0, 20.0)], "lifts it"),
    ],
    ids=["right", "left", "pressed", "lifted"],
)
def test_a_beam_that_leaves_is_refused_with_its_motion(
    supports: list[dict[str, Any]], load: list[dict[str, Any]], words: str
) -> None:
    """The message has the place about which it tips, within a contact point of the edge, or its direction."""
    simulation = gapbeam.model(gapbeam.read_case(strip(*supports, load=[{"type": "gravity"}, *load])))
    with pytest.raises(gapbeam.NotConverged) as caught:
        simulation.seat()
    found, place = str(caught.value), words.split("x = ")[1].split(" ")[0] if "tips" in words else ""
    if place:
        stated = float(found.split("tips it about x = ")[1].split(" ")[0])
        assert stated == pytest.approx(float(place), abs=6e-3)
        assert words.split(", ")[1] in found
    else:
        assert words in found


def test_a_pinned_beam_turns_about_its_pin() -> None:
    """A stop above cannot hold it: the joint allows the rigid motion, also of the model that has no other."""
    pin = [{"type": "pinned", "name": "pin", "point": 0.5}]
    for model in ("rigid", {"type": "beam", "elements": 40}):
        model = gapbeam.model(gapbeam.read_case(strip(stop(1.0, 1.5, "above"), joint=pin, model=model))).model
        force_of = model.system.combine_loads(np.array([load.factor(0.0) for load in model.system.loads]))
        escape = find_escape(model.system, force_of, RigidMotions.of_body(model.body, model.system.operators.size))
        assert escape is not None
        assert escape.words == "tips it about x = 0.5 m, with its end at x = 2 m down"


def test_a_rigid_body_tips_about_the_edge_of_its_support() -> None:
    """Its axis moves lengthwise by half its thickness times the angle, as the lower edge stays: it tips."""
    thick = {"length": LENGTH, "thickness": 0.05 * LENGTH, "width": WIDTH}
    simulation = gapbeam.model(gapbeam.read_case(strip(stop(0.0, 0.7), model="rigid", beam=thick)))
    with pytest.raises(gapbeam.NotConverged, match=r"tips it about x = 0\.7 m, with its end at x = 2 m down"):
        simulation.seat()


@pytest.mark.parametrize(("slenderness", "end"), [(40, 0.9), (100, 0.3), (100, 0.9)])
def test_a_pinned_rigid_bar_leans_on_a_raised_stop(slenderness: int, end: float) -> None:
    """It turns about its pin without strain until the stop carries it: sum of F x = W L / 2."""
    thickness = LENGTH / slenderness
    thick = {"length": LENGTH, "thickness": thickness, "width": thickness}
    pin = [{"type": "pinned", "name": "pin", "point": 0.0}]
    raised = stop(0.0, end * LENGTH, offset=0.02 * thickness)
    simulation = gapbeam.model(gapbeam.read_case(strip(raised, joint=pin, model="rigid", beam=thick)))
    contact, seat = simulation.model.system.contact, simulation.seat()
    moment = float(contact.weights * seat.state.pressure @ contact.positions[:, 0])
    assert moment == pytest.approx(0.5 * DENSITY * 9.81 * thickness**2 * LENGTH**2, rel=1e-6)


def tilted(model: dict[str, Any]) -> float:
    """Return the force of a stiff bar in a tilted hole that is met as a circle, N."""
    forces = [force(0.07, -50.0, "a"), force(0.05, 20.0, "b")]
    forces[0]["direction"], forces[1]["direction"] = [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]
    region = {"type": "hole", "contact": "circle"}
    hole = {"name": "h", "from": 0.04, "to": 0.06, "clearance": 1e-4, "tilt": 0.02, "offset": 2e-5, "lateral": 3e-5}
    tables = {
        "beam": {"length": 0.1, "thickness": 0.02, "width": 0.02, "section": "round"},
        "material": {"young_modulus": 2e13, "poisson_ratio": 0.3, "density": DENSITY},
        "support": [hole | {"region": region}],
        "contact": {"stiffness": 2.5e11},
        "model": model,
        "mesh": {"dimension": 3, "support_size": 0.01, "size": 0.02, "cells_through_thickness": 2},
        "load": forces,
        "probe": [{"name": "end", "point": 0.1}],
        "time": {"end": 2e-6, "step": 1e-6},
    }
    return seated(tables)[0]


def test_a_stiff_bar_rests_in_a_tilted_hole() -> None:
    """Round-off in its stiffness hides small updates of its pose: it is seated as the rigid body is.

    The rigid body touches at the points of the mesh; 8 stations see less of the edges of the hole than 20.
    """
    rigid = tilted({"type": "rigid"})
    assert tilted({"type": "beam"}) == pytest.approx(rigid, rel=0.02)
    assert tilted({"type": "beam", "stations": 20}) == pytest.approx(rigid, rel=0.01)
