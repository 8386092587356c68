"""Communicator of one process without MPI."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

if TYPE_CHECKING:
    from mpi4py import MPI


class OneRank:
    """The ranks of a process that no launcher started: what gapbeam asks a communicator of mpi4py.

    Attributes:
        rank: 0.
        size: 1.
    """

    rank, size = 0, 1

    def Dup(self) -> OneRank:  # noqa: N802 - as mpi4py calls it
        """Return the communicator itself."""
        return self

    def Free(self) -> None:  # noqa: N802
        """Do nothing."""

    def allgather(self, value: Any) -> list[Any]:
        """Return the value of each rank."""
        return [value]

    gather = allgather

    def bcast(self, value: Any, root: int = 0) -> Any:  # noqa: ARG002
        """Return the value of rank 0."""
        return value

    def allreduce(self, value: Any, op: Any = None) -> Any:  # noqa: ARG002
        """Return the sum, or what else all ranks combine: of one, its value."""
        return value

    reduce = allreduce

    def Reduce(self, local: Any, total: Any) -> None:  # noqa: N802
        """Write the sum of arrays."""
        total[...] = local

    Allreduce = Reduce

    def Bcast(self, _array: Any) -> None:  # noqa: N802
        """Do nothing: the array is there."""


ONE_RANK = cast("MPI.Comm", OneRank())


def of_machine(comm: MPI.Comm) -> MPI.Comm:
    """Return the ranks on the machine of this one, to be freed. Collective."""
    if comm is ONE_RANK:
        return comm
    from mpi4py import MPI

    return comm.Split_type(MPI.COMM_TYPE_SHARED)


def with_mpi(comm: MPI.Comm) -> MPI.Comm:
    """Return the ranks as DOLFINx and PETSc need them."""
    if comm is not ONE_RANK:
        return comm
    from mpi4py import MPI

    return MPI.COMM_SELF
