"""Seat and march of a run without files, with their wall times."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from gapbeam.solver.case.case import Case
from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.march.python.march import March, march
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.models.model import Model
from gapbeam.solver.system.semi_discrete import VALUE, State


@dataclass(frozen=True)
class Seated:
    """A model at rest in its support, ready to march.

    Attributes:
        model: The model.
        plan: Its march; the operators are made.
        start: The seat.
        seconds: Wall time of each part of the set-up.
    """

    model: Model
    plan: March
    start: State
    seconds: dict[str, float]


@dataclass(frozen=True)
class Marched:
    """Cost of some marched steps.

    Attributes:
        steps: Number of steps.
        per_step: Mean wall time of a step with all that is kept of it: energy, gates, episodes, peaks; s.
        back_substitution: Mean wall time of the back-substitution in it, s.
        iterations: Mean iterations of the contact solve.
        active: Largest number of contact points under pressure.
        displacements: u after each step where asked for, else empty.
    """

    steps: int
    per_step: float
    back_substitution: float
    iterations: float
    active: int
    displacements: tuple[NDArray[np.float64], ...] = ()


def seated(case: Case, comm: MPI.Comm = MPI.COMM_SELF) -> Seated:
    """Mesh, assemble, seat and factor a case, by default on this process alone. Collective."""
    simulation = Simulation.of_case(case, comm)
    model, plan = simulation.model, simulation.plan
    clock = time.perf_counter()
    seat = simulation.seat()
    spent = {"seat": time.perf_counter() - clock}
    return Seated(model, plan, seat.state, model.seconds | spent | simulation.factor())


def marched(start: Seated, steps: int, keep: bool = False) -> Marched:
    """March some steps from the seat; `keep` keeps the displacements."""
    system, plan = start.model.system, replace(start.plan, steps=steps)
    accounts = Accounts.opened(system, start.model.law, start.start, plan.dt)
    back, iterations, active, kept, spent = 0.0, 0, 0, [], 0.0
    clock = time.perf_counter()
    for step in march(plan, start.start):
        accounts.take(step)
        spent += time.perf_counter() - clock
        back += step.timings["back_substitution"]
        iterations += step.iterations
        active = max(active, int(np.count_nonzero(step.new.pressure)))
        if keep and step.completes:
            kept.append((step.refreshed or step.new).u[VALUE].copy())
        clock = time.perf_counter()
    return Marched(steps, spent / steps, back / steps, iterations / steps, active, tuple(kept))
