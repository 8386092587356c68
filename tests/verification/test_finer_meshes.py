"""Finer meshes: the answer to everything that can be put on a solid converges as its cells get smaller.

The observed order of answers a, b, c on meshes with cells of size h, h/2 and h/4 is log2(|a - b| / |b - c|). Elements
of degree 2 have order 2 to 4 in displacements; forces that act along a line or an edge leave 2 or so.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from mpi4py import MPI

import gapbeam
from gapbeam.solver.models.model import build_model
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import VALUE

LENGTH, THICKNESS, WIDTH = 0.3, 0.1, 0.05  # short: shear and the ends matter
YOUNG, POISSON, DENSITY = 2.1e11, 0.3, 7850.0
AREA, SECOND = WIDTH * THICKNESS, WIDTH * THICKNESS**3 / 12.0
BENDING = YOUNG * SECOND
SHEAR = 10.0 * (1.0 + POISSON) / (12.0 + 11.0 * POISSON) * YOUNG / (2.0 * (1.0 + POISSON)) * AREA  # Cowper (1966)
PLACE = 0.2
ROOT = {"type": "clamped", "name": "root", "point": 0.0}
END = {"type": "pinned", "name": "end", "point": LENGTH}
PUSH = {"type": "exciter", "name": "push", "point": PLACE, "amplitude": 1e-9, "frequency": 10.0, "preload": -1.0e3}
GRAVITY = {"type": "gravity"}
TIP, AT = {"name": "tip", "point": LENGTH}, {"name": "at", "point": PLACE}
STOP = {"name": "far", "from": 0.2, "to": LENGTH, "region": {"type": "stop", "side": "below"}, "clearance": 9e-3}
SLOT = {"name": "slot", "from": 0.0, "to": 0.08, "clearance": 1e-5}
STIFF = {"axial": 1.0e9, "vertical": 1.0e8, "rotation": 1.0e6}
HEAD = {"name": "head", "point": 0.217, "mass": 100.0, "rotary_inertia": 0.1, "offset": [0.01, 0.07]}
WATER = {"name": "water", "from": 0.12, "to": 0.25, "displaced_mass": 1.0e3}
FLOW = {
    "type": "random-line-load",
    "name": "flow",
    "span": [0.05, 0.25],
    "seed": 1,
    "spectrum": {"type": "white", "density": 1.0, "high": 100.0},
    "coherence": {"type": "exponential", "length": 0.1},
}
FIXTURES: dict[str, dict[str, Any]] = {
    "clamped": {"joint": [ROOT], "load": [PUSH]},
    "pinned": {"joint": [ROOT | {"type": "pinned"}, END], "load": [PUSH], "probe": [AT]},
    "pinned inside": {
        "joint": [ROOT | {"type": "pinned", "point": 0.033}, END | {"point": 0.277}],
        "load": [PUSH],
        "probe": [AT],
    },
    "guided": {"joint": [ROOT | {"type": "guided"}, END], "load": [PUSH], "probe": [AT]},
    "elastic": {"joint": [ROOT | {"type": "elastic", "stiffness": STIFF}], "load": [PUSH]},
    "mass": {"joint": [ROOT], "mass": [HEAD], "load": [GRAVITY]},
    "fluid": {"joint": [ROOT], "fluid": [WATER], "load": [GRAVITY]},
    "suspension": {"joint": [ROOT], "load": [PUSH | {"mass": 5.0, "stiffness": 1.0e8}]},
    "force along": {"joint": [ROOT], "load": [PUSH | {"direction": [1.0, 1.0]}]},
    "force on the surface": {
        "joint": [ROOT],
        "load": [PUSH | {"point": [0.1, 0.05]}],  # a point: measured two thicknesses away
        "probe": [{"name": "top", "point": [LENGTH, 0.05]}],
    },
    "stop": {
        "support": [STOP | {"clearance": 0.0}, STOP | {"name": "near", "from": 0.0, "to": 0.06, "clearance": 0.0}],
        "load": [PUSH, GRAVITY],
        "probe": [AT],
    },
    "slot": {"support": [SLOT], "load": [PUSH | {"preload": -1.0e2}, GRAVITY]},
}


def tables(cells: int, dimension: int = 2, section: Any = "rectangle", **more: Any) -> dict[str, Any]:
    """Return a short cantilever, or whatever holds it, on a mesh with so many cells through the thickness."""
    size = THICKNESS / cells
    width = THICKNESS if "round" in str(section) or "tube" in str(section) else WIDTH
    mesh: dict[str, Any] = {
        "dimension": dimension,
        "size": size,
        "support_size": min(size, 0.05),
        "cells_through_thickness": cells,
    }
    if dimension == 3:
        mesh["cells_across_width"] = cells
    return {
        "beam": {"length": LENGTH, "thickness": THICKNESS, "width": width, "section": section},
        "material": {"young_modulus": YOUNG, "poisson_ratio": POISSON, "density": DENSITY},
        "support": [STOP],
        "contact": {"stiffness": 1.0e13},
        "mesh": mesh,
        "model": {"type": "full"},
        "probe": [TIP],
        "time": {"end": 1e-3, "step": 1e-4},
        **more,
    }


def answers(levels: tuple[int, ...], **more: Any) -> Array:
    """Return where the first probe is at the static seat on each mesh, m."""
    found = []
    for cells in levels:
        scene = gapbeam.model(gapbeam.read_case(tables(cells, **more)))
        (row, *_), operators = scene.model.probes.values(), scene.model.system.operators
        found.append(float(row.evaluate(scene.seat().state.u[VALUE], operators)[-1]))
    return np.array(found)


def assert_converges(found: Array, last: float, order: float = 1.5) -> None:
    """Steps get smaller with an order at least, and the last one is small.

    Args:
        found: Answers on meshes of cells halved twice.
        last: Largest last step, relative to the answer.
        order: The least order.
    """
    first, second = np.abs(np.diff(found))
    assert second < last * abs(found[-1])
    assert second <= 2.0**-order * first or first < 0.1 * last * abs(found[-1])


@pytest.mark.parametrize("name", FIXTURES)
def test_slices_converge(name: str) -> None:
    """Joints, masses, fluids, loads, probes and supports."""
    edges = "support" in FIXTURES[name]  # where contact begins and ends
    assert_converges(answers((2, 4, 8), **FIXTURES[name]), 1e-2 if edges else 1e-3, 1.2 if edges else 1.5)


def test_a_clamp_converges_to_beam_theory() -> None:
    """A cantilever of 20 thicknesses with shear (Timoshenko), on every mesh: the mean motions are those of theory."""
    length, force, arm = 2.0, 1.0e3, 4.0 / 3.0
    bent = force * arm**2 * (3.0 * length - arm) / (6.0 * BENDING)
    theory = -(bent + force * arm / SHEAR)
    assert theory == pytest.approx(-1.58421e-3, rel=1e-4)
    for cells in (1, 2, 5):
        long = tables(cells, joint=[ROOT], load=[PUSH | {"point": arm}], probe=[{"name": "tip", "point": length}])
        long["beam"]["length"] = length
        long["support"] = [STOP | {"from": 1.95, "to": length}]
        scene = gapbeam.model(gapbeam.read_case(long))
        (row,) = scene.model.probes.values()
        tip = row.evaluate(scene.seat().state.u[VALUE], scene.model.system.operators)[-1]
        assert tip == pytest.approx(theory, rel=1e-3)


def test_a_random_load_along_the_beam_converges() -> None:
    """Its patterns, each as a static load."""
    found = []
    for cells in (2, 4, 8):
        model = build_model(gapbeam.read_case(tables(cells, joint=[ROOT], load=[FLOW])), MPI.COMM_SELF)
        operators, (tip,) = model.system.operators, model.probes.values()
        solved = operators.factor(0.0, 1.0).solve(model.body.patterns[0])
        found.append(float(tip.evaluate(solved, operators)[-1]))
    assert_converges(np.array(found), 1e-3)


SOLIDS: dict[str, Any] = {
    "rectangle": "rectangle",
    "round": "round",
    "tube": {"type": "tube", "wall": 0.025},
    "box": {"type": "box", "wall": 0.0125},
    "i": {"type": "i", "web": 0.0125, "flange": 0.025},
}


RIDER = {"name": "head", "point": 0.217, "mass": 100.0, "offset": [0.0, 0.0, 0.07]}
LOADS: dict[str, dict[str, Any]] = {"force": {"load": [PUSH]}, "weight": {"load": [GRAVITY], "mass": [RIDER]}}


@pytest.mark.slow(minutes=0.5)
@pytest.mark.parametrize("name", SOLIDS)
@pytest.mark.parametrize("load", LOADS)
def test_solids_converge(name: str, load: str) -> None:
    """A clamped solid of each section under a force at a place of its axis, and its own weight with a mass."""
    found = answers((1, 2, 4), dimension=3, section=SOLIDS[name], joint=[ROOT], **LOADS[load])
    # a flange has one cell on the three meshes, and no order
    assert_converges(found, 5e-3, -0.5 if name == "i" else 0.7)


HELD: dict[str, Any] = {
    "slot": {"section": "rectangle", "support": [SLOT]},
    "hole": {"section": {"type": "tube", "wall": 0.025}, "support": [SLOT | {"region": {"type": "hole"}}]},
    "stops": {
        "section": "rectangle",
        "support": [STOP | {"clearance": 0.0}, STOP | {"name": "near", "from": 0.0, "to": 0.1, "clearance": 0.0}],
    },
}


@pytest.mark.slow(minutes=0.5)
@pytest.mark.parametrize("name", HELD)
def test_supported_solids_converge(name: str) -> None:
    """A solid that lies in its supports under its weight and a force."""
    found = answers((1, 2, 4), dimension=3, load=[PUSH | {"preload": -1.0e2}, GRAVITY], probe=[AT], **HELD[name])
    assert_converges(found, 2e-2, 0.7)
