"""Print the cost of a step in the compiled march and in Python.

environment/run python3 docs/tables/compiled_table.py
"""

from __future__ import annotations

import time
from collections.abc import Callable
from itertools import islice
from pathlib import Path

from mpi4py import MPI

from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.march.compiled.compiled_march import CompiledLoop
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.march.stepwise_march import march

DEMO = Path(__file__).parents[2] / "cases" / "demo.toml"
HOLES = DEMO.with_name("tube-holes.toml")
RATTLE = ("load.shaker.amplitude=500.0", "load.shaker.frequency=100.0", "load.shaker.ramp=0.0")
STEPS = ("time.step=1e-5", "time.end=0.1")
SOLID = ("mesh.dimension=3", 'mesh.cell="hexahedron"')
SLOW_STEPS = 100
CASES: dict[str, tuple[str, ...]] = {
    "reduced, 2D": ('model={type="reduced"}',),
    "reduced, 3D": ('model={type="reduced"}', *SOLID),
    "reduced, 3D, 5 points across": ('model={type="reduced", points_across=5}', *SOLID),
    "beam elements": ('model={type="beam"}',),
    "reduced, 2D, `hunt-crossley`": ('model={type="reduced"}', 'contact.law={type="hunt-crossley",restitution=0.6}'),
    "reduced, 2D, K = 1e18 Pa/m": ('model={type="reduced"}', "contact.stiffness=1e18"),
}

IN_HOLES = {
    "beam elements in two holes": '{type="beam"}',
    "rigid body in two holes": '{type="rigid"}',
    "reduced, in two holes": '{type="reduced"}',
    "reduced, rigid sections in two holes": '{type="reduced", sections="rigid"}',
}


def seconds_of(work: Callable[[], object]) -> float:
    """Return the processor time of some work, s: that of a core without other work."""
    started = time.process_time()
    work()
    return time.process_time() - started


def main() -> None:
    """Print the table."""
    print("| model | DOFs | points | closed | iterations | compiled | step by step |")
    print("|---|---|---|---|---|---|---|")
    cases = {name: read_case(DEMO, [*RATTLE, *STEPS, *overrides]) for name, overrides in CASES.items()}
    cases |= {name: read_case(HOLES, [*STEPS, f"model={model}"]) for name, model in IN_HOLES.items()}
    for name, case in cases.items():
        simulation = Simulation.of_case(case, MPI.COMM_SELF)
        model, plan, seat = simulation.model, simulation.plan, simulation.seat().state
        loop = CompiledLoop(plan)
        list(loop.blocks(seat, steps=10))
        list(islice(march(plan, seat), 2))  # what first steps compile is not part of the others
        found = []
        fast = seconds_of(lambda loop=loop, seat=seat, found=found: found.extend(loop.blocks(seat))) / plan.steps
        slow = seconds_of(lambda plan=plan, seat=seat: list(islice(march(plan, seat), SLOW_STEPS))) / SLOW_STEPS
        active = sum(float(block.records.active.sum()) for block in found) / plan.steps
        iterations = sum(int(block.records.iterations.sum()) for block in found) / plan.steps
        size = f"{model.dofs} | {model.system.contact.size} | {active:.0f} | {iterations:.1f}"
        print(f"| {name} | {size} | {1e6 * fast:.1f} us | {1e6 * slow:.0f} us |", flush=True)


if __name__ == "__main__":
    main()
