"""The engine: computes the points of a study, in this process or in workers, and ends these however the study ends."""

from __future__ import annotations

import logging
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import FrameType, TracebackType
from typing import TYPE_CHECKING, Any

from gapbeam.solver.memory.memory_check import GIGABYTE
from gapbeam.solver.memory.memory_estimate import free_here
from gapbeam.solver.messages.errors import Interrupted
from gapbeam.solver.messages.wording import LOG
from gapbeam.studies.engine.workers import Result, Work, Workers

if TYPE_CHECKING:
    from gapbeam.studies.engine.dask_pool import DaskPool

TERMINATED = 143
MARGIN = 2.0  # of the memory that is predicted, within a factor of 2
LOOK = 1.0  # s


class Engine:
    """Engine that computes the points of one study, one batch after the other; a context.

    One worker is this process itself. More are started when the first batch comes, and end with the study: also where
    it is interrupted, terminated or killed.

    Args:
        workers: Workers that compute the points.
        points: Points of the largest batch, at most; no more workers than that are started.
        memory: Predicted memory of one worker, bytes; None: not known. A worker that takes `MARGIN` times as
            much is ended and counts as lost; this machine starts only as many workers as it has free memory for.
        folder: Folder of the study, which workers on other machines must see.

    Attributes:
        count: Workers; those of a scheduler that runs are counted when the first batch comes.
    """

    def __init__(
        self,
        workers: Workers | None = None,
        points: int = 1_000_000,
        memory: float | None = None,
        folder: Path | None = None,
    ) -> None:
        self._workers = Workers() if workers is None else workers
        self._memory, self._folder = memory, folder
        self._pool: DaskPool | None = None
        self._before: dict[int, Any] = {}
        self.count = self._counted(points)

    def __enter__(self) -> Engine:
        """Listen to signals that end the study."""
        if threading.current_thread() is threading.main_thread():
            wanted = [signal.SIGTERM]
            if signal.getsignal(signal.SIGHUP) == signal.SIG_DFL:
                wanted.append(signal.SIGHUP)
            self._before = {number: signal.signal(number, _hear) for number in wanted}
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the workers.

        Raises:
            Interrupted: The study was terminated.
        """
        try:
            if self._pool is not None:
                self._pool.close()
                self._pool = None
        finally:
            for number, action in self._before.items():
                signal.signal(number, action)
        if isinstance(error, _Terminated):
            raise Interrupted("terminated; what is done is on disk: call it again to go on", TERMINATED) from None

    def done(
        self,
        task: Callable[[Work], Result],
        works: Sequence[Work],
        tick: Callable[[], None] | None = None,
        lost: Callable[[Work, str], Result] | None = None,
    ) -> Iterator[tuple[int, Result]]:
        """Compute points, and yield the place of each with its result as they end.

        Args:
            task: A function of a module, which workers import.
            works: Its arguments; picklable.
            tick: Called about once a second while waiting, maybe from another thread.
            lost: Returns the result of a point that ended several workers, with what happened in words; None: that is
                an error.

        Raises:
            OutOfMemory: A point ended several workers, or all workers are gone.
        """
        if self.count == 1 and not self._workers.elsewhere:
            yield from _in_turn(task, works, tick)
            return
        if self._pool is None:
            from gapbeam.studies.engine.dask_pool import DaskPool, PoolPlan

            limit = None if self._memory is None else MARGIN * self._memory
            self._pool = DaskPool(PoolPlan(self._workers, self.count, limit, self._folder))
            self.count = max(self.count, self._pool.count)  # those of a scheduler that runs
        yield from self._pool.done(task, works, tick, lost)

    def _counted(self, points: int) -> int:
        """Return the number of workers to come; of a scheduler that runs, it is not known."""
        asked = self._workers
        if asked.scheduler is not None:
            return 1
        if asked.slurm is not None:
            return min(asked.count or asked.job.workers, max(points, 1))
        room = free_here() / self._memory if self._memory else float("inf")
        count, unlimited = asked.here(points, room), asked.here(points)
        if count < unlimited:
            LOG.warning(
                "%d workers instead of %d: each takes about %.2g GB, and %.2g GB are free",
                count, unlimited, (self._memory or 0.0) / GIGABYTE, free_here() / GIGABYTE,
            )  # fmt: skip
        return count


class _Terminated(BaseException):
    """Termination of a study; a base exception, so that no point takes it for its own error."""


def _hear(_number: int, _frame: FrameType | None) -> None:
    raise _Terminated


def _in_turn(
    task: Callable[[Work], Result], works: Sequence[Work], tick: Callable[[], None] | None
) -> Iterator[tuple[int, Result]]:
    """Compute points in this process, one after the other, without the remarks of each model."""
    log = logging.getLogger("gapbeam")
    for place, work in enumerate(works):
        level = log.level
        with _ticking(tick):
            log.setLevel(max(level, logging.ERROR))
            try:
                result = task(work)
            finally:
                log.setLevel(level)
        yield place, result


@contextmanager
def _ticking(tick: Callable[[], None] | None) -> Iterator[None]:
    """Call something once a second from another thread."""
    if tick is None:
        yield
        return
    over = threading.Event()

    def watch() -> None:
        while not over.wait(LOOK):
            tick()

    thread = threading.Thread(target=watch, daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()
