"""Cases whose stationary law is known exactly, and their figures: rattling beams with damping proportional to mass.

    density of u and v ~ exp(-(v^T M v / 2 + U(u)) / T),    C = alpha M,    one-sided density of the forces: 4 alpha T M

Places of a structure on springs are Gaussian, with covariance T K^-1, times exp(-contact potential / T). Those of a
free body with two motions lie within the play, and a little beyond. Points of a Sobol sequence integrate both.

White noise reaches every mode: the elastic beam's highest, 1712 Hz, decides a fifth of its impacts.

Forces at points load a body by 4 alpha T M where M is the sum of masses at these points: of a rigid one, two halves
where they have its moment of inertia; of beam elements, the points of Gauss's rule.

Source: Risken, The Fokker-Planck Equation (1989), chapter 10.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import pi, sqrt
from typing import Any

import numpy as np
from scipy.stats import norm, qmc

from gapbeam.solver.models.model import Model
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Array, Indices

LENGTH, THICKNESS, WIDTH, DENSITY = 0.6, 0.012, 0.02, 7919.0
MASS = LENGTH * THICKNESS * WIDTH * DENSITY
DAMPING = 40.0  # alpha, 1/s
TEMPERATURE = 1.0e-4  # T, J
HIGH = 4000.0  # of the noise, Hz: above every mode, or those beyond would have no part of the energy
POWER = 18  # points of the Sobol sequence: 2 to this
FAR = 6.0  # standard deviations of a point in contact beyond the play
NEGLIGIBLE = 1.0e-12  # of the largest density
BAND = 0.04  # half width of the levels that count as the first touch, in standard deviations


@dataclass(frozen=True)
class StationaryCase:
    """A case with an exact law.

    Attributes:
        name: Its name.
        tables: The case.
        free: Whether nothing but contact holds the body.
    """

    name: str
    tables: Mapping[str, Any]
    free: bool

    def exact(self, model: Model) -> dict[str, float]:
        """Return the exact figures of a model of the case, by name."""
        return figures(model, *(_uniform(model) if self.free else _gaussian(model)))


def rigid(name: str, clearances: Mapping[str, tuple[float, float, float]]) -> StationaryCase:
    """Return a rigid body in supports: from, to and clearance of each, m."""
    reach = sqrt((LENGTH**2 + THICKNESS**2) / 12.0)
    places = [(0.5 * LENGTH + sign * reach, 0.5 * MASS) for sign in (-1.0, 1.0)]
    return StationaryCase(name, _tables({"type": "rigid"}, clearances, places), True)


def beam(name: str, elements: int, clearances: Mapping[str, tuple[float, float, float]]) -> StationaryCase:
    """Return a beam of a few elements that is clamped at x = 0, in supports as those of `rigid`."""
    nodes, weights = np.polynomial.legendre.leggauss(4)
    size = LENGTH / elements
    places = [
        (size * (number + 0.5 + 0.5 * node), 0.5 * weight * MASS / elements)
        for number in range(elements)
        for node, weight in zip(nodes, weights, strict=True)
    ]
    model = {"type": "beam", "elements": elements, "motions": ["bending"]}
    clamp = {"joint": [{"name": "wall", "type": "clamped", "point": 0.0}]}
    return StationaryCase(name, _tables(model, clearances, places) | clamp, False)


def with_step(case: StationaryCase, step: float) -> StationaryCase:
    """Return a case with another time step, s."""
    return replace(case, tables=dict(case.tables) | {"time": case.tables["time"] | {"step": step}})


def _tables(
    model: Mapping[str, Any],
    clearances: Mapping[str, tuple[float, float, float]],
    places: Sequence[tuple[float, float]],
) -> dict[str, Any]:
    return {
        "beam": {"length": LENGTH, "thickness": THICKNESS, "width": WIDTH},
        "material": {"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": DENSITY},
        "damping": {"mass": DAMPING, "stiffness": 0.0},
        "support": [
            {"name": name, "from": begin, "to": end, "clearance": gap} for name, (begin, end, gap) in clearances.items()
        ],
        "model": dict(model),
        "mesh": {"dimension": 2, "size": 0.06, "support_size": 0.025, "cells_through_thickness": 1},
        "contact": {"stiffness": 1.0e9, "damping": 0.0},
        "restraint": {"axial": 1.0e-3},
        "analysis": {"type": "transient", "start": "centered"},
        "load": [
            {
                "type": "random",
                "name": f"noise-{number}",
                "quantity": "force",
                "point": float(place),
                "seed": 1,
                "spectrum": {"type": "white", "density": 4.0 * DAMPING * TEMPERATURE * float(mass), "high": HIGH},
            }
            for number, (place, mass) in enumerate(places)
        ],
        "probe": [{"name": "tip", "point": LENGTH}],
        "time": {"end": 3.0, "step": 5.0e-5, "scheme": "discrete-gradient"},
        "output": {"history_interval": 1.0e-3},
    }


def noise_defect(model: Model) -> float:
    """Return the relative distance of the covariance of the forces from 4 alpha T M: 0 where the law is exact."""
    moved = _moved(model)
    patterns = np.array([load.pattern[moved] for load in model.system.loads])
    densities = np.array([load["spectrum"]["density"] for load in model.case.model_dump()["load"]])
    found = (patterns.T * densities) @ patterns / (4.0 * DAMPING * TEMPERATURE)
    mass = _dense(model).mass[np.ix_(moved, moved)]
    return float(np.linalg.norm(found - mass) / np.linalg.norm(mass))


def _dense(model: Model) -> DenseOperators:
    operators = model.system.operators
    assert isinstance(operators, DenseOperators)
    return operators


def _gaps(model: Model) -> Array:
    """Return G over all DOFs, (m, n)."""
    contact = model.system.contact
    found = np.zeros((contact.size, _dense(model).size))
    found[:, contact.interface.owned] = contact.gap_matrix.toarray()[:, contact.interface.slots]
    return found


def _moved(model: Model) -> Indices:
    """Return the DOFs that loads move."""
    patterns = np.abs([load.pattern for load in model.system.loads]).max(axis=0)
    return np.flatnonzero(patterns > 1.0e-9 * patterns.max())


def _potential(model: Model, places: Array) -> Array:
    """Return the potential of contact and structure at places, (places,), J."""
    contact = model.system.contact
    depths = places @ -_gaps(model).T - contact.initial_gap
    pressed = model.law.spring.potential(np.maximum(depths, 0.0)) @ contact.weights
    return np.asarray(pressed + 0.5 * np.einsum("ij,ij->i", places @ _dense(model).stiffness, places))


def _uniform(model: Model) -> tuple[Array, Array]:
    """Return places of a body with two motions, even over the play and beyond, and their probabilities."""
    contact, moved = model.system.contact, _moved(model)
    rows = _gaps(model)[:, moved]
    ends = contact.positions[:, 0].argsort()[[0, -1]]
    stiffness = model.law.stiffness * contact.weights[ends]
    reach = 2.0 * contact.initial_gap.max() + FAR * np.sqrt(TEMPERATURE / stiffness)
    sides = (2.0 * qmc.Sobol(2, seed=1).random_base2(POWER) - 1.0) * reach
    places = np.zeros((len(sides), _dense(model).size))
    places[:, moved] = np.linalg.solve(rows[ends], sides.T).T
    weights = np.exp(-_potential(model, places) / TEMPERATURE)
    kept = weights > NEGLIGIBLE * weights.max()
    return places[kept], weights[kept] / weights[kept].sum()


def _gaussian(model: Model) -> tuple[Array, Array]:
    """Return places of a structure that springs hold, even in the law of the structure, and their probabilities."""
    squares, shapes = _dense(model).modes
    scales = np.sqrt(TEMPERATURE / squares)
    points = norm.ppf(qmc.Sobol(len(squares), seed=1).random_base2(POWER))
    places = (points * scales) @ shapes.T
    elastic = 0.5 * TEMPERATURE * np.sum(points**2, axis=1)
    weights = np.exp(-(_potential(model, places) - elastic) / TEMPERATURE)
    return places, weights / weights.sum()


def figures(model: Model, places: Array, weights: Array) -> dict[str, float]:
    """Return the figures of places with probabilities.

    Args:
        model: The model.
        places: (places, n).
        weights: Their sum is 1, (places,).
    """
    contact, gaps = model.system.contact, _gaps(model)
    depths = places @ -gaps.T - contact.initial_gap
    forces = contact.weights * model.law.spring.pressure(depths)
    inverse = np.linalg.inv(_dense(model).mass)
    speeds = np.sqrt(TEMPERATURE * np.einsum("ij,jk,ik->i", gaps, inverse, gaps))
    found: dict[str, float] = {}
    for number, face in enumerate(contact.face_names):
        there = contact.faces == number
        force, deepest = forces[:, there].sum(axis=1), depths[:, there].max(axis=1)
        band = BAND * float(np.sqrt(weights @ (deepest - weights @ deepest) ** 2))
        near = np.abs(deepest) < band  # Rice's formula: the mean speed inward times the density at the first touch
        inward = speeds[there][depths[:, there].argmax(axis=1)] / sqrt(2.0 * pi)
        found |= {
            f"face.{face}.contact_share": float(weights @ (deepest > 0.0)),
            f"face.{face}.mean_force": float(weights @ force),
            f"face.{face}.rms_force": sqrt(float(weights @ force**2)),
            f"face.{face}.impact_rate": float(weights[near] @ inward[near]) / (2.0 * band),
        }
    for name, probe in model.probes.items():
        moved = probe.evaluate(places, _dense(model))[:, -1]
        found[f"probe.{name}.rms"] = sqrt(float(weights @ (moved - weights @ moved) ** 2))
    return found
