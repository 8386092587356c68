"""What the command line does so that one rank's failure ends all ranks."""

from __future__ import annotations

import functools
import os
import sys
import traceback
from collections.abc import Callable
from typing import ParamSpec

Arguments = ParamSpec("Arguments")

RANK_VARIABLES = ("OMPI_COMM_WORLD_RANK", "PMIX_RANK", "PMI_RANK", "SLURM_PROCID")


def first_rank() -> bool:
    """Return whether this process should talk, without importing MPI."""
    if "mpi4py.MPI" in sys.modules:
        return bool(sys.modules["mpi4py.MPI"].COMM_WORLD.rank == 0)
    ranks = (os.environ.get(name) for name in RANK_VARIABLES[: 3 if "SLURM_STEP_ID" not in os.environ else 4])
    return next((rank for rank in ranks if rank is not None), "0") == "0"


def on_one_rank(command: Callable[Arguments, int]) -> Callable[Arguments, int]:
    """Return a command that several ranks of mpirun refuse: each would do all of it, in one folder.

    Raises:
        UserError: When it is called, where there is more than one rank.
    """

    @functools.wraps(command)
    def guarded(*arguments: Arguments.args, **options: Arguments.kwargs) -> int:
        if any(name in os.environ for name in RANK_VARIABLES):
            from mpi4py import MPI

            from solver.errors import UserError

            if MPI.COMM_WORLD.size > 1:
                raise UserError(
                    f"gapbeam {command.__name__} takes one process, and starts others itself where that helps; found "
                    f"{MPI.COMM_WORLD.size} ranks: call it without mpirun (run, check and modes take ranks)"
                )
        return command(*arguments, **options)

    return guarded


def abort_together(work: Callable[[], int]) -> int:
    """Do the work; an unexpected error on one rank aborts the whole MPI job with that rank's trace.

    Errors that all ranks raise together (faults of the user's input) pass through.
    """
    from meshes.errors import MeshError
    from solver.case_file.faults import CaseError
    from solver.errors import RunError

    try:
        return work()
    except (CaseError, MeshError, RunError):
        raise
    except KeyboardInterrupt:
        raise
    except BaseException:
        from mpi4py import MPI

        if MPI.COMM_WORLD.size == 1:
            raise
        print(f"gapbeam: rank {MPI.COMM_WORLD.rank} failed; ending all ranks", file=sys.stderr)
        traceback.print_exc()
        sys.stderr.flush()
        MPI.COMM_WORLD.Abort(1)
        raise
