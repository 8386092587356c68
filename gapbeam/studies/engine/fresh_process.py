"""One piece of work in a process of its own, whose time and memory are those of the work alone."""

from __future__ import annotations

import multiprocessing
import os
import threading
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from typing import TypeVar

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
