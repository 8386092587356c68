"""Beams of all cross-sections: frequencies and deflections of beam theory, and solids beside beam elements."""

from __future__ import annotations

from math import pi, sqrt
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI

import gapbeam
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.models.model import Model, build_model
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import VALUE

YOUNG, POISSON, DENSITY = 2.1e11, 0.3, 7919.0
SHEAR = YOUNG / (2.0 * (1.0 + POISSON))
FIRST_ROOT = 1.8751040687119611  # of 1 + cos x cosh x
TUBE = {"type": "tube", "wall": 0.004}
# section, width for a thickness of 0.04 m, and kappa of Cowper's table 1 by hand for nu = 0.3
SECTIONS: dict[str, tuple[Any, float, float]] = {
    "rectangle": ("rectangle", 0.04, 13.0 / 15.3),
    "round": ("round", 0.04, 7.8 / 8.8),
    "tube": (TUBE, 0.04, 7.8 * 1.64**2 / (8.8 * 1.64**2 + 23.6 * 0.64)),
    "box": ({"type": "box", "wall": 0.004}, 0.04, 13.0 * 16.0 / (324.0 + 0.3 * 302.0 + 10.0 * 6.3)),
    "i": ({"type": "i", "web": 0.006, "flange": 0.006}, 0.03, 0.0),
}
ALL = pytest.mark.parametrize("name", SECTIONS)


def clamped(name: str, model: dict[str, Any], length: float = 0.6, **load: Any) -> Model:
    """Return a cantilever in a slot that it does not touch, with a force at its tip."""
    section, width, _ = SECTIONS[name]
    case = {
        "beam": {"length": length, "thickness": 0.04, "width": width, "section": section},
        "material": {"young_modulus": YOUNG, "poisson_ratio": POISSON, "density": DENSITY},
        "support": [{"name": "far", "from": 0.9 * length, "to": 0.95 * length, "clearance": 9.0e-3}],
        "joint": [{"name": "root", "type": "clamped", "point": 0.0}],
        "restraint": {"axial": 1e-6, "lateral": 1e-6},
        "mesh": {"dimension": 3, "size": 0.04, "support_size": 0.025},
        "model": model,
        "load": [
            {"type": "harmonic_force", "name": "f", "point": length, "amplitude": 1.0, "frequency": 5.0, **load},
        ],
        "probe": [{"name": "tip", "point": length}],
        "time": {"end": 0.1, "step": 1.0e-4},
    }
    return build_model(gapbeam.read_case(case), MPI.COMM_SELF)


def frequencies(model: Model) -> Array:
    """Return the frequencies of a small model, ascending, Hz."""
    assert isinstance(model.system.operators, DenseOperators)
    return np.asarray(np.sqrt(np.maximum(model.system.operators.modes[0], 0.0)) / (2.0 * pi))


@ALL
def test_beam_elements_bend_and_shear_as_their_section_does(name: str) -> None:
    """The tip under a force there: P L^3 / (3 E I) + P L / (kappa G A)."""
    model = clamped(name, {"type": "beam", "elements": 8})
    beam, length = model.case.beam, model.case.beam.length
    kappa = SECTIONS[name][2] or beam.shear_coefficient(POISSON)
    squares, shapes = model.system.operators.modes
    force = model.body.patterns[0] @ shapes
    found = float(np.sum(force**2 / squares))
    wanted = length**3 / (3.0 * YOUNG * beam.second_moment) + length / (kappa * SHEAR * beam.area)
    assert found == pytest.approx(wanted, rel=1e-8)


# int y^2 dA by hand, and the area that carries shear across over all
ASIDE = {
    "rectangle": (0.04 * 0.04**3 / 12.0, 13.0 / 15.3),
    "round": (pi * 0.04**4 / 64.0, 7.8 / 8.8),
    "box": ((0.04**4 - 0.032**4) / 12.0, None),
    "i": ((2.0 * 0.006 * 0.03**3 + 0.028 * 0.006**3) / 12.0, 13.0 / 15.3 * 0.36 / 0.528),
}


@pytest.mark.parametrize("name", ASIDE)
def test_beam_elements_bend_in_two_planes(name: str) -> None:
    """Under a force 30 degrees off the bending axis the tip moves as under both components, each in its own plane."""
    slanted = clamped(name, {"type": "beam", "elements": 8}, direction=[0.0, 0.5, sqrt(0.75)])
    beam, length = slanted.case.beam, slanted.case.beam.length
    second, share = ASIDE[name]
    kappa = share or beam.lateral_shear_coefficient(POISSON)
    squares, shapes = slanted.system.operators.modes
    moved = slanted.probes["tip"].matrix @ (shapes @ ((slanted.body.patterns[0] @ shapes) / squares))
    across = length**3 / (3.0 * YOUNG * second) + length / (kappa * SHEAR * beam.area)
    upward = length**3 / (3.0 * YOUNG * beam.second_moment) + length / (
        beam.shear_coefficient(POISSON) * SHEAR * beam.area
    )
    assert moved == pytest.approx([0.0, 0.5 * across, sqrt(0.75) * upward], rel=1e-8, abs=1e-16)


