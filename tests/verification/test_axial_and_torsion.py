"""Beams that move along their axis and twist: frequencies and statics in closed form, and torsion of the solid."""

from __future__ import annotations

from itertools import pairwise
from math import pi, tan
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI
from scipy.optimize import brentq

import gapbeam
from gapbeam.solver.models.model import Model, build_model
from gapbeam.solver.seat.contact_modes import Sections
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Array

LENGTH, DIAMETER = 0.6, 0.02
YOUNG, POISSON, DENSITY = 2.1e11, 0.3, 7919.0
SHEAR = YOUNG / (2.0 * (1.0 + POISSON))
AREA, POLAR = pi * DIAMETER**2 / 4.0, pi * DIAMETER**4 / 32.0
SPEEDS = {"axial": np.sqrt(YOUNG / DENSITY), "torsion": np.sqrt(SHEAR / DENSITY)}  # m/s, of a round rod
LINES = {"axial": DENSITY * AREA, "torsion": DENSITY * POLAR}  # kg/m, kg m
BOTH = pytest.mark.parametrize("motion", list(SPEEDS))
ALL = ["bending", "axial", "torsion"]


def tables(**more: Any) -> dict[str, Any]:
    """Return a round steel bar above a stop that it does not touch."""
    return {
        "beam": {"length": LENGTH, "thickness": DIAMETER, "width": DIAMETER, "section": "round"},
        "material": {"young_modulus": YOUNG, "poisson_ratio": POISSON, "density": DENSITY},
        "support": [{"name": "far", "from": 0.28, "to": 0.32, "clearance": 9.0e-3, "region": "stop"}],
        "restraint": {"axial": 1.0e-2, "lateral": 1.0e-2},
        "mesh": {"dimension": 3, "size": 0.06, "cells_through_thickness": 2, "cells_across_width": 2},
        "model": {"type": "beam", "elements": 60, "motions": ["lateral", *ALL]},
        "probe": [{"name": "tip", "point": LENGTH}],
        "time": {"end": 0.1, "step": 1.0e-4},
        **more,
    }


def clamp(point: float) -> dict[str, Any]:
    """Return a clamped joint."""
    return {"name": "root" if point == 0.0 else "end", "type": "clamped", "point": point}


def model_of(**more: Any) -> Model:
    """Return the model of a beam."""
    return build_model(gapbeam.read_case(tables(**more)), MPI.COMM_SELF)


def dense(model: Model) -> DenseOperators:
    """Return M and K of a small model."""
    assert isinstance(model.system.operators, DenseOperators)
    return model.system.operators


def frequencies(model: Model) -> Array:
    """Return the frequencies of a small model, Hz."""
    return np.asarray(np.sqrt(np.maximum(dense(model).modes[0], 0.0)) / (2.0 * pi))


def nearest(found: Array, wanted: Array) -> Array:
    """Return how far the nearest of the frequencies found are from those wanted, relative."""
    return np.asarray(np.min(np.abs(found[:, None] / wanted - 1.0), axis=0))


def probed(model: Model, u: Array) -> Array:
    """Return the displacement of the tip, (3,), m."""
    return np.asarray(model.probes["tip"].evaluate(u, model.system.operators))


def deformed(model: Model, load: int = 0) -> Array:
    """Return the static motion under a unit of a load, (n,)."""
    return np.asarray(np.linalg.solve(dense(model).stiffness, model.system.loads[load].pattern))


@BOTH
@pytest.mark.parametrize("ends", [(), (0.0,), (0.0, LENGTH)], ids=["free", "clamped-free", "clamped"])
def test_frequencies_of_rods(motion: str, ends: tuple[float, ...]) -> None:
    """Values n c / 2 L, or (2 n - 1) c / 4 L with one free end: the first three to 1e-6."""
    found = frequencies(model_of(joint=[clamp(end) for end in ends]))
    halves = np.arange(3) + (0.5 if len(ends) == 1 else 1.0)
    assert np.all(nearest(found, halves * SPEEDS[motion] / (2.0 * LENGTH)) < 1e-6)


