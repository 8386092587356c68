"""Call gapbeam where one function raises an error on rank 1, or without ranks.

    python3 -m tests.programs.broken_rank MODULE PLACE ERROR [ARGUMENT ...]

PLACE is a name in the module, as in "find_seat" or "Midpoint.advance"; ERROR is of Python or of
`gapbeam.solver.messages.errors`.
"""

from __future__ import annotations

import builtins
import importlib
import sys
from typing import Any, NoReturn

from mpi4py import MPI

from gapbeam.command_line import main
from gapbeam.solver.messages import errors

module, place, error = sys.argv[1:4]
kind: type[Exception] = getattr(builtins, error, None) or getattr(errors, error)


def broken(*_arguments: Any, **_options: Any) -> NoReturn:
    """Raise the error instead of what would be called."""
    raise kind("rank 1 has had enough")


owner: Any = importlib.import_module(module)  # on all ranks: what starts PETSc is collective
if MPI.COMM_WORLD.rank == 1 or MPI.COMM_WORLD.size == 1:
    *classes, name = place.split(".")
    for one in classes:
        owner = getattr(owner, one)
    setattr(owner, name, broken)
main(sys.argv[4:])
