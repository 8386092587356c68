"""Work that only rank 0 does, and that all ranks learn the outcome of."""

from __future__ import annotations

import pickle
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeVar, cast

if TYPE_CHECKING:
    from mpi4py import MPI

Result = TypeVar("Result")

PATIENCE = 5.0  # s in which all ranks must have come to the same end


def on_rank_zero(comm: MPI.Comm, work: Callable[[], Result]) -> Result:
    """Do the work on rank 0; return its result, or raise its error, on all ranks.

    Args:
        comm: Communicator of the ranks that take part.
        work: Called on rank 0 only; it must not communicate. Its result is sent with pickle.

    Returns:
        Result of `work`, on all ranks.

    Raises:
        BaseException: any error that `work` raises, on all ranks. An error that pickle cannot carry arrives on the
            other ranks as a RuntimeError with the same message.

    Collective.
    """
    if comm.size == 1:
        return work()
    if comm.rank != 0:
        message = pickle.loads(comm.bcast(None))
        if message[0]:
            result: Result = message[1]
            return result
        raise message[1]
    try:
        done = work()
        message = pickle.dumps((True, done))
    except BaseException as error:
        comm.bcast(_failure(error))
        raise
    comm.bcast(message)
    return done


def all_there(comm: MPI.Comm) -> bool:
    """Return whether all ranks come here within `PATIENCE`, without waiting for those that do not.

    Args:
        comm: Communicator of the ranks, a duplicate that is used for nothing else.

    Collective, or else False.
    """
    arrival, until = comm.Ibarrier(), time.monotonic() + PATIENCE
    while not arrival.Test():
        if time.monotonic() > until:
            return False
        time.sleep(0.01)
    return True


def _failure(error: BaseException) -> bytes:
    try:
        message = pickle.dumps((False, error))
        pickle.loads(message)
    except Exception:
        message = pickle.dumps((False, RuntimeError(f"{type(error).__name__}: {error}")))
    return message


class OneRank:
    """Stand-in for a communicator of mpi4py in a process without a launcher: one rank.

    Attributes:
        rank: 0.
        size: 1.
    """

    rank, size = 0, 1

    def __reduce__(self) -> str:
        return "ONE_RANK"

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
        """Return the value of the only rank."""
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