@BOTH
def test_a_stepped_rod(motion: str) -> None:
    """tan(k L1) tan(k L2) = S1 / S2, S = E A or G J: two thicknesses of one material, clamped and free, to 1e-6."""
    thick, joined = 0.03, 0.24
    step = {"name": "root", "from": 0.0, "to": joined, "thickness": thick, "width": thick}
    found = frequencies(model_of(joint=[clamp(0.0)], segment=[step]))
    ratio = (thick / DIAMETER) ** (2 if motion == "axial" else 4)

    def missed(k: float) -> float:
        return np.sin(k * joined) * np.sin(k * (LENGTH - joined)) - ratio * np.cos(k * joined) * np.cos(
            k * (LENGTH - joined)
        )

    grid = np.linspace(0.1, 25.0, 500)
    pairs = [(a, b) for a, b in pairwise(grid) if missed(a) * missed(b) < 0.0][:3]
    roots = np.array([brentq(missed, a, b, xtol=1e-13) for a, b in pairs])
    assert len(roots) == 3
    assert np.all(nearest(found, roots * SPEEDS[motion] / (2.0 * pi)) < 1e-6)


@BOTH
def test_a_rod_with_an_inertia_at_its_end(motion: str) -> None:
    """Of a clamped rod with a mass M, or the inertia J about its axis: k L tan(k L) = m L / M, to 1e-6."""
    mass, polar = 1.2, 1.0e-3
    head = {"name": "head", "point": LENGTH, "mass": mass, "polar_inertia": polar}
    found = frequencies(model_of(joint=[clamp(0.0)], mass=[head]))
    ratio = LINES[motion] * LENGTH / (mass if motion == "axial" else polar)
    root = brentq(lambda x: x * tan(x) - ratio, 1e-6, 0.5 * pi - 1e-9, xtol=1e-14)
    assert nearest(found, np.array([root * SPEEDS[motion] / (2.0 * pi * LENGTH)]))[0] < 1e-6


def test_a_spring_along_the_beam_and_one_against_twist() -> None:
    """A free rod on an elastic joint at its end: k L tan(k L) = s L / S, to 1e-6 but for the restraint."""
    spring, turn = 3.0e7, 2.0e3
    joint = {"name": "end", "type": "elastic", "point": LENGTH, "stiffness": {"axial": spring, "twist": turn}}
    model = model_of(joint=[joint], model={"type": "beam", "elements": 60})
    found = frequencies(model)
    for motion, ratio in (("axial", spring * LENGTH / (YOUNG * AREA)), ("torsion", turn * LENGTH / (SHEAR * POLAR))):
        root = brentq(lambda x, r=ratio: x * tan(x) - r, 1e-6, 0.5 * pi - 1e-9, xtol=1e-14)
        assert nearest(found, np.array([root * SPEEDS[motion] / (2.0 * pi * LENGTH)]))[0] < 1e-6


def test_pull_and_twist_by_hand() -> None:
    """F L / E A along the beam, and T L / G J of a couple of two forces at the rim, at a probe beside the axis."""
    loads = [
        {"type": "harmonic_force", "name": "pull", "point": LENGTH, "amplitude": 1.0, "frequency": 9.0,
         "direction": [1.0, 0.0, 0.0]},
        *({"type": "harmonic_force", "name": name, "point": [LENGTH, y, 0.0], "amplitude": 1.0, "frequency": 9.0,
           "direction": [0.0, 0.0, y]} for name, y in (("left", 0.01), ("right", -0.01))),
    ]  # fmt: skip
    beside = [{"name": "tip", "point": [LENGTH, 0.004, 0.0]}]
    model = model_of(joint=[clamp(0.0)], load=loads, probe=beside, model={"type": "beam", "elements": 30})
    pulled, turned = deformed(model), deformed(model, 1) + deformed(model, 2)
    angle = 2.0 * 0.01 * LENGTH / (SHEAR * POLAR)
    assert probed(model, pulled) == pytest.approx([LENGTH / (YOUNG * AREA), 0.0, 0.0], rel=1e-8, abs=1e-15)
    assert probed(model, turned) == pytest.approx([0.0, 0.0, 0.004 * angle], rel=1e-8, abs=1e-15)


