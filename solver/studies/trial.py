"""One run of a case that leaves no files: its figures and its verdict."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from mpi4py import MPI

from solver.analyses.static import find_seat
from solver.analyses.transient import march
from solver.case import Case
from solver.energy import enter_step, open_ledger, restate
from solver.errors import EnergyCreated, NotConverged, NotFinite, RunError, UserError
from solver.gates import EnergyGates
from solver.integrators.schemes import make_integrator
from solver.march_of_model import march_of_model
from solver.model import build_model
from solver.output.rows import Recorder
from solver.verdict import judge

VERDICTS: dict[type[RunError], str] = {
    EnergyCreated: "energy created",
    NotConverged: "not converged",
    NotFinite: "not finite",
    UserError: "refused",
}


@dataclass
class Trial:
    """What became of a run.

    Attributes:
        verdict: "passed", "energy created", "not converged", "not finite", "refused" or "failed".
        message: The error, where there was one.
        reached: Time up to which it went, s.
        created: Energy created relative to the energy exchanged; round-off counts as none.
        residual: Residual of the energy balance relative to the energy exchanged.
        lost: Energy that the scheme dissipated relative to the energy exchanged.
        penetration: Largest penetration, m.
        relative_penetration: The same relative to the clearance, or None.
        peak_force: Largest contact force on a face, N.
        iterations: Mean number of contact iterations of a step.
        most_iterations: The most in a step.
        seconds: Wall time, s.
    """

    verdict: str = "passed"
    message: str = ""
    reached: float = 0.0
    created: float = 0.0
    residual: float = 0.0
    lost: float = 0.0
    penetration: float = 0.0
    relative_penetration: float | None = None
    peak_force: float = 0.0
    iterations: float = 0.0
    most_iterations: int = 0
    seconds: float = 0.0

    def as_dict(self) -> dict[str, Any]:
        """Return the figures by name."""
        return asdict(self)


def try_case(case: Case) -> Trial:
    """Run a case on this process alone and judge it; a run that fails is a result, not an error."""
    trial, started = Trial(), time.perf_counter()
    try:
        _march(case, trial)
    except RunError as error:
        trial.verdict, trial.message = VERDICTS.get(type(error), "failed"), str(error)
    trial.seconds = time.perf_counter() - started
    return trial


def _march(case: Case, trial: Trial) -> None:
    model = build_model(case, MPI.COMM_SELF)
    system, law, scheme = model.system, model.law, make_integrator(case.time.scheme)
    seat = find_seat(system, law, model.seat_springs, scheme.carries_acceleration)
    plan = march_of_model(model, scheme)
    ledger, gates = open_ledger(system, law, seat.state), EnergyGates(case.gates, system.contact)
    recorder = Recorder(model)
    iterations: list[int] = []
    try:
        for step in march(plan, seat.state):
            ledger = enter_step(system, law, ledger, step)
            if step.refreshed is not None:
                ledger = restate(system, law, ledger, step.refreshed)
            recorder.see(step)
            iterations.append(step.iterations)
            trial.reached = step.new.time
            gates.check(step, ledger)
        judge(model, ledger, gates)
    finally:
        if iterations:
            scale = ledger.exchanged if ledger.exchanged > 0.0 else np.nan
            trial.created, trial.residual = gates.growth(ledger), ledger.residual / scale
            trial.lost = ledger.algorithmic / scale
            trial.penetration, trial.peak_force = float(recorder.deepest.max()), float(recorder.peak_force.max())
            clearance = abs(case.support.clearance)
            trial.relative_penetration = trial.penetration / clearance if clearance > 0.0 else None
            trial.iterations, trial.most_iterations = float(np.mean(iterations)), max(iterations)
