"""The response of a model to its loads from some start: records, figures, end state and verdict; no files."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from gapbeam.solver.diagnostics.assumptions.assumption import Finding
from gapbeam.solver.diagnostics.assumptions.frequency_content import content_of_motion
from gapbeam.solver.diagnostics.energy_gates import remedy_for
from gapbeam.solver.diagnostics.history_rows import Recorder, Rows
from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.diagnostics.statistics.run_statistics import RunStatistics
from gapbeam.solver.diagnostics.statistics.statistic_figures import Doubts
from gapbeam.solver.errors import (
    AssumptionBroken,
    EnergyCreated,
    EnergyLost,
    Interrupted,
    NotConverged,
    NotFinite,
    RunError,
    UserError,
)
from gapbeam.solver.march.simulation import Simulation, Wanted, marched
from gapbeam.solver.models.model import Model
from gapbeam.solver.run.assumptions.frequency_findings import RESONANT
from gapbeam.solver.run.assumptions.pose_rows import gauges_of, watch_of
from gapbeam.solver.run.verdict import assumptions, doubts_of, judge, judge_run
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import State

VERDICTS: dict[type[RunError], str] = {
    AssumptionBroken: "assumption broken",
    EnergyCreated: "energy created",
    EnergyLost: "energy lost",
    NotConverged: "not converged",
    NotFinite: "not finite",
    UserError: "refused",
}


@dataclass
class TrialResponse:
    """Response of a model from a start.

    Attributes:
        verdict: "passed", one of VERDICTS, or "failed".
        message: The error, where there was one.
        exit_status: 0, or the error's own.
        reached: Time up to which it went, s.
        history: Records by name, (records, ...), as in `record_table.HISTORY`, and "time"; empty where none
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
        findings: Findings on the assumptions, where they were watched.
        statistics: Of the motion, where they were asked for.
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
    findings: Sequence[Finding] = ()
    statistics: RunStatistics | None = None
    doubts: Doubts | None = None

    def failed(self, error: RunError) -> None:
        """Take in what ended the march."""
        self.verdict, self.message = VERDICTS.get(type(error), "failed"), str(error)
        self.exit_status = error.exit_status


def respond(
    model: Model,
    start: State,
    steps: int,
    interval: float | None = None,
    longest: float | None = None,
    watched: bool = False,
    rings: bool = False,
    statistics: RunStatistics | None = None,
) -> TrialResponse:
    """March a model from a start.

    Args:
        model: The model.
        start: Its state at the start, at any time.
        steps: Number of whole steps.
        interval: Time between records, s, a whole number of steps; None records nothing.
        longest: Wall time after which the march stops, in its place, with what it has up to then, s; on one rank.
        watched: Judge it as a run is judged: by its assumptions, and by the energy that the scheme took, too. The
            pose is looked at where there are records.
        rings: Whether free vibration from the start is part of it: the amplitude of a resonance is then no figure.
        statistics: Sees the records, which have the interval of its own; None: nothing does.

    Returns:
        The response; one that is not to be trusted, or did not converge, says so, up to where it came.

    Collective.
    """
    response, clock = TrialResponse(statistics=statistics), time.perf_counter()
    try:
        deadline = None if longest is None else clock + longest
        _march(model, start, steps, interval, response, deadline, watched, rings)
    except Interrupted:
        raise
    except RunError as error:
        response.failed(error)
    response.seconds = time.perf_counter() - clock
    return response


def _march(
    model: Model,
    start: State,
    steps: int,
    interval: float | None,
    response: TrialResponse,
    deadline: float | None,
    watched: bool,
    rings: bool,
) -> None:
    plan = replace(Simulation(model).plan, steps=steps)
    accounts = Accounts.opened(model.system, model.law, start, plan.dt, model.case.gates, remedy_for(model.case))
    recorder = Recorder(model, watch_of(model) if watched else None, gauges_of(model), response.statistics)
    every = None if interval is None else max(1, round(interval / plan.dt))
    rows = [] if every is None else [recorder.row(start, accounts)]
    try:
        for step_block in marched(plan, start, accounts, recorder, Wanted(every), model.space.mesh.comm):
            response.end = step_block.end
            if step_block.rows is not None:
                rows.append(step_block.rows)
            if deadline is not None and time.perf_counter() > deadline:
                break
    finally:
        response.labels = recorder.labels
        response.history = stacked(rows)
        response.steps = accounts.tally.steps
        if response.steps:
            _figures(response, accounts)
        if response.statistics is not None:
            response.doubts = doubts_of(model, accounts)
    if not watched:
        judge(model, accounts.ledger, accounts.gates)
        return
    moved = response.history
    content = content_of_motion(moved["time"], moved["velocity"]) if "velocity" in moved else None
    findings = assumptions(model, recorder, accounts, content)
    response.findings = [one for one in findings if not (rings and one.assumption.name == RESONANT.name)]
    judge_run(model, accounts, response.findings)


def _figures(response: TrialResponse, accounts: Accounts) -> None:
    ledger, tally = accounts.ledger, accounts.tally
    scale = ledger.exchanged if ledger.exchanged > 0.0 else np.nan
    response.reached = accounts.time
    response.created, response.residual = accounts.gates.growth(ledger), ledger.residual / scale
    response.lost = ledger.algorithmic / scale
    response.penetration = float(accounts.peaks.deepest.max())
    response.peak_force = float(accounts.peaks.force.max())
    response.iterations, response.most_iterations = tally.iterations / tally.steps, tally.most_iterations


def stacked(rows: list[Rows]) -> dict[str, Array]:
    """Return the records of many times by name, (times, ...)."""
    return {name: np.concatenate([row[name] for row in rows]) for name in rows[0]} if rows else {}
