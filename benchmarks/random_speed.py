"""Processor time of a step of a tube in three baffles under turbulence: of noise, time loop and statistics.

environment/run python3 -m benchmarks.random_speed [modes] [steps] [points or circle]
"""

from __future__ import annotations

import sys
import time
import tomllib
from collections.abc import Callable, Sequence
from pathlib import Path

from mpi4py import MPI

from gapbeam import read_case
from gapbeam.solver.diagnostics.history_rows import Recorder
from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.march.compiled.compiled_march import CompiledLoop
from gapbeam.solver.march.compiled.plan_arrays import factor_rows
from gapbeam.solver.march.simulation import Simulation, Wanted, marched
from gapbeam.solver.models.model import build_model
from gapbeam.solver.run.checkpoint.checkpoints import steps_between
from gapbeam.solver.run.stop_rule import statistics_of

CASE = Path(__file__).parents[1] / "cases" / "tube-turbulence.toml"
MODES, STEPS = 40, 50_000
STEP = 2.0e-5  # of the case, s
AT_ONCE = 10_000  # steps whose noise is made at once
BEFORE = 5_000  # steps until the tube rattles


def microseconds(steps: int, march: Callable[[], None]) -> float:
    """Return the processor time of a step, us."""
    started = time.process_time()
    march()
    return 1.0e6 * (time.process_time() - started) / steps


def main(words: Sequence[str]) -> None:
    """Print the table."""
    modes, steps = [*map(int, words[:2]), *(MODES, STEPS)[len(words) :]]
    contact = words[2] if len(words) > 2 else "points"
    keys = (f"model.modes={modes}", f"time.end={steps * STEP:.6g}", "load.lift.ramp=0", "load.drag.ramp=0")
    tables = tomllib.loads(CASE.read_text())
    for support in tables["support"]:
        support["region"] = {"type": support["region"], "contact": contact}
    case = read_case(tables, keys)
    model = build_model(case, MPI.COMM_SELF)
    simulation = Simulation(model)
    plan, every = simulation.plan, steps_between(case, model.step)["history_interval"]
    start = simulation.start(simulation.seat_or_failure())
    loop = CompiledLoop(plan)
    *_, last = loop.blocks(start, every, steps=BEFORE)

    def noise() -> None:
        for first in range(0, steps, AT_ONCE):
            factor_rows(plan, first, AT_ONCE)

    def bare() -> None:
        for _ in loop.blocks(last.end, steps, steps=steps):
            pass

    def whole() -> None:
        recorder = Recorder(case, model, statistics=statistics_of(case, model, every))
        accounts = Accounts.opened(plan.system, plan.law, last.end, plan.dt)
        recorder.row(last.end, accounts)
        for _ in marched(plan, last.end, accounts, recorder, Wanted(every), MPI.COMM_SELF):
            pass

    shares = {"noise": microseconds(steps, noise), "noise and time loop": microseconds(steps, bare)}
    shares[f"all, with a record and statistics of {every} steps"] = microseconds(plan.steps, whole)
    system = model.system
    print(f"{system.operators.size} DOFs, {system.contact.size} contact points, {len(system.loads)} signals and loads")
    print("| part | us |\n|---|---|")
    for name, cost in shares.items():
        print(f"| {name} | {cost:.2f} |")


if __name__ == "__main__":
    main(sys.argv[1:])
