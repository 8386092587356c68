"""Many independent pieces of work, in several processes."""

from __future__ import annotations

import multiprocessing
import os
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from typing import TypeVar

from gapbeam.solver.run.rank_threads import THREADS

Work = TypeVar("Work")
Result = TypeVar("Result")


class SideBySide:
    """Processes that stay for one batch of work after the other; a context.

    They are spawned: a forked MPI process would share its parent's connections. Each computes with one thread, so that
    they do not take the cores from each other, and ends with this process, also where that is killed.

    Args:
        jobs: Processes; by default one a core.
    """

    def __init__(self, jobs: int | None = None) -> None:
        self.jobs = max(1, jobs or os.cpu_count() or 1)
        self._before = {name: os.environ.get(name) for name in THREADS}
        os.environ.update(dict.fromkeys(THREADS, "1"))
        self._pool = ProcessPoolExecutor(self.jobs, multiprocessing.get_context("spawn"), initializer=_end_with_parent)

    def __enter__(self) -> SideBySide:
        """Return the processes."""
        return self

    def __exit__(self, *error: object) -> None:
        """End them; what they have not begun is not done."""
        self._pool.shutdown(cancel_futures=True)
        for name, value in self._before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value

    def done(
        self, task: Callable[[Work], Result], works: Iterable[Work], tick: Callable[[], None] | None = None
    ) -> Iterator[tuple[int, Result]]:
        """Do pieces of work, and yield the place of each with its result as they end.

        Args:
            task: A function of a module, which the processes import.
            works: What it is called with; picklable.
            tick: Called about once a second while waiting.
        """
        waiting = {self._pool.submit(task, work): place for place, work in enumerate(works)}
        while waiting:
            done, _ = wait(waiting, timeout=1.0, return_when=FIRST_COMPLETED)
            for future in done:
                yield waiting.pop(future), future.result()
            if tick is not None:
                tick()


def side_by_side(
    task: Callable[[Work], Result],
    works: Sequence[Work],
    jobs: int | None = None,
    tick: Callable[[], None] | None = None,
) -> Iterator[tuple[int, Result]]:
    """Do one batch of work in processes of their own; arguments as in `SideBySide`."""
    with SideBySide(min(jobs or os.cpu_count() or 1, max(1, len(works)))) as processes:
        yield from processes.done(task, works, tick)


def _end_with_parent() -> None:
    """Let this process end when the one that spawned it is gone: it would wait for work for ever."""
    parent = multiprocessing.parent_process()

    def watch() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
