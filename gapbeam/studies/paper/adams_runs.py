"""Runs of the paper's ADAMS simulation, section 3, as it was and changed: and the figures of each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gapbeam.postprocess.report.envelope import envelope
from gapbeam.postprocess.results.records_in_memory import as_history
from gapbeam.postprocess.signals.figure_names import ACCELERATION, SMOOTHED_ACCELERATION
from gapbeam.postprocess.signals.signal import SignalError, probe_signal
from gapbeam.postprocess.signals.smoothing import smooth
from gapbeam.postprocess.signals.steady_figures import steady
from gapbeam.solver.case.case import Case
from gapbeam.solver.errors import RunError
from gapbeam.solver.system.operators import Array
from gapbeam.studies.engine.study_engine import Engine
from gapbeam.studies.paper.printed_figures import printed
from gapbeam.studies.trials.kept_body import KeptBody
from gapbeam.studies.trials.response import respond
from gapbeam.studies.trials.starts import seated

G = 9.81  # m/s^2, what the paper's accelerations are given in
STARTING = 4  # forcing periods: the start of a run
SHOWN = 6  # forcing periods that are drawn
FORCE = 10.0  # N
PLACE = 0.15  # m
EXCITER = {"mass": 0.1, "stiffness": 1.0e4, "damping": 5.0}  # kg, N/m, N s/m
RAYLEIGH = {"frequencies": [40.0, 300.0], "ratios": [0.01, 0.01]}  # of the elastic beam, as in cases/li2013.toml
ELEMENTS = 51

Changes = Mapping[str, Any]


@dataclass(frozen=True)
class Asked:
    """One run.

    Attributes:
        clearance: mm.
        depth: Penetration of full damping, mm.
        elastic: Timoshenko beam elements instead of a rigid body.
        suspended: Whether the exciter has a mass and a suspension.
        force: N.
        place: Of the force, m.
        gravity: m/s^2.
        step: s, and between records.
        start: "undeformed" or "seat".
        model: Another model than the two, as a table; empty: one of the two.
        periods: Forcing periods.
        drawn: Whether the acceleration is kept.
    """

    clearance: float
    depth: float
    elastic: bool = False
    suspended: bool = False
    force: float = FORCE
    place: float = PLACE
    gravity: float = G
    step: float = 1.0e-5
    start: str = "undeformed"
    model: tuple[tuple[str, Any], ...] = ()
    periods: int = 20
    drawn: bool = False


@dataclass
class RunFigures:
    """What came of a run; accelerations at the test point, peak to peak, in g.

    Attributes:
        asked: The run.
        verdict: "passed", or what went wrong.
        kind: Of the response: "period 1", "no cycle" and so on.
        start: Over the first four forcing periods, as recorded.
        start_smoothed: The same, smoothed as in the paper.
        settled: Over windows after the transient, their mean, as recorded.
        settled_smoothed: The same, smoothed.
        scatter: Standard deviation of the windows of `settled_smoothed`.
        residual: Of the energy balance, relative.
        times: Of the curve, s.
        curve: Acceleration, g, thinned to the smallest and largest of every interval.
    """

    asked: Asked
    verdict: str
    kind: str = ""
    start: float = np.nan
    start_smoothed: float = np.nan
    settled: float = np.nan
    settled_smoothed: float = np.nan
    scatter: float = 0.0
    residual: float = 0.0
    times: Array = field(default_factory=lambda: np.zeros(0))
    curve: Array = field(default_factory=lambda: np.zeros(0))


def adams_case(asked: Asked) -> Case:
    """Return the case of a run: the figures that the paper prints in SI units, and what it does not print."""
    figures = printed()
    beam, adams = figures["beam"], figures["adams"]
    elastic: dict[str, Any] = {"type": "beam", "elements": ELEMENTS} if asked.elastic else {"type": "rigid"}
    return Case.model_validate(
        {
            "beam": {name: beam[name] for name in ("length", "width", "thickness")},
            "material": {name: beam[name] for name in ("young_modulus", "poisson_ratio", "density")},
            "damping": RAYLEIGH if asked.elastic or asked.model else {},
            "support": {"length": beam["support_length"], "clearance": 1.0e-3 * asked.clearance},
            "mesh": {"dimension": 2, "size": 0.03, "support_size": 0.625e-3, "cells_through_thickness": 2},
            "model": dict(asked.model) or elastic,
            "contact": {
                "points": [0.0, beam["support_length"]],
                "patch": 0.005,
                "stiffness": adams["stiffness"] * 1.0e3 ** adams["exponent"],
                "law": {
                    "type": "adams-impact",
                    "exponent": adams["exponent"],
                    "damping": 1.0e3 * adams["damping"],
                    "full_depth": 1.0e-3 * asked.depth,
                },
            },
            "load": [
                {"type": "gravity", "acceleration": asked.gravity},
                {
                    "type": "exciter",
                    "name": "shaker",
                    "point": asked.place,
                    "amplitude": asked.force,
                    "frequency": beam["frequency"],
                    **(EXCITER if asked.suspended else {}),
                },
            ],
            "probe": [{"name": "test", "point": beam["test_point"]}, {"name": "tip", "point": beam["length"]}],
            "time": {"end": asked.periods / beam["frequency"], "step": asked.step},
            "analysis": {"type": "transient", "start": asked.start},
            "output": {"history_interval": asked.step, "fields_interval": 0.01},
        }
    )


def run_one(asked: Asked) -> RunFigures:
    """Run one case on this process, and report what it did; a run that fails is reported as well."""
    case = adams_case(asked)
    try:
        model = _BODIES.setdefault(case.model.type, KeptBody()).model(case)
        response = respond(model, seated(model).state, round(case.time.end / asked.step), asked.step)
    except RunError as error:
        return RunFigures(asked, f"failed: {error}")
    if response.verdict != "passed":
        return RunFigures(asked, f"{response.verdict}: {response.message}")
    history = as_history(response.history, response.labels)
    frequency = printed()["beam"]["frequency"]
    acceleration = probe_signal(history, "acceleration_absolute", "test")
    smoothed = smooth(acceleration)
    run = RunFigures(asked, "passed", residual=response.residual)
    begin = STARTING / frequency
    run.start = float(np.ptp(acceleration.values[acceleration.time < begin])) / G
    run.start_smoothed = float(np.ptp(smoothed.values[smoothed.time < begin])) / G
    try:
        figures = steady(history, frequency)
    except SignalError as error:
        run.kind = f"undecided: {error}"
        return run
    run.kind = figures.word
    run.settled = figures.quantities[f"test {ACCELERATION}"].mean / G
    settled = figures.quantities[f"test {SMOOTHED_ACCELERATION}"]
    run.settled_smoothed, run.scatter = settled.mean / G, settled.scatter / G
    if asked.drawn:
        shown = acceleration.time < SHOWN / frequency
        run.times, run.curve = envelope(acceleration.time[shown], acceleration.values[shown] / G)
    return run


_BODIES: dict[str, KeptBody] = {}


def run_all(asked: Sequence[Asked]) -> dict[Asked, RunFigures]:
    """Run many cases side by side, each once."""
    each = sorted(set(asked), key=lambda one: (one.elastic, one.model, one.place, one.suspended))
    with Engine(points=len(each)) as engine:
        return {run.asked: run for _, run in engine.done(run_one, each)}


def geometric_mean(values: Sequence[float] | Array) -> float:
    """Return the geometric mean of positive numbers; not a number where one is missing."""
    return float(np.exp(np.mean(np.log(np.asarray(values, dtype=float)))))
