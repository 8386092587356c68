"""Call gapbeam where rank 1 gets no more memory, gets SIGTERM, or is killed; checkpoints cost what they will.

python3 -m tests.programs.ended_rank memory|signal|killed [ARGUMENT ...]
"""

from __future__ import annotations

import os
import resource
import signal
import sys
from pathlib import Path
from typing import Any

from mpi4py import MPI

import gapbeam.solver.run.checkpoint.checkpoints as checkpoints
import gapbeam.solver.run.run_case as run_case
from gapbeam.command_line import main
from gapbeam.solver.integrators.midpoint import Midpoint
from gapbeam.solver.models.model import build_model

advance = Midpoint.advance


def without_memory(*arguments: Any, **options: Any) -> Any:
    """Build the model with hardly more memory than there is."""
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    most = pages * resource.getpagesize() + 2**24
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
    return build_model(*arguments, **options)


def terminated(*arguments: Any, **options: Any) -> Any:
    """Build the model after a signal."""
    os.kill(os.getpid(), signal.SIGTERM)
    return build_model(*arguments, **options)


def killed(self: Midpoint, system: Any, condensed: Any, law: Any, old: Any, *others: Any, **options: Any) -> Any:
    """Take a step, or end without a word."""
    if old.time > 0.01:
        os.kill(os.getpid(), signal.SIGKILL)
    return advance(self, system, condensed, law, old, *others, **options)


checkpoints.LARGEST_SHARE = 1.0e9
end = sys.argv[1]
if MPI.COMM_WORLD.rank == 1 and end == "killed":
    Midpoint.advance = killed  # type: ignore[method-assign]
elif MPI.COMM_WORLD.rank == 1:
    setattr(run_case, "build_model", {"memory": without_memory, "signal": terminated}[end])  # noqa: B010
main(sys.argv[2:])
