"""The thread that makes and writes the output of a block of steps while the next block is computed."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from types import TracebackType

WAITING = 4  # blocks of steps whose output waits, at most: what keeps memory bounded


class OutputThread:
    """Does one thing after the other in a second thread; whoever needs what was written says `wait`.

    Args:
        beside: Whether there is a thread; if not, or if none can be started, work is done where it is asked for.
    """

    def __init__(self, beside: bool) -> None:
        self._pool = _new_pool() if beside else None
        self._asked: deque[Future[None]] = deque()

    def do(self, work: Callable[[], None]) -> None:
        """Have work done after what was asked for before.

        Raises:
            BaseException: What earlier work raised, though this work is done as well; without a thread what it raises.
        """
        if self._pool is None:
            work()
            return
        self._asked.append(self._pool.submit(work))
        while len(self._asked) > WAITING:
            self._asked.popleft().result()

    def wait(self) -> None:
        """Wait until all is done.

        Raises:
            BaseException: What it raised first.
        """
        while self._asked:
            self._asked.popleft().result()

    def __enter__(self) -> OutputThread:
        """Take work."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Wait until all is done, and end the thread; an error that is on its way already is not replaced.

        Raises:
            BaseException: What the work raised first.
        """
        try:
            if error is None:
                self.wait()
        finally:
            if self._pool is not None:
                self._pool.shutdown()


def _new_pool() -> ThreadPoolExecutor | None:
    """Return a pool of one thread that runs; None where the system starts no further thread."""
    pool = ThreadPoolExecutor(1, "output")
    try:
        pool.submit(int).result()
    except RuntimeError:  # limits on threads or on memory
        pool.shutdown(wait=False)
        return None
    return pool
