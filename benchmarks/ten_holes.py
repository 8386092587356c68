"""Processor time of a step of a tube of 4 m that orbits in ten round holes: the part of the time loop, and of a run.

    environment/run python3 -m benchmarks.ten_holes [steps]

The tube of `cases/tube-holes.toml`, reduced with 40 modes and rigid sections, turned about by forces of 100 N upward
and aside. The table says how many holes are touched. Energy gates judge every step. The least of five marches each, on
one thread.
"""

from __future__ import annotations

import sys
import time
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

from gapbeam import read_case
from gapbeam.solver.diagnostics.history_rows import Recorder
from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.march.compiled.compiled_march import CompiledLoop
from gapbeam.solver.march.simulation import Simulation, Wanted, marched
from gapbeam.solver.models.model import build_model
from gapbeam.solver.system.semi_discrete import State

CASE = Path(__file__).parents[1] / "cases" / "tube-holes.toml"
STEPS, BEFORE, REPEATS = 10_000, 5_000, 5
HOLES, MODES, LENGTH, WIDTH = 10, 40, 4.0, 0.02  # -, -, m, m
STEP, EVERY = 1.0e-5, 10  # s; steps to a record
SCENES = [("circle", 2), ("circle", 4), ("circle", 8), ("points", 8)]


@dataclass(frozen=True)
class Orbits:
    """A tube that orbits: its simulation, time loop and state after some steps."""

    simulation: Simulation
    loop: CompiledLoop
    start: State

    def opened(self) -> Accounts:
        """Return accounts with the energy gates of the case."""
        plan = self.loop.plan
        return Accounts.opened(plan.system, plan.law, self.start, plan.dt, self.simulation.case.gates)

    def time_loop(self, steps: int) -> float:
        """Return the processor time of a step of the time loop with its gates, us."""
        accounts, began = self.opened(), time.process_time()
        for _ in self.loop.blocks(self.start, steps, accounts, steps=steps):
            pass
        return 1.0e6 * (time.process_time() - began) / steps

    def run(self, steps: int) -> float:
        """Return the processor time of a step with everything that a run keeps of its steps but files, us."""
        recorder = Recorder(self.simulation.case, self.simulation.model)
        accounts, began = self.opened(), time.process_time()
        recorder.row(self.start, accounts)
        plan = replace(self.loop.plan, steps=steps)
        for _ in marched(plan, self.start, accounts, recorder, Wanted(EVERY), MPI.COMM_SELF):
            pass
        return 1.0e6 * (time.process_time() - began) / steps


def tube_in_holes(contact: str, stations: int, holes: int, length: float) -> dict[str, Any]:
    """Return the tables of a reduced tube with rigid sections in equal holes along its length."""
    tables = tomllib.loads(CASE.read_text())
    hole = {key: value for key, value in tables["support"][0].items() if key not in ("name", "from", "to")}
    hole["region"] = {"type": "hole", "contact": contact}
    places = np.linspace(0.1, length - 0.1, holes)
    tables["support"] = [
        hole | {"name": f"hole{n}", "from": float(x) - 0.5 * WIDTH, "to": float(x) + 0.5 * WIDTH}
        for n, x in enumerate(places)
    ]
    tables["beam"]["length"] = length
    tables["model"] = {"type": "reduced", "sections": "rigid", "stations": stations, "modes": MODES}
    return tables


def orbits(contact: str, stations: int) -> tuple[Orbits, str]:
    """Return the orbits of a tube, and its size in words, with contact points and iterations."""
    tables = tube_in_holes(contact, stations, HOLES, LENGTH)
    force = {"type": "harmonic_force", "point": 2.1, "amplitude": 100.0}
    tables["load"] = [
        {"type": "gravity"},
        force | {"name": "up", "frequency": 25.0, "direction": [0.0, 0.0, 1.0]},
        force | {"name": "aside", "frequency": 25.0, "phase": 90.0, "direction": [0.0, 1.0, 0.0]},
    ]
    tables["mesh"] |= {"size": 0.05}
    tables["time"] = {"end": (BEFORE + STEPS) * STEP, "step": STEP, "scheme": "discrete-gradient"}
    simulation = Simulation(build_model(read_case(tables), MPI.COMM_SELF))
    loop = CompiledLoop(simulation.plan)
    found = list(loop.blocks(simulation.start(simulation.seat_or_failure()), BEFORE, steps=BEFORE))
    forces = np.concatenate([block.records.force for block in found])
    touched = int(np.count_nonzero(np.abs(forces).max(axis=0)))
    iterations = sum(int(block.records.iterations.sum()) for block in found) / BEFORE
    model = simulation.model
    size = f"{contact}, {stations} | {model.dofs} | {model.system.contact.size} | {touched} | {iterations:.1f}"
    return Orbits(simulation, loop, found[-1].end), size


def main(words: Sequence[str]) -> None:
    """Print the table."""
    steps = int(words[0]) if words else STEPS
    scenes = [orbits(*scene) for scene in SCENES]
    least = np.full((len(scenes), 2), np.inf)
    for _ in range(REPEATS):
        for row, (one, _) in zip(least, scenes, strict=True):
            row[:] = np.minimum(row, (one.time_loop(steps), one.run(steps)))
    print("| contact, stations | DOFs | points | holes touched | iterations | time loop | all |")
    print("|---|---|---|---|---|---|---|")
    for (loop, whole), (_, size) in zip(least, scenes, strict=True):
        print(f"| {size} | {loop:.1f} us | {whole:.1f} us |")


if __name__ == "__main__":
    main(sys.argv[1:])