@ALL
def test_slender_beams_vibrate_as_euler_and_bernoulli_say(name: str) -> None:
    """The first frequency of a cantilever, 40 times as long as thick."""
    model = clamped(name, {"type": "beam", "elements": 60}, 1.6)
    beam = model.case.beam
    wanted = FIRST_ROOT**2 / (2.0 * pi * 1.6**2) * sqrt(YOUNG * beam.second_moment / (DENSITY * beam.area))
    assert frequencies(model)[0] == pytest.approx(wanted, rel=2.5e-3)


@pytest.mark.slow(minutes=0.3)
@ALL
def test_solids_vibrate_as_beam_elements_do(name: str) -> None:
    """The two lowest bending frequencies of a cantilever, 15 times as long as thick; nothing moves out of its plane."""
    solid = frequencies(clamped(name, {"type": "reduced", "modes": 8}))
    beam = frequencies(clamped(name, {"type": "beam", "elements": 40}))
    assert solid[:2] == pytest.approx(beam[:2], rel=0.012)


def tip_of_tube(model: dict[str, Any]) -> float:
    """Return the height of the tip of a tube between flat plates at rest, m."""
    case = {
        "beam": {"length": 0.8, "thickness": 0.05, "width": 0.05, "section": {"type": "tube", "wall": 0.005}},
        "material": {"young_modulus": 2.0e11, "poisson_ratio": 0.3, "density": 7850.0},
        "support": {"length": 0.1, "clearance": 2.0e-4},
        "mesh": {"dimension": 3, "support_size": 0.02, "cells_through_thickness": 2, "cells_across_width": 2},
        "model": model,
        "load": [{"type": "gravity"}],
        "probe": [{"name": "tip", "point": 0.8}],
        "time": {"end": 0.1, "step": 1.0e-4},
    }
    built = build_model(gapbeam.read_case(case), MPI.COMM_SELF)
    state = Simulation(built).seat().state
    return float(built.probes["tip"].evaluate(state.u[VALUE], built.system.operators)[-1])


@pytest.mark.slow(minutes=0.1)
def test_a_tube_between_plates_rests_as_its_solid_does() -> None:
    """By hand the rigid tube turns about the edge of the base, and sinks by its play; bending adds some of it."""
    full = tip_of_tube({"type": "full"})
    rigid = -2.0e-4 * 0.7 / 0.1
    assert 1.0 < full / rigid < 1.2
    assert tip_of_tube({"type": "reduced"}) == pytest.approx(full, rel=2e-3)
    assert tip_of_tube({"type": "rigid"}) == pytest.approx(rigid, rel=0.03)
    assert tip_of_tube({"type": "beam"}) == pytest.approx(full, rel=0.03)


def test_the_lateral_restraint_holds_a_beam_in_a_slot() -> None:
    """Beside its plane a beam in a slot swings on the restraint alone, at the frequency of its mass on it."""
    case = {
        "beam": {"length": 0.4, "thickness": 0.04, "width": 0.04},
        "material": {"young_modulus": YOUNG, "poisson_ratio": POISSON, "density": DENSITY},
        "support": [{"name": "whole", "from": 0.0, "to": 0.4, "clearance": 1e-4}],
        "restraint": {"lateral": 5.0e3},
        "mesh": {"dimension": 3, "support_size": 0.05, "size": 0.05},
        "model": {"type": "beam", "elements": 20},
        "load": [{"type": "harmonic_force", "point": 0.2, "amplitude": 1.0, "frequency": 5.0}],
        "probe": [{"name": "tip", "point": 0.4}],
        "time": {"end": 0.1, "step": 1.0e-4},
    }
    case["load"][0]["direction"] = [0.0, 1.0, 0.0]
    found = frequencies(build_model(gapbeam.read_case(case), MPI.COMM_SELF))
    wanted = sqrt(5.0e3 / (DENSITY * 0.04 * 0.04 * 0.4)) / (2.0 * pi)
    turning = wanted / sqrt(1.0 + (0.04 / 0.4) ** 2)  # the spread spring holds it alike, rotary inertia slows it
    assert found[2:4] == pytest.approx([turning, wanted], rel=1e-4)
