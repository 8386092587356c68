"""Threads of the ranks of a machine, compared with its cores."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from gapbeam.meshes.rank_zero import of_machine

if TYPE_CHECKING:
    from mpi4py import MPI

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def is_count(text: str) -> bool:
    """Return whether a text is a number of threads; OpenMP also takes one for each level, separated by commas."""
    return all(part.strip().isascii() and part.strip().isdigit() and int(part) > 0 for part in text.split(","))


def threads_a_rank() -> int:
    """Return the number of threads of numerical libraries on this rank: OMP_NUM_THREADS, or else a core each."""
    words = os.environ.get(THREADS[0], "")
    return int(words.split(",")[0]) if is_count(words) else cores()


def cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def crowded(comm: MPI.Comm) -> str | None:
    """Return in words that threads are more than the cores of some machine; None: they are not. Collective."""
    machine = of_machine(comm)
    threads = machine.allreduce(threads_a_rank())
    mine = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else set(range(cores()))
    available = len(set().union(*machine.allgather(mine)))
    ranks = machine.size
    machine.Free()
    worst = max(comm.allgather((threads / available, threads, ranks, available)))
    if worst[0] <= 1.0 or worst[1] == worst[2] == 1:
        return None
    return (
        f"{worst[2]} ranks with {worst[1]} threads together share {worst[3]} cores of a machine: they wait for one "
        "another; take one thread a rank (OMP_NUM_THREADS=1) and no more ranks than cores "
        "(docs/how-to/run-on-a-cluster.md)"
    )
