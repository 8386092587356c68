"""Processor time of a step of a rigid tube that bounces in a hole, met at points around its sections and as a circle.

    environment/run python3 -m benchmarks.circle_speed [steps]

The least of five marches each, in turns, on one thread.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence

from mpi4py import MPI

from gapbeam import read_case
from gapbeam.solver.march.compiled.compiled_march import CompiledLoop
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.models.model import build_model
from gapbeam.solver.system.semi_discrete import State

STEPS, BEFORE, REPEATS = 20_000, 2_000, 5
LENGTH, DIAMETER = 0.04, 0.04  # m


def flight(contact: str) -> tuple[CompiledLoop, State]:
    """Return the march of a tube thrown down in a hole off its middle, and its state after some steps."""
    hole = {"name": "ring", "from": 0.0, "to": LENGTH, "clearance": 2.0e-4, "lateral": 1.0e-4}
    tables = {
        "beam": {
            "length": LENGTH, "thickness": DIAMETER, "width": DIAMETER, "section": {"type": "tube", "wall": 0.004},
        },
        "material": {"young_modulus": 2.0e11, "poisson_ratio": 0.3, "density": 7850.0},
        "mesh": {"dimension": 3, "size": LENGTH, "support_size": LENGTH},
        "model": {"type": "rigid"},
        "contact": {"stiffness": 2.0e9},
        "load": [],
        "support": [hole | {"region": {"type": "hole", "contact": contact}}],
        "analysis": {"type": "transient", "start": "undeformed", "motion": {"velocity": -0.1}},
        "time": {"end": 1.0, "step": 1.0e-5, "scheme": "discrete-gradient"},
    }  # fmt: skip
    simulation = Simulation(build_model(read_case(tables), MPI.COMM_SELF))
    loop = CompiledLoop(simulation.plan)
    *_, last = loop.blocks(simulation.start(simulation.seat_or_failure()), BEFORE, steps=BEFORE)
    return loop, last.end


def main(words: Sequence[str]) -> None:
    """Print the table."""
    steps = int(words[0]) if words else STEPS
    flights = {contact: flight(contact) for contact in ("points", "circle")}
    least = dict.fromkeys(flights, float("inf"))
    for _ in range(REPEATS):
        for contact, (loop, start) in flights.items():
            began = time.process_time()
            for _ in loop.blocks(start, steps, steps=steps):
                pass
            least[contact] = min(least[contact], 1.0e6 * (time.process_time() - began) / steps)
    print("| contact | contact points | us a step |\n|---|---|---|")
    for contact, (loop, _) in flights.items():
        print(f"| {contact} | {loop.plan.system.contact.size} | {least[contact]:.2f} |")


if __name__ == "__main__":
    main(sys.argv[1:])
