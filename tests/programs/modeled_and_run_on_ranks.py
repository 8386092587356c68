"""March some steps of a case by `gapbeam.model` and run it by `gapbeam.run`, on all ranks.

Arguments: the case file, the results folder. Rank 0 prints the steps, the ranks and the exit status.
"""

from __future__ import annotations

import sys

from mpi4py import MPI

import gapbeam

overrides = {"time.end": 0.002, "time.step": 1e-4, "output.history_interval": 1e-4, "mesh.size": 0.05}
simulation = gapbeam.model(sys.argv[1], overrides)
times = [step.new.time for step in simulation.march(steps=3) if step.completes]
outcome = gapbeam.run(sys.argv[1], overrides, output=sys.argv[2])
if MPI.COMM_WORLD.rank == 0:
    print(len(times), MPI.COMM_WORLD.size, outcome.exit_status)
