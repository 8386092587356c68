"""Workers of a study: this process, processes of this machine, or jobs on many machines.

The options behind `--slurm` are those of sbatch. Every worker process loads the libraries before its first point
(`--preload` of Dask). Work whose time and memory are measured gets a process of its own. The remaining time of a study
is estimated from the points that are done.
"""

from __future__ import annotations

import logging
import multiprocessing
import os
import re
import shlex
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from importlib.machinery import PathFinder
from importlib.metadata import version
from math import inf, sqrt
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.run.rank_threads import cores

EXAMPLE = '"--time=2:00:00 --cpus-per-task=16 --mem-per-cpu=2G"'
CORES = ("--cpus-per-task", "-c")
OURS = ("--ntasks", "-n", "--nodes", "-N", "--array", "-a", "--wrap", "--mem-per-gpu", "--ntasks-per-node")
UNITS = {"": 1.0e6, "K": 1.0e3, "M": 1.0e6, "G": 1.0e9, "T": 1.0e12}  # bytes; without a unit sbatch takes megabytes


class JobOptions(NamedTuple):
    """Options of sbatch for one job.

    Attributes:
        directives: Options as lines of a job script, without cores and memory.
        workers: A job holds, one a core.
        memory: Memory of a job, bytes; None: not given.
    """

    directives: tuple[str, ...]
    workers: int
    memory: float | None


def read_job_options(text: str) -> JobOptions:
    """Read options of sbatch.

    Args:
        text: As typed, such as "--time=2:00:00 -c 16".

    Raises:
        UserError: A word is no option, or one contradicts that a job is one task on one machine.
    """
    try:
        words = shlex.split(text)
    except ValueError as fault:
        raise UserError(f"`slurm=` {text!r}: {fault}; expected options of sbatch, such as {EXAMPLE}") from fault
    options: list[tuple[str, str]] = []
    for word in words:
        name, _, value = word.partition("=")
        short = re.fullmatch(r"(-[a-zA-Z])(.+)", word)
        if word.startswith("--"):
            options.append((name, value))
        elif short is not None:
            options.append((short[1], short[2]))
        elif word.startswith("-"):
            options.append((word, ""))
        elif options and not options[-1][1]:
            options[-1] = (options[-1][0], word)
        else:
            raise UserError(f"`slurm=`: found the word {word!r}; expected options of sbatch alone, such as {EXAMPLE}")
    for name, _ in options:
        if name in OURS:
            raise UserError(
                f"`slurm=`: found {name}; a job of workers is one task on one machine: expected --cpus-per-task, a "
                "worker a core, and `workers=` for how many workers in all"
            )
    cores = next((value for name, value in options if name in CORES), "1")
    if not cores.isdigit() or int(cores) < 1:
        raise UserError(f"`slurm=` --cpus-per-task: found {cores!r}; expected a number of cores")
    memory = next((_bytes(name, value) for name, value in options if name == "--mem"), None)
    each = next((_bytes(name, value) for name, value in options if name == "--mem-per-cpu"), None)
    if each is not None:
        memory = int(cores) * each
    taken = {*CORES, "--mem", "--mem-per-cpu"}
    lines = tuple(_line(name, value) for name, value in options if name not in taken)
    return JobOptions(lines, int(cores), memory)


def _line(name: str, value: str) -> str:
    if not value:
        return name
    return f"{name}={shlex.quote(value)}" if name.startswith("--") else f"{name} {shlex.quote(value)}"


def _bytes(name: str, value: str) -> float:
    found = re.fullmatch(r"(\d+)([KMGT]?)B?", value.upper())
    if found is None or int(found[1]) == 0:
        raise UserError(f"`slurm=` {name}: found {value!r}; expected a memory such as 2G or 500M")
    return int(found[1]) * UNITS[found[2]]


INSTALL = "pip install 'gapbeam[workers]'"


@dataclass(frozen=True)
class Workers:
    """Workers that compute the points of a study, one point at a time each, on one thread.

    Attributes:
        count: Workers; None: one a core of this machine, or those of one job under Slurm. 1: this process itself.
        scheduler: Address of a running scheduler of Dask, such as "tcp://node7:8786", whose workers are taken.
        slurm: Options of sbatch, such as "--time=2:00:00 --cpus-per-task=16": jobs with a worker a core are submitted.

    Raises:
        UserError: The count is below 1, there is no such option of sbatch, or two of them exclude each other.
    """

    count: int | None = None
    scheduler: str | None = None
    slurm: str | None = None

    def __post_init__(self) -> None:
        if self.count is not None and self.count < 1:
            raise UserError(f"`workers=`: found {self.count!r}; expected at least 1")
        if self.scheduler is not None and self.slurm is not None:
            raise UserError("`scheduler=` takes workers that run, `slurm=` submits jobs with new ones: give one")
        if self.scheduler is not None and self.count is not None:
            raise UserError(
                "`workers=` starts workers, `scheduler=` takes those that run already, all of them: give one"
            )
        if self.scheduler is not None and "://" not in self.scheduler:
            raise UserError(f"`scheduler=`: found {self.scheduler!r}; expected an address such as tcp://node7:8786")
        if self.slurm is not None:
            read_job_options(self.slurm)
        asked = (self.count or 1) > 1 or self.elsewhere
        if asked and not dask_is_here():
            raise UserError(
                f"workers need Dask, which is not installed: {INSTALL}; `workers=1` computes in this process without"
            )

    @property
    def elsewhere(self) -> bool:
        """True where workers may run on other machines, which must then see the folders of this one."""
        return self.scheduler is not None or self.slurm is not None

    @property
    def job(self) -> JobOptions:
        """Options of sbatch for each job."""
        return read_job_options(self.slurm or "")

    def here(self, points: int, room: float = inf) -> int:
        """Return the number of workers that this machine starts.

        Args:
            points: Number of points to compute.
            room: Workers that the free memory has room for.
        """
        wanted = self.count or (cores() if dask_is_here() else 1)
        return int(max(1, min(wanted, points, room)))


def dask_is_here() -> bool:
    """Return whether Dask is installed, without loading it."""
    return PathFinder.find_spec("distributed") is not None


def as_workers(workers: int | Workers | None) -> Workers:
    """Return workers as a Python session gives them: a number, or all about them."""
    return workers if isinstance(workers, Workers) else Workers(workers)


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
    """Keep messages of a worker from the terminal while its connections close."""
    sys.stderr = Path(os.devnull).open("w", encoding="utf-8")  # noqa: SIM115 - open until the process ends


def silence() -> None:
    """Keep Dask's reports on connections from the terminal."""
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
        UserError: The worker has another gapbeam, or does not see the folder.
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
    """Call a function in a process that does nothing else, on one thread.

    The process is spawned: a forked MPI process would share its parent's connections. It ends with this one, also where
    that is killed.

    Args:
        task: A function of a module, which the process imports.
        work: Its argument; picklable.
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
