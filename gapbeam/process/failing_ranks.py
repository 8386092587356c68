"""Failure of one rank, which ends all ranks of a command."""

from __future__ import annotations

import functools
import sys
import traceback
from collections.abc import Callable
from typing import TYPE_CHECKING, ParamSpec

import typer

from gapbeam.meshes.versions.launcher_variables import rank_of_launcher
from gapbeam.process.terminal_text import harmless, with_options
from gapbeam.process.usage_errors import ClickException

if TYPE_CHECKING:
    from mpi4py import MPI

Arguments = ParamSpec("Arguments")


def first_rank() -> bool:
    """Return whether this process should talk, without importing MPI."""
    if "mpi4py.MPI" in sys.modules:
        return bool(sys.modules["mpi4py.MPI"].COMM_WORLD.rank == 0)
    return (rank_of_launcher() or "0") == "0"


def on_one_rank(command: Callable[Arguments, int]) -> Callable[Arguments, int]:
    """Return a command that several ranks of mpirun refuse: each would do all of it, in one folder.

    Raises:
        UserError: The command is called on more than one rank.
    """

    @functools.wraps(command)
    def guarded(*arguments: Arguments.args, **options: Arguments.kwargs) -> int:
        refuse_ranks(command.__name__.rstrip("_"))
        return command(*arguments, **options)

    return guarded


def refuse_ranks(name: str) -> None:
    """Refuse several ranks for work that is not shared between ranks.

    Args:
        name: Name of the command or call that takes one process.

    Raises:
        UserError: There is more than one rank.
    """
    if rank_of_launcher() is None:
        return
    from mpi4py import MPI

    from gapbeam.solver.messages.errors import UserError

    if MPI.COMM_WORLD.size > 1:
        raise UserError(
            f"gapbeam {name} takes one process, and starts others itself where that helps; found "
            f"{MPI.COMM_WORLD.size} ranks: call it without mpirun (run, check and modes take ranks)"
        )


def abort_together(work: Callable[[], int]) -> int:
    """Do the work; an error on one rank ends the whole MPI job with the message of that rank.

    An error that all ranks raise together (a fault of the user's input, a march that did not converge) passes through;
    where some ranks go on or wait, such an error aborts the job with its own exit status. An unexpected error aborts it
    at once, with the trace.

    Returns:
        Result of the work.
    """
    ranks = _duplicated_ranks()
    try:
        return work()
    except (KeyboardInterrupt, typer.Exit, typer.Abort):
        raise
    except BaseException as error:
        if ranks is None:
            raise
        status = 2 if isinstance(error, ClickException) else getattr(error, "exit_status", None)
        if status is not None and _came_together(ranks):
            raise
        try:
            words = f"gapbeam: rank {ranks.rank} failed; ending all ranks: {type(error).__name__}"
            print(words, file=sys.stderr, flush=True)
            if status is None:
                traceback.print_exc()
            else:
                print(f"gapbeam: {harmless(with_options(error))}", file=sys.stderr)
            sys.stderr.flush()
        finally:  # also where there is no memory left to report it: the others would wait forever
            ranks.Abort(1 if status is None else int(status))
        raise


def _duplicated_ranks() -> MPI.Intracomm | None:
    """Return all ranks, with messages apart from all others; None for one rank. Collective."""
    if rank_of_launcher() is None and "mpi4py.MPI" not in sys.modules:
        return None
    from mpi4py import MPI

    return MPI.COMM_WORLD.Dup() if MPI.COMM_WORLD.size > 1 else None


def _came_together(ranks: MPI.Intracomm) -> bool:
    """Return whether all ranks end with an error that has a status, soon."""
    from gapbeam.meshes.rank_zero import all_there

    return all_there(ranks)
