"""What every worker process loads before its first point (`--preload` of Dask), and how it computes one."""

from __future__ import annotations

import logging
import os
import signal
import socket
import sys
import threading
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

from gapbeam.solver.errors import UserError

LOGGERS = ("distributed", "distributed.client", "distributed.gc", "distributed.nanny", "tornado", "asyncio")
ONE_POINT = threading.Lock()  # PETSc is not made for threads: one point at a time, however many threads a worker has


def dask_setup(_worker: object) -> None:
    """Let Ctrl-C, which a terminal sends to all processes, end the study alone: the study ends its workers.

    Called by Dask in the main thread of a worker.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    silence()
    logging.getLogger("gapbeam").setLevel(logging.ERROR)


def hushed() -> None:
    """Let nothing reach the terminal of what happens on a worker while its connections are closed from both ends."""
    sys.stderr = Path(os.devnull).open("w", encoding="utf-8")  # noqa: SIM115 - open until the process ends


def silence() -> None:
    """Let nothing of what Dask reports about its connections reach the terminal: the study reports what counts."""
    for name in LOGGERS:
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)


def computed(task: Callable[[Any], Any], work: Any) -> Any:
    """Compute one point on a worker."""
    with ONE_POINT:
        return task(work)


def introduced(study: tuple[str, Path | None]) -> None:
    """Refuse to compute on a worker with another gapbeam, or one that does not see the folder of the study.

    Args:
        study: Version of gapbeam of the study, and its folder.

    Raises:
        UserError: One of these.
    """
    release, folder = study
    mine = version("gapbeam")
    if mine != release:
        raise UserError(
            f"the worker on {socket.gethostname()} has gapbeam {mine}, the study {release}; expected the same on all "
            "machines"
        )
    if folder is not None and not folder.is_dir():
        raise UserError(
            f"the worker on {socket.gethostname()} does not see {folder}; expected a folder on a file system that all "
            "machines share: choose another `output=`"
        )
