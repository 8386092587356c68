"""Memory that a finite element model needs, from the number of its DOFs, and free memory.

    factor: 11.5 GB (n / 1e6)^1.1 in 3D, 0.05 kB n log2(n) in 2D; mesh and matrices: 8 kB n in 3D, 3 kB n in 2D;
    what iterations need beside them, a preconditioner instead of the factor: 6 kB n in 3D, 2 kB n in 2D

Fitted to what MUMPS and whole runs took for beams of 28 000 to 1 000 000 DOFs with cells of degree 2
(docs/benchmarks/large-models.md).
Stout bodies need more of a factor than slender ones.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, log2
from pathlib import Path
from typing import TYPE_CHECKING

from gapbeam.meshes.rank_zero import of_machine

if TYPE_CHECKING:
    from mpi4py import MPI

FACTOR_OF_MILLION, GROWTH = 11.5e9, 1.1
FACTOR_2D = 50.0
MATRICES = {2: 3.0e3, 3: 8.0e3}
COPIES, SHAPES = 5, 1000  # of the shapes of beam elements that are held at once, and how many there are at most
PRECONDITIONER = {2: 2.0e3, 3: 6.0e3}


@dataclass(frozen=True)
class MemoryNeeds:
    """Memory that a model needs over all ranks, bytes.

    Attributes:
        matrices: Mesh, M, K and an effective operator.
        factor: The Cholesky factor of an effective operator.
        preconditioner: Preconditioner of conjugate gradients instead.
    """

    matrices: float
    factor: float
    preconditioner: float


def memory_needs(dofs: float, dimension: int) -> MemoryNeeds:
    """Return the memory that a model of so many DOFs needs, 2D or 3D."""
    factor = FACTOR_OF_MILLION * (dofs / 1.0e6) ** GROWTH if dimension == 3 else FACTOR_2D * dofs * log2(dofs + 1.0)
    return MemoryNeeds(MATRICES[dimension] * dofs, factor, PRECONDITIONER[dimension] * dofs)


MEMINFO = Path("/proc/meminfo")
GROUP_OF_PROCESS = Path("/proc/self/cgroup")
GROUPS = Path("/sys/fs/cgroup")
UNLIMITED = 1 << 60  # control groups of version 1 write a number beyond this for no limit


def free_memory(comm: MPI.Comm) -> float:
    """Return the memory that is free over all machines of a communicator, bytes. Collective."""
    machine = of_machine(comm)
    mine = free_here() if machine.rank == 0 else 0.0
    machine.Free()
    return float(sum(comm.allgather(mine)))


def free_here() -> float:
    """Return the memory that is free on this machine, within the limits of control groups, bytes; infinite: unknown."""
    try:
        lines = dict(line.split(":", 1) for line in MEMINFO.read_text().splitlines())
    except OSError:
        return inf
    free = 1024.0 * float(lines["MemAvailable"].split()[0])
    return min([free, *(limit - used for limit, used in _limits())])


def _limits() -> list[tuple[float, float]]:
    """Return the limit and the use of each control group around this process, less memory that can be freed."""
    found = []
    try:
        entries = [line.split(":", 2) for line in GROUP_OF_PROCESS.read_text().splitlines()]
    except OSError:
        return []
    for _, controllers, path in entries:
        if controllers == "":
            root, names = GROUPS, ("memory.max", "memory.current", "inactive_file")
        elif "memory" in controllers.split(","):
            root, names = GROUPS / "memory", ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file")
        else:
            continue
        inner = root / path.lstrip("/")
        for group in (inner, *inner.parents):
            if not group.is_relative_to(root):
                break
            limit = _limit(group, *names)
            if limit is not None:
                found.append(limit)
    return found


def _limit(group: Path, limit_name: str, used_name: str, cache_name: str) -> tuple[float, float] | None:
    try:
        limit, used = (group / limit_name).read_text().strip(), float((group / used_name).read_text())
        statistics = dict(line.split(" ", 1) for line in (group / "memory.stat").read_text().splitlines())
        cache = float(statistics.get(cache_name, 0.0))
    except (OSError, ValueError):
        return None
    if limit == "max" or float(limit) >= UNLIMITED:
        return None
    return float(limit), max(used - cache, 0.0)