def test_a_pull_beside_the_axis_bends_the_beam() -> None:
    """The moment F z of a pull at height z lowers the tip by F z L^2 / 2 E I; the axis lengthens by F L / E A."""
    height = 0.005
    pull = {"type": "harmonic_force", "name": "pull", "point": [LENGTH, 0.0, height], "amplitude": 1.0,
            "frequency": 9.0, "direction": [1.0, 0.0, 0.0]}  # fmt: skip
    model = model_of(joint=[clamp(0.0)], load=[pull], model={"type": "beam", "elements": 30})
    second = pi * DIAMETER**4 / 64.0
    wanted = [LENGTH / (YOUNG * AREA), 0.0, -height * LENGTH**2 / (2.0 * YOUNG * second)]
    assert probed(model, deformed(model)) == pytest.approx(wanted, rel=1e-7, abs=1e-16)


def test_a_beam_under_its_own_weight_hangs() -> None:
    """The end of a beam that hangs from its clamp goes down by rho g L^2 / 2 E."""
    hanging = [{"type": "gravity", "direction": [1.0, 0.0, 0.0]}]
    model = model_of(joint=[clamp(0.0)], load=hanging, model={"type": "beam", "elements": 10})
    factor = model.system.load_factors(0.0)[0]
    wanted = DENSITY * LENGTH**2 / (2.0 * YOUNG)
    assert factor * probed(model, deformed(model))[0] == pytest.approx(9.81 * wanted, rel=1e-7)


# Steel beams of 40 mm, clamped at x = 0: their section, width and how near the beam is to the solid
SOLIDS = {
    "round": ("round", 0.04, 0.01),
    "tube": ({"type": "tube", "wall": 0.006}, 0.04, 0.01),
    "rectangle": ("rectangle", 0.03, 0.01),
    "box": ({"type": "box", "wall": 0.008}, 0.03, 0.01),
}


LONG = ("round", "tube")


@pytest.mark.parametrize("name", [pytest.param(one, marks=pytest.mark.slow if one in LONG else ()) for one in SOLIDS])
def test_torsion_of_the_solid(name: str) -> None:
    """The first torsional and axial frequencies of a cantilever, beam elements against the reduced solid."""
    section, width, within = SOLIDS[name]
    beam = {"length": LENGTH, "thickness": 0.04, "width": width, "section": section}
    region = "hole" if width == 0.04 else "slot"
    support = [{"name": "far", "from": 0.28, "to": 0.32, "clearance": 2.0e-4, "region": region}]
    more = {"beam": beam, "support": support, "joint": [clamp(0.0)]}
    mesh = {"dimension": 3, "size": 0.03, "cells_through_thickness": 4, "cells_across_width": 4}
    found = {}
    for kind in (
        {"type": "beam", "elements": 60, "motions": ["lateral", *ALL]},
        {"type": "reduced", "modes": 16, "points_across": 1},
    ):
        beside = {"load": [{"type": "harmonic_force", "name": "side", "point": LENGTH, "amplitude": 1.0,
                            "frequency": 9.0, "direction": [0.0, 1.0, 1.0]}]}  # fmt: skip
        model = model_of(**more, mesh=mesh, model=kind, **beside)
        squares, shapes = dense(model).modes
        sections = Sections(model)
        order = np.argsort(squares)[:14]
        kinds = [sections.motion(shapes[:, mode]).kind for mode in order]
        found[kind["type"]] = {
            one: float(np.sqrt(squares[order[kinds.index(one)]]) / (2.0 * pi)) for one in ("axial", "torsional")
        }
    for one in ("axial", "torsional"):
        assert found["beam"][one] == pytest.approx(found["reduced"][one], rel=within), found
