"""Runs in processes of their own that start from this one, so that imports are paid once."""

from __future__ import annotations

import os
import signal
import sys
import time
import traceback
import warnings
from collections.abc import Callable
from pathlib import Path

import gapbeam.solver.run.checkpoint.checkpoints as checkpoints
from gapbeam.command_line import main

LONGEST = 1200.0  # s, for what takes seconds: only what hangs takes longer, however busy the machine is


def beside(work: Callable[[], int], words: Path) -> int:
    """Do some work in a process of its own, whose standard error goes to a file, and return its number.

    Python warns of forks where there are threads: a lock that another thread holds is never let go in the child. Here
    they are those of MPI, which the child does not call into anew, and of OpenBLAS and glibc, which mend their locks at
    forks; a child that waits all the same is ended, and reported, by `ended`.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        process = os.fork()
    if process:
        return process
    status = 1
    try:
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.SIG_DFL)
        with words.open("w", encoding="utf-8") as errors:
            os.dup2(errors.fileno(), 2)
            sys.stderr = errors
            try:
                status = work()
            except BaseException:
                traceback.print_exc()
    finally:
        os._exit(status)


def ended(process: int, longest: float = LONGEST) -> int:
    """Wait until a process has ended and return its exit status, negative for the signal that ended it."""
    deadline = time.monotonic() + longest
    while time.monotonic() < deadline:
        done, status = os.waitpid(process, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status)
        time.sleep(0.01)
    os.kill(process, signal.SIGKILL)
    os.waitpid(process, 0)
    raise AssertionError(f"process {process} did not end in {longest} s")


def until(true: Callable[[], bool], what: str, longest: float = LONGEST) -> None:
    """Wait until something is true."""
    deadline = time.monotonic() + longest
    while not true():
        assert time.monotonic() < deadline, f"{what}: not after {longest} s"
        time.sleep(0.005)


def appears(path: Path) -> None:
    """Wait until a file is there."""
    until(path.exists, f"{path} is there")


def often() -> None:
    """Let checkpoints cost what they will."""
    checkpoints.LARGEST_SHARE = 1.0e9


def command(*arguments: str | Path, first: Callable[[], None] = often) -> Callable[[], int]:
    """Return the command line as work for a process."""

    def work() -> int:
        first()
        try:
            main([str(argument) for argument in arguments])
        except SystemExit as leaving:
            return int(leaving.code or 0)

    return work
