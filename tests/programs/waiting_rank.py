"""Print the time of the processor that a rank takes while it waits for another one, which works on the same core."""

from __future__ import annotations

import os
import time

import gapbeam  # noqa: F401 - before anything loads MPI

from mpi4py import MPI  # isort: skip

WORK = 0.3  # s
os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
MPI.COMM_WORLD.Barrier()
start = time.process_time()
while MPI.COMM_WORLD.rank and time.process_time() < start + WORK:
    pass
MPI.COMM_WORLD.Barrier()
if MPI.COMM_WORLD.rank == 0:
    print((time.process_time() - start) / WORK)
