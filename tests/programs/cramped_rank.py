"""Call gapbeam where rank 1 gets no more memory from its first factorization on."""

from __future__ import annotations

import resource
import sys
from pathlib import Path
from typing import Any

from mpi4py import MPI

import gapbeam.solver.linear_algebra.mumps_factor as module
from gapbeam.command_line import main

whole = module.PetscFactor.of


def cramped(*arguments: Any, **options: Any) -> Any:
    """Factor, on rank 1 with hardly more memory than there is."""
    if MPI.COMM_WORLD.rank == 1:
        here = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (here + 2**20, here + 2**20))
    return whole(*arguments, **options)


module.PetscFactor.of = staticmethod(cramped)  # type: ignore[method-assign]
main(sys.argv[1:])
