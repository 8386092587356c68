"""Masses beside the axis of the beam: transfer matrices, a rigid body by SciPy, statics by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from mpi4py import MPI
from scipy.linalg import eigh, expm
from scipy.optimize import brentq

import gapbeam
from gapbeam.solver.models.model import Model, build_model
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Array

LENGTH, DIAMETER = 0.6, 0.02
YOUNG, POISSON, DENSITY, GRAVITY = 2.1e11, 0.3, 7850.0, 9.81
SHEAR_MODULUS = YOUNG / (2.0 * (1.0 + POISSON))
AREA, SECOND = np.pi * DIAMETER**2 / 4.0, np.pi * DIAMETER**4 / 64.0
BENDING, TORSION = YOUNG * SECOND, SHEAR_MODULUS * 2.0 * SECOND
SHEAR = 6.0 * (1.0 + POISSON) / (7.0 + 6.0 * POISSON) * SHEAR_MODULUS * AREA  # Cowper (1966)
MASS, ROTARY, POLAR = 0.5, 2.0e-4, 3.0e-4  # kg, kg m^2
OFFSET = (0.02, 0.05, -0.08)  # m
ROOT = {"name": "root", "type": "clamped", "point": 0.0}


def head(offset: tuple[float, ...], point: float = LENGTH, **more: Any) -> dict[str, Any]:
    """Return a mass with rotary inertia beside the axis."""
    inertia = {"rotary_inertia": ROTARY, "polar_inertia": POLAR}
    return {"name": "head", "point": point, "mass": MASS, "offset": list(offset), **inertia, **more}


def model_of(kind: str, mass: dict[str, Any], dimension: int = 3, **more: Any) -> Model:
    """Return a round rod, or its slice, in a slot that it does not touch."""
    section = {"section": "round"} if dimension == 3 else {}
    tables = {
        "beam": {"length": LENGTH, "thickness": DIAMETER, "width": DIAMETER} | section,
        "material": {"young_modulus": YOUNG, "poisson_ratio": POISSON, "density": DENSITY},
        "support": [{"name": "far", "from": 0.30, "to": 0.32, "clearance": 9.0e-3}],
        "restraint": {"axial": 1.0, "lateral": 1.0},
        "mesh": {"size": 0.03, "support_size": 0.01, "cells_through_thickness": 2, "dimension": dimension},
        "model": {"type": kind} | ({"elements": 60} if kind == "beam" else {}),
        "probe": [{"name": "tip", "point": LENGTH}],
        "joint": [ROOT],
        "mass": [mass],
        "time": {"end": 0.1, "step": 1.0e-4},
        **more,
    }
    return build_model(gapbeam.read_case(tables), MPI.COMM_SELF)


def frequencies(model: Model) -> Array:
    """Return the frequencies of a small model, ascending, Hz."""
    assert isinstance(model.system.operators, DenseOperators)
    return np.asarray(np.sqrt(np.maximum(model.system.operators.modes[0], 0.0)) / (2.0 * np.pi))


def of_rigid_body(x: float, y: float, z: float) -> Array:
    """Return the mass matrix of a head at (x, y, z) from a point, in its velocity and its angular velocity, (6, 6)."""
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])  # r x .
    velocity = np.hstack([np.identity(3), -cross])
    return MASS * velocity.T @ velocity + np.diag([0.0, 0.0, 0.0, POLAR, ROTARY, ROTARY])


def of_theory(offset: tuple[float, float, float], count: int) -> Array:
    """Return the frequencies of a cantilever with an eccentric head by transfer matrices of its four motions, Hz.

    Every column of U(s) and F(s) is one of the six reactions at the root; the head takes F = s M U, s = (2 pi f)^2.
    """
    mass = of_rigid_body(*offset)
    line, inertia = DENSITY * AREA, DENSITY * SECOND

    def missed(frequency: float) -> float:
        s = (2.0 * np.pi * frequency) ** 2
        plane = np.array(  # w, theta, M, Q
            [
                [0.0, 1.0, 0.0, 1.0 / SHEAR],
                [0.0, 0.0, 1.0 / BENDING, 0.0],
                [0.0, -inertia * s, 0.0, -1.0],
                [-line * s, 0.0, 0.0, 0.0],
            ]
        )
        bent = expm(plane * LENGTH)[:, 2:]
        pulled = expm(np.array([[0.0, 1.0 / (YOUNG * AREA)], [-line * s, 0.0]]) * LENGTH)[:, 1]
        twisted = expm(np.array([[0.0, 1.0 / TORSION], [-2.0 * inertia * s, 0.0]]) * LENGTH)[:, 1]
        moved, force = np.zeros((6, 6)), np.zeros((6, 6))
        moved[0, 0], force[0, 0] = pulled
        moved[3, 1], force[3, 1] = twisted
        moved[[2, 4], 2:4], force[[2, 4], 2:4] = bent[[0, 1]], bent[[3, 2]]
        moved[[1, 5], 4:6], force[[1, 5], 4:6] = bent[[0, 1]], bent[[3, 2]]
        turned = np.diag([1.0, 1.0, 1.0, 1.0, -1.0, 1.0])  # w' = theta turns the section about -y
        return float(np.linalg.det((turned @ force - s * mass @ turned @ moved) / np.abs(force).max(axis=0)))

    places = np.concatenate([np.linspace(24.0, 26.0, 100), np.linspace(27.0, 700.0, 200)])  # two of them are close
    values = [missed(place) for place in places]
    found = [
        brentq(missed, one, other, xtol=1e-10)
        for one, other, before, after in zip(places, places[1:], values, values[1:], strict=False)
        if before * after < 0.0
    ]
    return np.array(found[:count])


@pytest.mark.parametrize(
    ("kind", "near"),
    [("beam", 1.0e-5), pytest.param("reduced", 1.0e-2, marks=pytest.mark.slow)],
)
def test_frequencies_of_a_cantilever_with_an_eccentric_head(kind: str, near: float) -> None:
    """Bending in both planes, twist and tension are one motion: the first five frequencies."""
    theory = of_theory(OFFSET, 5)
    assert len(theory) == 5
    np.testing.assert_allclose(frequencies(model_of(kind, head(OFFSET)))[:5], theory, rtol=near)


def test_a_rigid_beam_with_an_eccentric_mass() -> None:
    """On six springs at one end, against the rigid body of both by SciPy."""
    names = ("axial", "lateral", "vertical", "twist", "rotation", "lateral_rotation")
    springs = np.array([3.0e6, 2.0e6, 1.0e6, 2.0e3, 3.0e4, 5.0e4])
    joint = {"name": "root", "type": "elastic", "point": 0.0, "stiffness": dict(zip(names, springs, strict=True))}
    mesh = {"size": 0.15, "support_size": 0.02, "cells_through_thickness": 2, "dimension": 3}
    weak = {"axial": 1e-3, "lateral": 1e-3}
    model = model_of("rigid", head(OFFSET, 0.5), joint=[joint], restraint=weak, mesh=mesh)
    total, across = DENSITY * AREA * LENGTH, DENSITY * SECOND * LENGTH
    rod = np.diag([total, total, total, 2.0 * across, *[across + total * LENGTH**2 / 3.0] * 2])
    rod[1, 5] = rod[5, 1] = 0.5 * total * LENGTH
    rod[2, 4] = rod[4, 2] = -0.5 * total * LENGTH
    mass = rod + of_rigid_body(OFFSET[0] + 0.5, OFFSET[1], OFFSET[2])
    theory = np.sqrt(eigh(np.diag(springs), mass, eigvals_only=True)) / (2.0 * np.pi)
    np.testing.assert_allclose(frequencies(model), theory, rtol=2e-3)  # the area of the mesh is a bit too small


@pytest.mark.parametrize("kind", ["beam", pytest.param("full", marks=pytest.mark.slow)])
def test_the_weight_acts_at_the_place_of_the_mass(kind: str) -> None:
    """A cantilever sags by P (L^3 / 3 + d_x L^2 / 2) / E I + P L / kappa G A and twists by P d_y L / G J."""
    weight, (along, beside, _) = MASS * GRAVITY, OFFSET
    sag = weight * ((LENGTH**3 / 3.0 + along * LENGTH**2 / 2.0) / BENDING + LENGTH / SHEAR)
    twist = weight * beside * LENGTH / TORSION
    probes = [{"name": "tip", "point": LENGTH}]
    rim = {"name": "rim", "point": [LENGTH, 0.4 * DIAMETER, 0.0]}
    model = model_of(kind, head(OFFSET), load=[{"type": "gravity", "acceleration": GRAVITY}], probe=[*probes, rim])
    operators = model.system.operators
    pattern = (model.system.loads[0].pattern - model.body.patterns[0]) * GRAVITY
    moved = operators.factor(0.0, 1.0).solve(pattern)
    tip, side = (model.probes[name].evaluate(moved, operators) for name in ("tip", "rim"))
    near = {"beam": 1e-6, "full": 1e-2}[kind]
    assert -tip[2] == pytest.approx(sag, rel=near)
    assert (tip[2] - side[2]) / (0.4 * DIAMETER) == pytest.approx(twist, rel=near)
    assert tip[1] == pytest.approx(0.0, abs=1e-3 * sag)


def test_a_slice_holds_a_mass_above_its_axis() -> None:
    """A base that pushes along the beam bends it by the moment of the mass above: w = m a d_z L^2 / 2 E I."""
    above, push = 0.05, 3.0
    shaker = {"type": "base_motion", "amplitude": push, "frequency": 5.0, "direction": [1.0, 0.0]}
    tips = []
    for kind in ("beam", "reduced", "full"):
        model = model_of(kind, head((0.0, above)), dimension=2, load=[shaker])
        operators = model.system.operators
        force = push * (model.system.loads[0].pattern - model.body.patterns[0])  # of the head alone
        tips.append(model.probes["tip"].evaluate(operators.factor(0.0, 1.0).solve(force), operators)[-1])
    second = DIAMETER**4 / 12.0
    assert abs(tips[0]) == pytest.approx(MASS * push * above * LENGTH**2 / (2.0 * YOUNG * second), rel=1e-6)
    np.testing.assert_allclose(tips, tips[0], rtol=5e-3)
    assert tips[0] > 0.0  # the head stays behind, and raises the tip
