"""Draw beams that lie, lean or hang in supports, and judge each seat by statics and each refusal by a linear program.

environment/run python3 -m benchmarks.drawn_seats 300

A rigid motion moves contact point i by n_i . u(x_i) out of its face. Loads do work along a motion that opens all gaps
(or leaves them as they are) and that joints allow, or contact forces >= 0 balance them: one of both, never both. The
program is set up here from the places of contact points, normals, weights and forces of the case alone.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import strategies as st
from scipy.optimize import linprog

import gapbeam
from benchmarks.drawn_cases.scenes import GRAVITY, last_drawn
from benchmarks.table import Table
from gapbeam.solver.case.analysis_table import NAMES, RigidMotion, unit_motions
from gapbeam.solver.loads.places import PointForce
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.seat.escape import RigidMotions
from gapbeam.solver.seat.static_seat import Seat
from gapbeam.solver.system.operators import Array

BALANCED = (
    1.0e-4  # of the largest force: what a seat may leave of a balance; meshes of round sections weigh so much less
)
MOVES = 1.0e-6  # work of loads along a rigid motion, over the largest
IN_PLANE = ("vertical", "rotation")
ACROSS = ("lateral", "vertical", "rotation", "lateral_rotation")
EDGE = 0.02  # of the length: as far as a support may end elsewhere before a verdict depends on its edge


@dataclass(frozen=True)
class Judged:
    """A scene, what the program made of it, and what is wrong with that.

    Attributes:
        tables: The case.
        family: One of FAMILIES.
        verdict: "seated", "refused" or "edge": the center of the loads lies at the edge of a support.
        fault: The fault; empty: none.
        seconds: Wall time of the seat.
    """

    tables: dict[str, Any]
    family: str
    verdict: str
    fault: str
    seconds: float


def _decade(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high).map(lambda exponent: float(f"{10.0**exponent:.4g}"))


def _share(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high).map(lambda share: round(share, 3))


@st.composite
def plane_scenes(draw: st.DrawFn) -> dict[str, Any]:
    """Return a slice on long faces, edges and stops, with jacks that lift it or press it down."""
    length = draw(_decade(-1.0, 0.7))
    thickness = float(f"{length * draw(_decade(-2.6, -1.2)):.4g}")
    steel = draw(st.booleans())
    modulus, density = (2.1e11, 7850.0) if steel else (3.0e9, 1200.0)
    width = 2.0 * thickness
    weight = density * GRAVITY * length * thickness * width
    supports: list[dict[str, Any]] = []
    for number in range(draw(st.integers(1, 4))):
        start = draw(_share(0.0, 0.9))
        end = min(1.0, round(start + draw(st.sampled_from((0.05, 0.1, 0.3, 0.6, 1.0))), 3))
        if any(start * length < one["to"] and one["from"] < end * length for one in supports):
            continue
        region = draw(st.sampled_from(("stop", "stop", "stop", "slot", "above")))
        supports.append(
            {
                "name": f"s{number}",
                "from": start * length,
                "to": end * length,
                "clearance": draw(st.sampled_from((0.0, 1.0e-3, 0.1))) * thickness,
                "offset": draw(st.sampled_from((0.0, 0.0, -0.01, 0.02))) * thickness if region != "slot" else 0.0,
                "region": {"type": "stop", "side": "above"} if region == "above" else region,
            }
            | _body(draw, weight, length)
        )
    model = draw(st.sampled_from(("rigid", "beam", "beam", "beam", "reduced", "full")))
    return {
        "title": "drawn seat",
        "beam": {"length": length, "thickness": thickness, "width": width},
        "material": {"young_modulus": modulus, "poisson_ratio": 0.3, "density": density},
        "support": supports,
        "load": [
            {"type": "gravity"},
            *_jacks(draw, length, weight, ((0.0, 1.0),)),
        ],
        "joint": [{"type": "pinned", "name": "pin", "point": draw(_share(0.0, 1.0)) * length}]
        if draw(st.integers(0, 7)) == 0
        else [],
        "mesh": {
            "dimension": 2,
            "support_size": length / draw(st.sampled_from((40, 80))),
            "cells_through_thickness": 1,
        },
        "model": model,
        "contact": _contact(draw, modulus, thickness, length) | _formulation(draw, model) | _friction(draw),
        "time": {"end": 1.0e-3, "step": 1.0e-4},
    }


@st.composite
def round_scenes(draw: st.DrawFn) -> dict[str, Any]:
    """Return a round beam in holes, polygons and V-blocks, which may be tilted and aside, pulled in all directions."""
    length = draw(_decade(-1.0, 0.5))
    thickness = float(f"{length * draw(_decade(-2.0, -1.0)):.4g}")
    modulus, density = 2.1e11, 7850.0
    weight = density * GRAVITY * length * 0.25 * math.pi * thickness**2
    clearance = thickness * draw(st.sampled_from((1.0e-3, 1.0e-2)))
    supports: list[dict[str, Any]] = []
    for number, place in enumerate(draw(st.lists(st.sampled_from((0.1, 0.35, 0.6, 0.85)), min_size=1, unique=True))):
        region = draw(
            st.sampled_from(
                (
                    {"type": "hole", "contact": "circle"},
                    {"type": "hole", "contact": "circle"},
                    {"type": "hole"},
                    {"type": "polygon", "walls": [-135.0, -45.0, 45.0, 135.0]},
                    {"type": "polygon", "walls": [-45.0, 45.0]},
                )
            )
        )
        aside = st.sampled_from((0.0, 0.0, 0.3, -0.4))
        supports.append(
            {
                "name": f"s{number}",
                "from": place * length,
                "to": (place + draw(st.sampled_from((0.03, 0.1)))) * length,
                "clearance": clearance,
                "tilt": draw(st.sampled_from((0.0, 0.0, 0.01))),
                "offset": draw(aside) * clearance,
                "lateral": draw(aside) * clearance,
                "region": region,
            }
        )
    directions = ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (0.0, 0.6, 0.8))
    return {
        "title": "drawn seat",
        "beam": {"length": length, "thickness": thickness, "width": thickness, "section": "round"},
        "material": {"young_modulus": modulus, "poisson_ratio": 0.3, "density": density},
        "support": supports,
        "load": [{"type": "gravity"}, *_jacks(draw, length, weight, directions)],
        "mesh": {"dimension": 3, "support_size": 0.03 * length, "size": 0.1 * length, "cells_through_thickness": 2},
        "model": draw(st.sampled_from((*({"type": "beam", "elements": 40},) * 5, {"type": "rigid"}))),
        "contact": {"stiffness": draw(st.sampled_from((1.0e-3, 1.0e-2, 1.0))) * modulus / thickness} | _friction(draw),
        "time": {"end": 1.0e-3, "step": 1.0e-4},
    }


@st.composite
def point_scenes(draw: st.DrawFn) -> dict[str, Any]:
    """Return a slice that touches base and gland at points, with jacks."""
    length = draw(_decade(-1.0, 0.7))
    thickness = float(f"{length * draw(_decade(-2.3, -1.2)):.4g}")
    modulus, density, width = 2.1e11, 7850.0, 2.0 * thickness
    weight = density * GRAVITY * length * thickness * width
    supported = draw(_share(0.1, 0.9))
    shares = draw(st.lists(_share(0.05, 0.95), min_size=1, max_size=4, unique=True))
    return {
        "title": "drawn seat",
        "beam": {"length": length, "thickness": thickness, "width": width},
        "material": {"young_modulus": modulus, "poisson_ratio": 0.3, "density": density},
        "support": {"length": supported * length, "clearance": draw(st.sampled_from((0.0, 1.0e-3, 0.1))) * thickness},
        "load": [{"type": "gravity"}, *_jacks(draw, length, weight, ((0.0, 1.0),))],
        "mesh": {"dimension": 2, "support_size": 0.02 * supported * length, "cells_through_thickness": 1},
        "model": draw(st.sampled_from(("rigid", "beam", "beam", "reduced", "full"))),
        "contact": {
            "points": sorted(round(share * supported * length, 6) for share in shares),
            "patch": 0.06 * supported * length,
            "stiffness": draw(_decade(-4.0, 0.0)) * modulus * thickness,
        }
        | _friction(draw),
        "time": {"end": 1.0e-3, "step": 1.0e-4},
    }


FACES, ROUND, POINTS = "faces, edges, stops and pins", "holes, polygons and V-blocks", "points"
FAMILIES = {FACES: plane_scenes(), ROUND: round_scenes(), POINTS: point_scenes()}
IN_TURN = (FACES, ROUND, FACES, POINTS, FACES)  # by the number of a scene
VERDICTS = ("seated", "refused", "edge")


def _body(draw: st.DrawFn, weight: float, length: float) -> dict[str, Any]:
    """Return the body of a support, on a spring that its own weight and the beam press in by less than 1e-3 of L."""
    if draw(st.integers(0, 4)):
        return {}
    pressed = 2.0 * weight / (length * draw(_decade(-6.0, -3.0)))
    return {"body": {"mass": weight / GRAVITY * draw(st.sampled_from((0.01, 0.3))), "stiffness": pressed}}


def _formulation(draw: st.DrawFn, model: str) -> dict[str, Any]:
    if model != "full":
        return {}
    return {"formulation": draw(st.sampled_from(("penalty", "penalty", "nitsche", "unilateral")))}


def _friction(draw: st.DrawFn) -> dict[str, Any]:
    """Return friction, which bears nothing at rest: the seat is that without it."""
    return {"friction": {"coefficient": draw(st.sampled_from((0.1, 1.0)))}} if draw(st.integers(0, 4)) == 0 else {}


def _jacks(
    draw: st.DrawFn, length: float, weight: float, directions: tuple[tuple[float, ...], ...]
) -> list[dict[str, Any]]:
    found = []
    for number in range(draw(st.integers(0, 2))):
        found.append(
            {
                "type": "exciter",
                "name": f"jack{number}",
                "point": draw(_share(0.0, 1.0)) * length,
                "amplitude": 0.0,
                "frequency": 10.0,
                "preload": draw(st.sampled_from((-1.0, 0.1, 0.2, 0.3, 0.5, 1.1))) * weight,
                "direction": list(draw(st.sampled_from(directions))),
            }
        )
    return found


def _contact(draw: st.DrawFn, modulus: float, thickness: float, length: float) -> dict[str, Any]:
    kind = draw(st.sampled_from(("auto", "auto", "given", "given", "power", "ramps")))
    stiffness = draw(_decade(-4.0, 2.0)) * modulus / thickness
    if kind == "power":
        law = {"type": "hunt-crossley", "exponent": 1.5, "restitution": 0.9}
        return {"stiffness": stiffness / math.sqrt(1.0e-4 * thickness), "law": law}
    if kind == "ramps":
        law = {"type": "piecewise-linear", "depths": [1.0e-5 * length], "factors": [3.0]}
        return {"stiffness": stiffness, "law": law}
    return {} if kind == "auto" else {"stiffness": stiffness}


def judged(tables: dict[str, Any], family: str) -> Judged:
    """Seat a scene, and judge the seat or its refusal."""
    simulation = gapbeam.model(gapbeam.read_case(tables))
    started = time.perf_counter()
    try:
        seat, refusal = simulation.seat(), ""
    except gapbeam.NotConverged as error:
        seat, refusal = None, str(error)
    seconds = time.perf_counter() - started
    openings, works = _cone(simulation)
    weight, largest = _weight(simulation), max(float(np.max(np.abs(works))), MOVES * _weight(simulation))
    work, reserve = _work(openings, np.asarray(works / largest))
    if seat is not None:
        fault = _unbalanced(simulation, seat, openings, works, weight)
        fault = fault or ("a seat, though a rigid motion leads away" if work > MOVES else "")
        return Judged(tables, family, "edge" if fault and reserve else "seated", "" if reserve else fault, seconds)
    confirmed = work > MOVES and "a rigid motion that no contact opposes" in refusal
    return Judged(tables, family, "refused" if confirmed else "edge", "" if confirmed or reserve else refusal, seconds)


def _cone(simulation: Simulation) -> tuple[Array, Array]:
    """Return the openings at contact points by rigid motions that joints allow, (m, k), and the work of loads, (k,).

    Stations in round holes give two rows of both signs: nothing leaves a hole.
    """
    model = simulation.model
    case, contact = simulation.case, model.system.contact
    length, flat = model.length, model.dimension == 2
    motions = [
        (one, 1.0 if any(one.translation) else 1.0 / length)
        for name, one in zip(NAMES, unit_motions(), strict=True)
        if name in (IN_PLANE if flat else ACROSS)
    ]
    rows = []
    for point, (x, across) in enumerate(zip(contact.positions[:, 0], contact.across, strict=True)):
        moved = np.array([[size * _axis(one, x, name) for name in ("lateral", "vertical")] for one, size in motions])
        if point in contact.circles.points:
            rows += [*moved.T, *(-moved.T)]
        else:
            rows.append(moved @ (across if not flat else np.array([0.0, across[-1] or across[0]])))
    forces = np.array([_work_of_loads(simulation, one) * size for one, size in motions])
    held = [
        [size * _axis(one, joint.point, name) for one, size in motions]
        for joint in case.joint
        for name in ("vertical",)
    ]
    return np.array([*rows, *held, *(-np.array(held) if held else [])]), forces


def _axis(motion: RigidMotion, x: float, name: str) -> float:
    return float(motion.section(float(x))[name])  # type: ignore[index]


def _weight(simulation: Simulation) -> float:
    """Return the weight of the beam, N."""
    beam = simulation.case.beam
    return simulation.case.material.density * beam.area * beam.length * GRAVITY


def _work_of_loads(simulation: Simulation, motion: RigidMotion) -> float:
    case, work = simulation.case, 0.0
    for load in case.load:
        if not isinstance(load.place, PointForce):
            work -= _weight(simulation) * _axis(motion, 0.5 * case.beam.length, "vertical")
            continue
        *aside, up = load.direction if load.direction is not None else (0.0, 1.0)
        across, x = aside[1] if len(aside) > 1 else 0.0, float(np.max(load.place.point))
        force = load.static_force.force if load.static_force is not None else 0.0
        work += force * (up * _axis(motion, x, "vertical") + across * _axis(motion, x, "lateral"))
    return work


def _work(openings: Array, works: Array) -> tuple[float, bool]:
    """Return the largest work of forces of size 1, and whether slightly other loads have another verdict."""
    found = linprog(
        -works,
        A_ub=-1.0e4 * openings,
        b_ub=np.zeros(len(openings)),
        bounds=(-1.0, 1.0),
        method="highs",
    )
    work = float(-found.fun)
    return work, work < EDGE if work > MOVES else _margin(openings, works) < EDGE


def _margin(openings: Array, works: Array) -> float:
    """Return by how much loads of size 1 may change before contact forces no longer balance them."""
    count, margin = openings.shape[1], 1.0
    for axis in range(count):
        for sign in (-1.0, 1.0):
            # largest t with works + t e = -openings^T f for some f >= 0
            step = np.zeros(count)
            step[axis] = sign
            found = linprog(
                np.concatenate([np.zeros(len(openings)), [-1.0]]),
                A_eq=np.column_stack([openings.T, step]),
                b_eq=-works,
                bounds=[(0.0, None)] * len(openings) + [(0.0, 1.0)],
                method="highs",
            )
            margin = min(margin, float(-found.fun) if found.x is not None else 0.0)
    return margin


def _unbalanced(simulation: Simulation, seat: Seat, openings: Array, works: Array, weight: float) -> str:
    """Return the part of the loads that contact and restraint do not balance, joints and holes aside; empty: none."""
    model = simulation.model
    contact = model.system.contact
    if contact.circles or simulation.case.joint:
        return ""
    forces = contact.weights * seat.state.pressure
    if np.any(forces < 0.0):
        return "contact pulls"
    rigid = RigidMotions.of_body(model.body, model.system.operators.size)
    restraint = model.system.operators.apply_restraint(seat.state.u[0])
    kept = [name for name in NAMES if name in (IN_PLANE if simulation.case.mesh.dimension == 2 else ACROSS)]
    held = {next(iter(one.names)): shape @ restraint for one, shape in zip(rigid.motions, rigid.shapes, strict=True)}
    missing = works + openings.T @ forces - np.array([held.get(name, 0.0) for name in kept])
    size = float(max(weight, np.max(np.abs(works)), np.sum(forces)))
    if np.max(np.abs(missing)) > BALANCED * size:
        return f"a seat out of balance by {np.max(np.abs(missing)) / size:.3g} of the forces"
    return ""


def drawn_scene(number: int) -> dict[str, Any]:
    """Return the scene of a number; five in a row go through all families."""
    return last_drawn(FAMILIES[IN_TURN[number % len(IN_TURN)]], number, _is_refused)


def _is_refused(tables: dict[str, Any]) -> bool:
    try:
        gapbeam.read_case(tables)
    except gapbeam.CaseError:
        return True
    return False


def drawn(count: int, first: int = 0) -> list[Judged]:
    """Return the scenes of so many numbers, judged."""
    found: list[Judged] = []
    for number in range(first, first + count):
        one = judged(drawn_scene(number), IN_TURN[number % len(IN_TURN)])
        found.append(one)
        print(f"{number:4d} {one.verdict:8s} {one.seconds:6.2f} s  {one.fault[:300]}", file=sys.stderr, flush=True)
    return found


def main() -> int:
    """Draw scenes, and return 0, or 1 where one is judged wrongly."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("count", type=int, nargs="?", default=300)
    parser.add_argument("--first", type=int, default=0, help="number of the first scene")
    parser.add_argument("--output", type=Path, default=Path("results/bench"))
    options = parser.parse_args()
    found = drawn(options.count, options.first)
    rows = []
    for family in FAMILIES:
        ones = [one for one in found if one.family == family]
        counts = (sum(one.verdict == verdict for one in ones) for verdict in VERDICTS)
        longest = max((one.seconds for one in ones), default=None)
        rows.append((family, *counts, sum(bool(one.fault) for one in ones), longest))
    notes = (
        "seated: contact and restraint balance the loads to 1e-4 of the forces, and no rigid motion leads away",
        "refused: the message names a rigid motion, and a linear program of its own finds one",
        "edge: loads that differ by 2 % of the largest force have another verdict, and the program failed to give one",
    )
    faults = sum(bool(one.fault) for one in found)
    Table(
        "drawn_seats",
        f"Seats of {len(found)} drawn scenes",
        ("family", *VERDICTS, "wrong", "longest search, s"),
        tuple(rows),
        notes,
        {"scenes": len(found), "wrong": faults},
    ).write(options.output)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
