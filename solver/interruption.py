"""Ending a run in order when the user or a scheduler asks for it."""

from __future__ import annotations

import signal
import threading
from types import FrameType, TracebackType
from typing import Any

from mpi4py import MPI

SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Interruption:
    """Turns SIGINT and SIGTERM into a flag that all ranks act on in the same step.

    A second signal acts at once, as without this class. Outside the main thread nothing is caught.

    Args:
        comm: The ranks that agree.
    """

    def __init__(self, comm: MPI.Comm) -> None:
        self._comm = comm
        self._asked = False
        self._before: dict[int, Any] = {}

    def __enter__(self) -> Interruption:
        """Start to listen."""
        if threading.current_thread() is threading.main_thread():
            self._before = {number: signal.signal(number, self._hear) for number in SIGNALS}
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Leave the signals as they were."""
        self._restore()

    @property
    def asked(self) -> bool:
        """Whether any rank was asked to stop. Collective."""
        if self._comm.size == 1:
            return self._asked
        return bool(self._comm.allreduce(self._asked, op=MPI.LOR))

    def _hear(self, _number: int, _frame: FrameType | None) -> None:
        self._asked = True
        self._restore()

    def _restore(self) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)
        self._before = {}
