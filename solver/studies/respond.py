"""The response of a model to its loads from some start: records, figures, end state and verdict; no files."""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace

import numpy as np

from solver.analyses.transient import march
from solver.energy import Ledger, enter_step, open_ledger, restate
from solver.errors import EnergyCreated, NotConverged, NotFinite, RunError, UserError
from solver.gates import EnergyGates
from solver.integrators.schemes import make_integrator
from solver.march_of_model import march_of_model
from solver.model import Model
from solver.operators import Array
from solver.output.rows import Recorder, Row
from solver.system import State
from solver.verdict import judge

VERDICTS: dict[type[RunError], str] = {
    EnergyCreated: "energy created",
    NotConverged: "not converged",
    NotFinite: "not finite",
    UserError: "refused",
}


@dataclass
class Response:
    """What a model does from a start.

    Attributes:
        verdict: "passed", "energy created", "not converged", "not finite", "refused" or "failed".
        message: The error, where there was one.
        exit_status: 0, or that of the error.
        reached: Time up to which it went, s.
        history: Records by name, (records, ...), as in `solver.output.records.HISTORY`, and "time"; empty where none
            were asked for.
        labels: Names along the labeled dimensions of the records.
        end: The state at the end of the last whole step.
        created: Energy created relative to the energy exchanged; round-off counts as none.
        residual: Residual of the energy balance relative to the energy exchanged.
        lost: Energy that the scheme dissipated relative to the energy exchanged.
        penetration: Largest penetration, m.
        peak_force: Largest contact force on a face, N.
        iterations: Mean number of contact iterations of a step.
        most_iterations: The most in a step.
        steps: Accepted steps.
        seconds: Wall time of the march, s.
    """

    verdict: str = "passed"
    message: str = ""
    exit_status: int = 0
    reached: float = 0.0
    history: dict[str, Array] = field(default_factory=dict)
    labels: dict[str, tuple[str, ...]] = field(default_factory=dict)
    end: State | None = None
    created: float = 0.0
    residual: float = 0.0
    lost: float = 0.0
    penetration: float = 0.0
    peak_force: float = 0.0
    iterations: float = 0.0
    most_iterations: int = 0
    steps: int = 0
    seconds: float = 0.0

    def failed(self, error: RunError) -> None:
        """Take in what ended the march."""
        self.verdict, self.message = VERDICTS.get(type(error), "failed"), str(error)
        self.exit_status = error.exit_status


def respond(model: Model, start: State, steps: int, interval: float | None = None) -> Response:
    """March a model from a start.

    Args:
        model: The model.
        start: Its state at the start, at any time.
        steps: Number of whole steps.
        interval: Time between records, s, a whole number of steps; None records nothing.

    Returns:
        The response; one that created energy or did not converge says so, up to where it came.

    Collective.
    """
    response, clock = Response(), time.perf_counter()
    try:
        _march(model, start, steps, interval, response)
    except RunError as error:
        response.failed(error)
    response.seconds = time.perf_counter() - clock
    return response


def _march(model: Model, start: State, steps: int, interval: float | None, response: Response) -> None:
    system, law, scheme = model.system, model.law, make_integrator(model.case.time.scheme)
    plan = replace(march_of_model(model, scheme), steps=steps)
    ledger, gates = open_ledger(system, law, start), EnergyGates(model.case.gates, system.contact)
    recorder = Recorder(model)
    every = None if interval is None else max(1, round(interval / plan.dt))
    rows = [] if every is None else [recorder.row(start, ledger)]
    iterations: list[int] = []
    done = 0
    try:
        for step in march(plan, start):
            ledger = enter_step(system, law, ledger, step)
            if step.refreshed is not None:
                ledger = restate(system, law, ledger, step.refreshed)
            recorder.see(step)
            iterations.append(step.iterations)
            response.reached = step.new.time
            if step.completes:
                done += 1
                response.end = step.refreshed or step.new
                if every is not None and done % every == 0:
                    rows.append(recorder.row(response.end, ledger))
            gates.check(step, ledger)
        judge(model, ledger, gates)
    finally:
        response.labels = recorder.labels
        response.history = stacked(rows)
        response.steps = len(iterations)
        if iterations:
            _figures(response, recorder, ledger, gates)
            response.iterations, response.most_iterations = float(np.mean(iterations)), max(iterations)


def _figures(response: Response, recorder: Recorder, ledger: Ledger, gates: EnergyGates) -> None:
    scale = ledger.exchanged if ledger.exchanged > 0.0 else np.nan
    response.created, response.residual = gates.growth(ledger), ledger.residual / scale
    response.lost = ledger.algorithmic / scale
    response.penetration, response.peak_force = float(recorder.deepest.max()), float(recorder.peak_force.max())


def stacked(rows: list[Row]) -> dict[str, Array]:
    """Return the records of many times by name, (times, ...)."""
    return {name: np.array([row[name] for row in rows]) for name in rows[0]} if rows else {}
