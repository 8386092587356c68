"""The response of a model to its loads from some start: records, figures, end state and verdict; no files."""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace

import numpy as np

from solver.accounts import Accounts
from solver.analyses.transient import March, march
from solver.compiled.loop import CompiledLoop
from solver.compiled.reasons import why_not_compiled
from solver.errors import EnergyCreated, NotConverged, NotFinite, RunError, UserError
from solver.integrators.schemes import make_integrator
from solver.march_of_model import march_of_model
from solver.model import Model
from solver.operators import Array
from solver.peaks import by_face
from solver.studies.motion_records import MotionRecords
from solver.system import VALUE, State
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
        history: Records of motion, forces and impulses by name, (records, ...), as in `solver.output.records.HISTORY`,
            and "time"; empty where none were asked for.
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
        loop: "compiled", or why not.
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
    loop: str = ""

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
    plan = replace(march_of_model(model, make_integrator(model.case.time.scheme)), steps=steps)
    accounts = Accounts.opened(plan, model.case.gates, start)
    every = None if interval is None else max(1, round(interval / plan.dt))
    reason = why_not_compiled(plan)
    records = MotionRecords(model)
    response.labels = records.labels
    if every is not None:
        records.add(*_row(model, accounts, start))
    try:
        if reason is None:
            response.loop = "compiled"
            _march_compiled(model, plan, start, every, accounts, records, response)
        else:
            response.loop = f"step by step: {reason}"
            _march_step_by_step(model, plan, start, every, accounts, records, response)
        judge(model, accounts.ledger, accounts.gates)
    finally:
        response.history = records.history()
        _figures(response, accounts)


def _march_compiled(
    model: Model,
    plan: March,
    start: State,
    every: int | None,
    accounts: Accounts,
    records: MotionRecords,
    response: Response,
) -> None:
    loop, probes = CompiledLoop(plan), _probe_rows(model)
    shape = (-1, len(model.probes), model.case.mesh.dimension)
    for block in loop.blocks(start, plan.steps if every is None else every, accounts):
        response.end, response.reached = block.end, block.end_time
        if every is not None:
            kept = (block.first + block.steps < plan.steps) or plan.steps % every == 0
            rows = slice(None) if kept else slice(-1)  # the last step is recorded wherever it falls
            motion = block.u[rows] @ probes.T, block.v[rows] @ probes.T
            records.add(
                block.times[rows],
                motion[0].reshape(shape),
                motion[1].reshape(shape),
                block.records.force[rows],
                block.records.impulse[rows],
            )


def _march_step_by_step(
    model: Model,
    plan: March,
    start: State,
    every: int | None,
    accounts: Accounts,
    records: MotionRecords,
    response: Response,
) -> None:
    done = 0
    for step in march(plan, start):
        response.reached = step.new.time
        if step.completes:
            done += 1
            response.end = step.refreshed or step.new
        accounts.take(step)
        if step.completes and every is not None and done % every == 0:
            assert response.end is not None
            records.add(*_row(model, accounts, response.end))


def _row(model: Model, accounts: Accounts, state: State) -> tuple[Array, ...]:
    """Return what `MotionRecords.add` takes of one state. Collective."""
    contact, operators = model.system.contact, model.system.operators
    u, v = (
        np.array([row.evaluate(x[VALUE], operators) for row in model.probes.values()])[None] for x in (state.u, state.v)
    )
    force = by_face(contact, contact.weights * state.pressure)
    return np.array([state.time]), u, v, force[None], accounts.peaks.impulse[None].copy()


def _probe_rows(model: Model) -> Array:
    """Return the rows that read the probes of a dense model, (probes times components, n)."""
    operators = model.system.operators
    columns = [
        np.concatenate([np.zeros(0), *(row.evaluate(x, operators) for row in model.probes.values())])
        for x in np.eye(operators.size)
    ]
    return np.stack(columns, axis=1)


def _figures(response: Response, accounts: Accounts) -> None:
    ledger, tally = accounts.ledger, accounts.tally
    response.steps = tally.steps
    if tally.steps:
        scale = ledger.exchanged if ledger.exchanged > 0.0 else np.nan
        response.created, response.residual = accounts.gates.growth(ledger), ledger.residual / scale
        response.lost = ledger.algorithmic / scale
        response.penetration, response.peak_force = (
            float(accounts.peaks.deepest.max()),
            float(accounts.peaks.force.max()),
        )
        response.iterations, response.most_iterations = tally.iterations / tally.steps, tally.most_iterations
