"""Orphaned ranks, whose launcher was killed: they end themselves, since nobody else would.

mpirun that is asked to end ends its ranks. One that is killed cannot: they would go on computing as orphans, in the
way of a resumed run. So every rank looks at its parent, and takes its loss as a SIGTERM. Open MPI 5 misses
its server after about a second and aborts: a rank that has not ended by then leaves the last checkpoint alone.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from contextlib import suppress
from typing import TYPE_CHECKING, NoReturn

from gapbeam.meshes.rank_zero import ONE_RANK
from gapbeam.meshes.versions.launcher_variables import rank_of_launcher
from gapbeam.process.process_environment import refuse_cramped
from gapbeam.solver.messages.wording import LOG

if TYPE_CHECKING:
    from mpi4py import MPI

INTERVAL = 0.2  # s between two looks; in a second Open MPI aborts
PATIENCE = 300.0  # s for the last checkpoint
TERMINATED = 143
OUTPUT = "output"  # name of the thread that writes results
_parents: list[int] = []


def end_with_launcher() -> None:
    """Watch the process that started this rank, from another thread; nothing where it is none of several ranks."""
    if rank_of_launcher() is not None and not _parents:
        _parents.append(os.getppid())
        threading.Thread(target=_watch, name="launcher", daemon=True).start()


def all_ranks() -> MPI.Comm:
    """Return the communicator of all ranks, without MPI where no launcher is, after a check of its address space.

    Raises:
        OutOfMemory: The limit of addresses of this process is too low to begin with.
    """
    refuse_cramped()
    if rank_of_launcher() is None and "mpi4py.MPI" not in sys.modules:
        return ONE_RANK
    from mpi4py import MPI

    end_with_launcher()
    if MPI.COMM_WORLD.size > 1:  # PETSc starts on all ranks together, also where one of them will use it
        with suppress(ImportError):
            from slepc4py import SLEPc  # noqa: F401
    return MPI.COMM_WORLD


def leave(status: int) -> NoReturn:
    """End the process: in order, or at once where MPI would wait for a launcher that is gone, or HDF5 for a disk.

    A thread that writes and does not end would not open the lock of HDF5.
    """
    writing = [thread for thread in threading.enumerate() if thread.name == OUTPUT]
    for thread in writing:
        thread.join(INTERVAL)
    if any(thread.is_alive() for thread in writing) or (_parents and os.getppid() != _parents[0]):
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)
    sys.exit(status)


def _watch() -> None:
    while os.getppid() == _parents[0]:
        time.sleep(INTERVAL)
    LOG.warning("the launcher of the ranks is gone (mpirun or srun, killed?): the ranks end as well")
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(PATIENCE)
    os._exit(TERMINATED)
