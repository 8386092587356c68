"""Free memory of the machine, or of the control group that holds the job."""

from __future__ import annotations

from math import inf
from pathlib import Path

from mpi4py import MPI

MEMINFO = Path("/proc/meminfo")
GROUP_OF_PROCESS = Path("/proc/self/cgroup")
GROUPS = Path("/sys/fs/cgroup")
UNLIMITED = 1 << 60  # control groups of version 1 write a number beyond this for no limit


def free_memory(comm: MPI.Comm) -> float:
    """Return the memory that is free over all machines of a communicator, bytes. Collective."""
    machine = comm.Split_type(MPI.COMM_TYPE_SHARED)
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
    """Return the limit and the use of each control group around this process, without what can be given back."""
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
