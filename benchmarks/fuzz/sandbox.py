"""One attempt in a process of its own with bounded time and memory, and its result."""

from __future__ import annotations

import os
import resource
import signal
import sys
import time
import traceback
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, NoReturn

from gapbeam.process.terminal_text import harmless

Kind = Literal["done", "refused", "crash", "hang", "escape"]
LONGEST_MESSAGE = 50_000  # characters
REFUSED = 2
REPORTED = (0, 3, 4, 5, 6)  # a run that was done, and the ways in which it says that it cannot be trusted
ALLOWED = {"\n", "\t", "\r"}


@dataclass(frozen=True)
class Limits:
    """Limits on time, memory and file size of an attempt.

    Attributes:
        seconds: Of the wall clock.
        memory: Bytes of address space on top of what the process has when it starts.
        file: Bytes of the largest file that it may write.
    """

    seconds: float = 20.0
    memory: int = 2 * 2**30
    file: int = 200 * 2**20


@dataclass(frozen=True)
class Outcome:
    """Result of an attempt.

    Attributes:
        kind: done, refused with a message, crash, hang, or escape: control characters reached the terminal.
        status: Exit status; negative for a signal.
        seconds: It took.
        memory: Peak resident memory, bytes.
        printed: Its output.
    """

    kind: Kind
    status: int
    seconds: float
    memory: int
    printed: str

    @property
    def is_finding(self) -> bool:
        """True where the outcome is a defect: neither success nor a proper refusal."""
        return self.kind not in ("done", "refused")


def attempt(work: Callable[[], int], said: Path, limits: Limits = Limits()) -> Outcome:
    """Do some work in a forked process.

    Args:
        work: Returns an exit status; errors with an `exit_status` are reported as the command line reports them.
        said: File for what it says.
        limits: Of time, memory and files.

    Returns:
        The outcome.
    """
    started = time.perf_counter()
    sys.stdout.flush()
    sys.stderr.flush()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # threads of numerical libraries, which forks do not use
        child = os.fork()
    if child == 0:
        _do(work, said, limits)
    deadline, hung = started + limits.seconds, False
    while True:
        ended, code, used = os.wait4(child, os.WNOHANG)
        if ended:
            break
        if not hung and time.perf_counter() > deadline:
            hung = True
            os.killpg(child, signal.SIGKILL)
        time.sleep(0.002)
    seconds = time.perf_counter() - started
    status = os.waitstatus_to_exitcode(code)
    printed = said.read_text(encoding="utf-8", errors="replace")
    return Outcome(_kind(status, hung, printed), status, seconds, used.ru_maxrss * 1024, printed)


def _kind(status: int, hung: bool, printed: str) -> Kind:
    if hung:
        return "hang"
    if "Traceback (most recent call last)" in printed or status not in (REFUSED, *REPORTED):
        return "crash"
    if status == REFUSED and (not printed.strip() or len(printed) > LONGEST_MESSAGE):
        return "crash"
    if any(not letter.isprintable() and letter not in ALLOWED for letter in printed):
        return "escape"
    return "refused" if status == REFUSED else "done"


def _do(work: Callable[[], int], said: Path, limits: Limits) -> NoReturn:
    """Be the process of an attempt."""
    status = 1
    try:
        os.setsid()
        with said.open("wb") as file:
            os.dup2(file.fileno(), 1)
            os.dup2(file.fileno(), 2)
        sys.stdout = sys.stderr = os.fdopen(2, "w", encoding="utf-8", errors="backslashreplace", closefd=False)
        memory = _address_space() + limits.memory
        resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
        resource.setrlimit(resource.RLIMIT_FSIZE, (limits.file, limits.file))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        status = work()
    except BaseException as error:
        known = getattr(error, "exit_status", None)
        if known is None:
            traceback.print_exc()
        else:
            print(f"gapbeam: {harmless(error)}", file=sys.stderr)
            status = int(known)
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)


def _address_space() -> int:
    """Return the address space of this process, bytes."""
    pages = Path("/proc/self/statm").read_text(encoding="ascii").split()[0]
    return int(pages) * resource.getpagesize()
