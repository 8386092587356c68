"""Time that the set-up of a reduced tube of 2.5 m in five round holes takes, and the mesh of 200 000 DOFs behind it.

    environment/run python3 -m benchmarks.five_holes [mesh size in m]

The tube of `cases/tube-holes.toml`, reduced with 40 modes and rigid sections, two stations in each hole. The set-up is
all that a run does before its first step: the mesh, the matrices, the basis, the rows of contact and the seat.
"""

from __future__ import annotations

import sys
import time
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

from gapbeam import read_case
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.models.model import build_model

CASE = Path(__file__).parents[1] / "cases" / "tube-holes.toml"
HOLES, MODES, LENGTH, WIDTH, SIZE = 5, 40, 2.5, 0.02, 0.0078  # -, -, m, m, m
CONTACTS = ("circle", "points")


def tables(contact: str, size: float) -> dict[str, Any]:
    """Return the tables of the case."""
    found = tomllib.loads(CASE.read_text())
    hole = {key: value for key, value in found["support"][0].items() if key not in ("name", "from", "to")}
    hole["region"] = {"type": "hole", "contact": contact}
    places = np.linspace(0.1, LENGTH - 0.1, HOLES)
    found["support"] = [
        hole | {"name": f"hole{n}", "from": float(x) - 0.5 * WIDTH, "to": float(x) + 0.5 * WIDTH}
        for n, x in enumerate(places)
    ]
    found["beam"]["length"] = LENGTH
    found["model"] = {"type": "reduced", "sections": "rigid", "stations": 2, "modes": MODES}
    found["mesh"] |= {"size": size}
    return found


def main(words: Sequence[str]) -> None:
    """Print the table."""
    size = float(words[0]) if words else SIZE
    print("| contact | DOFs of the mesh | unknowns | set-up but the seat | seat | processor time, all |")
    print("|---|---|---|---|---|---|")
    for contact in CONTACTS:
        clock, work = time.perf_counter(), time.process_time()
        model = build_model(read_case(tables(contact, size)), MPI.COMM_SELF)
        simulation, built = Simulation(model), time.perf_counter()
        simulation.start(simulation.seat_or_failure())
        seated = time.perf_counter()
        print(
            f"| {contact} | {model.mesh_dofs} | {model.dofs} | {built - clock:.1f} s | {seated - built:.1f} s "
            f"| {time.process_time() - work:.1f} s |",
            flush=True,
        )


if __name__ == "__main__":
    main(sys.argv[1:])
