"""The thread that makes and writes the output of a block of steps while the next block is computed."""

from __future__ import annotations

import queue
import threading
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from types import TracebackType

from gapbeam.solver.messages.errors import NotWritten
from gapbeam.solver.messages.wording import LOG

WAITING = 4  # blocks of steps whose output waits, at most: what keeps memory bounded
LOOK = 0.1  # s of wall time between looks at whether the run is to end
SILENT = 60.0  # s of wall time of one piece of work, after which the waiting is reported
PATIENCE = 10.0  # s of wall time that one piece of work may still take once the run is to end


class StuckOutput(NotWritten):
    """The thread of the output writes without end, and keeps its files and the lock of HDF5."""


class OutputThread:
    """Second thread that writes one thing after the other; readers of its files call `wait` first.

    A disk that neither writes nor fails (a file server that is gone) keeps the thread forever. Waiting for it is
    reported, and ends once the run is asked to end; the thread does not keep the process.

    Args:
        beside: Whether there is a thread; if not, or if none can be started, work is done where it is asked for.
        ending: Whether the run was asked to end.
    """

    def __init__(self, beside: bool, ending: Callable[[], bool] = bool) -> None:
        self._work: queue.SimpleQueue[tuple[Future[None], Callable[[], None]] | None] = queue.SimpleQueue()
        self._asked: deque[Future[None]] = deque()
        self._ending, self._stuck = ending, False
        self._reported: Future[None] | None = None
        self._thread: threading.Thread | None = threading.Thread(target=self._run, name="output", daemon=True)
        try:
            if beside:
                self._thread.start()
        except RuntimeError:  # limits on threads or on memory
            beside = False
        if not beside:
            self._thread = None

    def do(self, work: Callable[[], None]) -> None:
        """Have work done after all earlier work.

        Raises:
            BaseException: An error of earlier work, though this work is done as well; without a thread an error of this
                work.
            StuckOutput: Earlier work does not end.
        """
        if self._thread is None:
            work()
            return
        asked: Future[None] = Future()
        self._asked.append(asked)
        self._work.put((asked, work))
        while len(self._asked) > WAITING:
            self._hear_first()

    def wait(self) -> None:
        """Wait until all is done.

        Raises:
            BaseException: The first error of the work.
            StuckOutput: The work does not end.
        """
        while self._asked:
            self._hear_first()

    def __enter__(self) -> OutputThread:
        """Take work."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Wait until all is done, and end the thread; an error that is on its way already is not replaced.

        Raises:
            BaseException: The first error of the work.
            StuckOutput: The work does not end.
        """
        try:
            if error is None:
                self.wait()
        finally:
            self._work.put(None)
            while self._asked and not self._stuck:
                self._settle(self._asked.popleft())

    def _hear_first(self) -> None:
        """Wait for the first requested work, and raise its error."""
        if self._stuck:
            raise _does_not_end()
        first = self._asked.popleft()
        self._settle(first)
        if self._stuck:
            raise _does_not_end()
        first.result()

    def _settle(self, work: Future[None]) -> None:
        """Wait until work is done, or until the run is to end and the work does not."""
        begun, asked = time.monotonic(), None
        while not work.done():
            try:
                work.exception(LOOK)
            except TimeoutError:
                now = time.monotonic()
                if now - begun > SILENT and self._reported is None:
                    self._reported = work
                    LOG.warning(
                        "results have been waiting for the disk for %.0f s; the march goes on when they are written. A "
                        "signal (Ctrl-C, kill) ends the run at its last checkpoint",
                        now - begun,
                    )
                if self._ending():
                    asked = now if asked is None else asked
                    if now - asked > PATIENCE:
                        self._stuck = True
                        return

    def _run(self) -> None:
        while (taken := self._work.get()) is not None:
            asked, work = taken
            try:
                work()
            except BaseException as error:
                asked.set_exception(error)
            else:
                asked.set_result(None)


def _does_not_end() -> StuckOutput:
    return StuckOutput(
        f"the disk has taken nothing for {PATIENCE:.0f} s after the run was asked to end: it stops here. Look at the "
        "file server or the disk; `resume=True` continues from the last checkpoint"
    )
