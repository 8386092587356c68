"""What the command line does so that one rank's failure ends all ranks."""

from __future__ import annotations

import functools
import os
import sys
import traceback
from collections.abc import Callable
from typing import TYPE_CHECKING, ParamSpec

import click

from gapbeam.terminal import harmless

if TYPE_CHECKING:
    from mpi4py import MPI

Arguments = ParamSpec("Arguments")

RANK_VARIABLES = ("OMPI_COMM_WORLD_RANK", "PMIX_RANK", "PMI_RANK", "SLURM_PROCID")


def first_rank() -> bool:
    """Return whether this process should talk, without importing MPI."""
    if "mpi4py.MPI" in sys.modules:
        return bool(sys.modules["mpi4py.MPI"].COMM_WORLD.rank == 0)
    return (rank_told() or "0") == "0"


def on_one_rank(command: Callable[Arguments, int]) -> Callable[Arguments, int]:
    """Return a command that several ranks of mpirun refuse: each would do all of it, in one folder.

    Raises:
        UserError: When it is called, where there is more than one rank.
    """

    @functools.wraps(command)
    def guarded(*arguments: Arguments.args, **options: Arguments.kwargs) -> int:
        if rank_told() is not None:
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
    """Do the work; an error on one rank ends the whole MPI job with what that rank has to say.

    An error that all ranks raise together (a fault of the user's input, a march that did not converge) passes through;
    where some ranks go on or wait, such an error aborts the job with its own exit status. An unexpected error aborts it
    at once, with the trace.

    Returns:
        What the work returns.
    """
    ranks = _duplicated_ranks()
    try:
        return work()
    except (KeyboardInterrupt, click.exceptions.Exit, click.Abort):
        raise
    except BaseException as error:
        if ranks is None:
            raise
        status = 2 if isinstance(error, click.ClickException) else getattr(error, "exit_status", None)
        if status is not None and _came_together(ranks):
            raise
        try:
            told = f"gapbeam: rank {ranks.rank} failed; ending all ranks: {type(error).__name__}"
            print(told, file=sys.stderr, flush=True)
            if status is None:
                traceback.print_exc()
            else:
                print(f"gapbeam: {harmless(error)}", file=sys.stderr)
            sys.stderr.flush()
        finally:  # also where there is no memory left to tell it: the others would wait forever
            ranks.Abort(1 if status is None else int(status))
        raise


def rank_told() -> str | None:
    """Return the rank as the launcher tells it; None where there is none."""
    names = RANK_VARIABLES[: 3 if "SLURM_STEP_ID" not in os.environ else 4]
    return next((os.environ[name] for name in names if name in os.environ), None)


def _duplicated_ranks() -> MPI.Intracomm | None:
    """Return all ranks, with messages apart from all others; None for one rank. Collective."""
    if rank_told() is None and "mpi4py.MPI" not in sys.modules:
        return None
    from mpi4py import MPI

    return MPI.COMM_WORLD.Dup() if MPI.COMM_WORLD.size > 1 else None


def _came_together(ranks: MPI.Intracomm) -> bool:
    """Return whether all ranks end with an error that has a status, soon."""
    from meshes.rank_zero import all_there

    return all_there(ranks)
