"""Compare the block at the interface with that by columns, on all ranks together; reports it by mesh."""

from __future__ import annotations

import json

from mpi4py import MPI

from tests.unit.test_inverse_entries import MESHES, compared

words = {name: compared(changes, MPI.COMM_WORLD) for name, changes in MESHES.items()}
if MPI.COMM_WORLD.rank == 0:
    print(json.dumps(words))
