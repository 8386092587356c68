"""Environment of the process: home, cache and signals, set where they are missing, and threads.

One thread a rank unless the user says otherwise: the ranks are the parallelism (docs/how-to/run-on-a-cluster.md).
Libraries read these variables once, when they are loaded, which `import gapbeam` therefore comes before.
"""

from __future__ import annotations

import os
import pwd
import resource
import stat
import sys
import tempfile
from contextlib import suppress
from pathlib import Path

from gapbeam.solver.messages.errors import OutOfMemory
from gapbeam.solver.run.rank_threads import THREADS, is_count, threads_a_rank

OTHERS = stat.S_IWGRP | stat.S_IWOTH
LEAST_SPACE = 1.0e9  # bytes of addresses: what the libraries take before they multiply matrices, and some more
SPACE_A_THREAD = 134.3e6  # bytes: what OpenBLAS takes then
REMARKS: list[str] = []  # for the log, once there is one


def home_by_default() -> None:
    """Set HOME where it is not: Open MPI does not start without."""
    if not os.environ.get("HOME"):
        home = tempfile.gettempdir()
        with suppress(KeyError):  # a user that the system does not know, as in containers
            home = pwd.getpwuid(os.getuid()).pw_dir
        os.environ["HOME"] = home


def cache_by_default() -> None:
    """Take a cache in the folder for temporary files where the user's cannot be written: kernels are compiled into it.

    It is the same one for all ranks of a machine, and nobody else's: what it holds is run.
    """
    usual = Path(os.environ.get("XDG_CACHE_HOME") or Path(os.environ["HOME"]) / ".cache")
    with suppress(OSError):
        usual.mkdir(parents=True, exist_ok=True)
        if os.access(usual, os.W_OK | os.X_OK):
            return
    instead = Path(tempfile.gettempdir()) / f"gapbeam-{os.getuid()}"
    with suppress(OSError):
        instead.mkdir(mode=0o700, exist_ok=True)
        found = instead.lstat()
        if stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and not found.st_mode & OTHERS:
            os.environ["XDG_CACHE_HOME"] = str(instead)
            REMARKS.append(f"{usual} cannot be written: compiled kernels are kept in {instead}; set XDG_CACHE_HOME")


def signals_by_default() -> None:
    """Keep PETSc and UCX from signals, also where a run loads them after it has begun to listen.

    On a closed pipe or terminal PETSc would end the process, results and all; UCX would take SIGHUP for its debugger.
    """
    os.environ.setdefault("UCX_DEBUG_SIGNO", "0")
    options = os.environ.get("PETSC_OPTIONS", "")
    if "signal_handler" not in options:
        os.environ["PETSC_OPTIONS"] = f"{options} -no_signal_handler".strip()


def refuse_cramped() -> None:
    """Refuse a limit of addresses (RLIMIT_AS, `ulimit -v`) under which OpenBLAS would try for ever to get its buffer.

    Raises:
        OutOfMemory: The process has such a limit.
    """
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    least = LEAST_SPACE + SPACE_A_THREAD * threads_a_rank()
    if limit != resource.RLIM_INFINITY and limit < least:
        raise OutOfMemory(
            f"this process may use {limit / 1e9:.3g} GB of addresses (ulimit -v, RLIMIT_AS); expected at least "
            f"{least / 1e9:.3g} GB on {threads_a_rank()} threads, or the libraries wait for memory without end; "
            f"raise the limit, say ulimit -v {2 * round(least / 1e3)}, or take it away: ulimit -v unlimited"
        )


def words_of_the_command() -> list[str]:
    """Return the arguments of the command line, and take them from libraries that stumble over them.

    DOLFINx reads all words, and takes none that is not UTF-8. What the terminal has no letter for is written with
    escapes from now on.
    """
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")
    arguments = sys.argv[1:]
    sys.argv[1:] = []
    return arguments


def is_somewhere() -> bool:
    """Return whether the folder that the process works in is still there."""
    try:
        return bool(os.getcwd())  # noqa: PTH109 - Path.cwd() is no shorter way to ask
    except OSError:
        return False


def leave_cores_by_default() -> None:
    """Let ranks of Open MPI that wait leave their core to other processes.

    Where cores are shared, ranks that wait at full speed take the cores of the ranks they wait for.
    """
    os.environ.setdefault("OMPI_MCA_mpi_yield_when_idle", "1")


def one_thread_by_default() -> None:
    """Set the variables for the threads of libraries to 1, unless they hold a number.

    Libraries of their own variable follow OMP_NUM_THREADS where that is set and theirs is not.
    """
    wanted = os.environ.get(THREADS[0], "")
    default = wanted if is_count(wanted) else "1"
    for name in THREADS:
        if not is_count(os.environ.get(name, "")):
            os.environ[name] = default
