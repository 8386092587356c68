"""What every worker process loads before its first point (`--preload` of Dask), and how it computes one.

One piece of work in a process of its own, whose time and memory are those of the work alone.

How long a study still takes, from what it has done: nothing is said before anything is done.
"""

from __future__ import annotations

import logging
import multiprocessing
import os
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from importlib.metadata import version
from math import sqrt
from pathlib import Path
from typing import Any, TypeVar

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


Work = TypeVar("Work")
Result = TypeVar("Result")


def in_fresh_process(task: Callable[[Work], Result], work: Work) -> Result:
    """Do a piece of work in a process that does nothing before or beside it, on one thread.

    The process is spawned: a forked MPI process would share its parent's connections. It ends with this one, also where
    that is killed.

    Args:
        task: A function of a module, which the process imports.
        work: What it is called with; picklable.
    """
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn"), initializer=_end_with_parent) as process:
        return process.submit(task, work).result()


def _end_with_parent() -> None:
    """Let this process end when the one that spawned it is gone: it would wait for work for ever."""
    parent = multiprocessing.parent_process()

    def watch() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


class TimeLeft:
    """Estimates the time left of work that several workers share.

    The points that are done and those that are under way count: the mean time of a point is estimated by the time that
    all workers have spent over the number of points that are done. It is the estimate of the mean of exponential times
    where some are cut off (Epstein and Sobel, J. Am. Stat. Assoc. 48 (1953), 486), so that quick points, which are
    done first, do not make the rest look quick. With n points done its standard deviation is 1/sqrt(n) of it.

    Args:
        clock: Returns the time, s.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._begin: tuple[float, int] | None = None

    def words(self, done: int, total: int | None) -> str:
        """Return the time left in words, or "" where nothing is known; the first call starts the clock.

        Args:
            done: Points that are done; those of the first call were done before.
            total: All points; None: nobody knows.
        """
        if self._begin is None:
            self._begin = self._clock(), done
        fresh = done - self._begin[1]
        if total is None or fresh < 1 or done >= total:
            return ""
        left = (self._clock() - self._begin[0]) * (total - done) / fresh
        spread = 1.0 / sqrt(fresh)
        if spread < 0.25:
            return f"about {duration_words(left)} left"
        return f"{duration_words(left / (1.0 + spread))} to {duration_words(left * (1.0 + spread))} left"


def duration_words(seconds: float) -> str:
    """Return a time with a unit that one reads: s, min or h."""
    if seconds < 100.0:
        return f"{max(seconds, 1.0):.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 6000.0 else f"{seconds / 3600.0:.1f} h"
