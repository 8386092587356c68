"""Time that the set-up of a reduced tube of 2.5 m in five round holes takes, and the mesh of 200 000 DOFs behind it.

    environment/run python3 -m benchmarks.five_holes [mesh size in m]

The tube of `cases/tube-holes.toml`, reduced with 40 modes and rigid sections, two stations in each hole. The set-up is
all that a run does before its first step: the mesh, the matrices, the basis, the rows of contact and the seat.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence

from mpi4py import MPI

from benchmarks.ten_holes import tube_in_holes
from gapbeam import read_case
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.models.model import build_model

HOLES, STATIONS, LENGTH, SIZE = 5, 2, 2.5, 0.0078  # -, -, m, m
CONTACTS = ("circle", "points")


def main(words: Sequence[str]) -> None:
    """Print the table."""
    size = float(words[0]) if words else SIZE
    print("| contact | DOFs of the mesh | unknowns | set-up but the seat | seat | processor time, all |")
    print("|---|---|---|---|---|---|")
    for contact in CONTACTS:
        tables = tube_in_holes(contact, STATIONS, HOLES, LENGTH)
        tables["mesh"] |= {"size": size}
        clock, work = time.perf_counter(), time.process_time()
        model = build_model(read_case(tables), MPI.COMM_SELF)
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
