"""Coverage of 95 % intervals of rattling against its exact stationary law: systems and cases, many seeds.

environment/run python3 -m benchmarks.stationary_coverage [seeds] [name of a row to run alone]
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import pi, sqrt
from typing import Any

import numpy as np
from mpi4py import MPI
from scipy.stats import norm, qmc

from gapbeam import read_case
from gapbeam.solver.diagnostics.history_rows import Recorder
from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.diagnostics.statistics.batch_interval import missed_share
from gapbeam.solver.diagnostics.statistics.run_statistics import RunStatistics
from gapbeam.solver.march.simulation import Simulation, Wanted, marched
from gapbeam.solver.models.model import Model
from gapbeam.solver.run.checkpoint.checkpoints import steps_between
from gapbeam.solver.run.stop_rule import statistics_of
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Array, Indices
from gapbeam.studies.trials.starts import KeptBody
from tests.shared.rattlers import Rattler, between_stops, in_a_hole, sliding_on_a_stop
from tests.shared.rattlers import marched as rattling

SEEDS, SECONDS = 200, 600.0
HEADS = ("set", "figure", "exact", "mean of all seeds", "held", "held of those judged good", "half width")


@dataclass(frozen=True)
class Row:
    """A parameter set.

    Attributes:
        name: Its name.
        exact: Exact figures, by name.
        statistics: Function that marches with a seed and returns the statistics.
        missed: Part of the impacts that steps could not see, mean over the faces, of each march so far.
    """

    name: str
    exact: dict[str, float]
    statistics: Callable[[int], RunStatistics]
    missed: list[float] = field(default_factory=list)


@dataclass
class CaseMarches:
    """Marches of a case with other seeds, on the same body."""

    case: StationaryCase
    bodies: KeptBody
    missed: list[float] = field(default_factory=list)

    @cached_property
    def model(self) -> Model:
        """Model of the first seed."""
        return self._model(0)

    def statistics(self, seed: int) -> RunStatistics:
        """Return the statistics of a march."""
        model = self._model(seed)
        simulation = Simulation(model)
        case, start = simulation.case, simulation.start(simulation.seat_or_failure())
        every = steps_between(case, model.step)["history_interval"]
        recorder = Recorder(case, model, statistics=statistics_of(case, model, every))
        accounts = Accounts.opened(model.system, model.law, start, model.step)
        recorder.row(start, accounts)
        for _ in marched(simulation.plan, start, accounts, recorder, Wanted(every), MPI.COMM_SELF):
            pass
        assert recorder.statistics is not None
        self.missed.append(float(np.mean([missed_share(one, model.step) for one in accounts.impacts.ended])))
        return recorder.statistics

    def _model(self, seed: int) -> Model:
        tables: dict[str, Any] = dict(self.case.tables)
        tables["load"] = [{**load, "seed": seed} for load in tables["load"]]
        return self.bodies.model(read_case(tables))


def rows() -> dict[str, Callable[[str], Row]]:
    """Return the function that makes each parameter set, by name."""
    one = {"support": (0.0, 0.1, 2.0e-4)}
    two = {"first": (0.0, 0.05, 2.0e-4), "second": (0.5, 0.55, 3.0e-4)}
    ends = {"middle": (0.27, 0.32, 0.7e-4), "end": (0.55, 0.6, 2.0e-4)}
    return {
        "mass, one stop": lambda name: _system(name, between_stops(1)),
        "mass, two stops": lambda name: _system(name, between_stops(2)),
        "mass, round hole": lambda name: _system(name, in_a_hole()),
        "mass that slides on a stop": lambda name: _system(name, sliding_on_a_stop()),
        "rigid beam, one support": lambda name: _case(rigid(name, one)),
        "rigid beam, two supports": lambda name: _case(rigid(name, two)),
        "elastic beam, two supports": lambda name: _case(beam(name, 2, ends)),
        "elastic beam, twice the step": lambda name: _case(with_step(beam(name, 2, ends), 1.0e-4)),
    }


def _system(name: str, rattler: Rattler) -> Row:
    return Row(name, rattler.exact, lambda seed: rattling(rattler, seed, SECONDS))


def _case(case: StationaryCase) -> Row:
    marches = CaseMarches(case, KeptBody())
    model = marches.model
    print(
        f"<!-- {case.name}: {model.system.operators.size} DOFs, {model.system.contact.size} contact points, forces off "
        f"by {noise_defect(model, case.tables['load']):.1%} -->",
        flush=True,
    )
    return Row(case.name, case.exact(model), marches.statistics, marches.missed)


def print_coverage(row: Row, seeds: int) -> None:
    """Print the coverage of every figure of a parameter set."""
    started = time.process_time()
    found = [{one.name: one for one in row.statistics(seed).figures()} for seed in range(1, seeds + 1)]
    for name, exact in row.exact.items():
        ones = [one[name] for one in found]
        held = [one.interval.low <= exact <= one.interval.high for one in ones]
        good = [inside for inside, one in zip(held, ones, strict=True) if one.verdict == "good"]
        value, width = (np.mean([getattr(one.interval, what) for one in ones]) for what in ("value", "relative"))
        cells = [
            row.name,
            f"`{name}`",
            f"{exact:.5g}",
            f"{value / exact - 1:+.1%}",
            f"{np.mean(held):.1%}",
            f"{np.mean(good):.1%} of {len(good)}" if good else "none",
            f"{width:.1%}",
        ]
        print(f"| {' | '.join(cells)} |", flush=True)
    missed = f", {np.mean(row.missed):.1%} of the impacts missed" if row.missed else ""
    cost = (time.process_time() - started) / seeds
    print(f"<!-- {row.name}: {cost:.2f} s of processor time a seed{missed} -->", flush=True)


def main(words: Sequence[str]) -> None:
    """Print the table."""
    print("| " + " | ".join(HEADS) + " |\n|" + "---|" * len(HEADS))
    seeds = int(words[0]) if words else SEEDS
    for name, made in rows().items():
        if not words[1:] or words[1] in name:
            print_coverage(made(name), seeds)


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


def noise_defect(model: Model, loads: Iterable[Mapping[str, Any]]) -> float:
    """Return the relative distance of the covariance of the forces from 4 alpha T M: 0 where the law is exact."""
    moved = _moved(model)
    patterns = np.array([load.pattern[moved] for load in model.system.loads])
    densities = np.array([load["spectrum"]["density"] for load in loads])
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
    pressed = model.law.potential(np.maximum(depths, 0.0)) @ contact.weights
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
    forces = contact.weights * model.law.static(depths).pressure
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


if __name__ == "__main__":
    main(sys.argv[1:])
