"""Ending a run in order when the user, a scheduler or the clock asks for it."""

from __future__ import annotations

import signal
import threading
import time
from enum import IntEnum
from types import FrameType, TracebackType
from typing import Any

from mpi4py import MPI

from gapbeam.solver.errors import Interrupted

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGUSR1)  # Slurm and mpirun pass the last one on as a warning


def listened_to() -> tuple[signal.Signals, ...]:
    """Return the signals that end a run in order; that of a terminal that is closed unless nohup keeps it away."""
    return SIGNALS if signal.getsignal(signal.SIGHUP) == signal.SIG_IGN else (*SIGNALS, signal.SIGHUP)


class Wish(IntEnum):
    """What a rank wants at the end of a step; of several wishes the largest counts."""

    NONE = 0
    CHECKPOINT = 1
    WALL_TIME = 2
    INTERRUPT = 3
    TERMINATE = 4
    GIVE_UP = 5  # the disk is full, or the like

    @property
    def ends(self) -> bool:
        """Whether the run ends in order."""
        return Wish.CHECKPOINT < self < Wish.GIVE_UP

    @property
    def exit_status(self) -> int:
        """Exit status of the run that it ends: those of the shell and of the command timeout."""
        return {Wish.WALL_TIME: 124, Wish.TERMINATE: 143}.get(self, 130)

    @property
    def words(self) -> str:
        """What happened, in words."""
        return {Wish.WALL_TIME: "the wall-time limit was reached", Wish.TERMINATE: "terminated"}.get(
            self, "interrupted"
        )


class Interruption:
    """Turns signals and a limit of the wall time into a wish that all ranks act on in the same step.

    SIGINT, SIGTERM, SIGUSR1, and SIGHUP where it is not ignored.

    A second signal acts at once, as without this class. Outside the main thread nothing is caught.

    Args:
        comm: The ranks that agree.
        deadline: Reading of `time.perf_counter` on rank 0 after which to stop, s; None: none.
    """

    def __init__(self, comm: MPI.Comm, deadline: float | None = None) -> None:
        self._comm, self._deadline = comm, deadline
        self._heard = Wish.NONE
        self._before: dict[int, Any] = {}

    def __enter__(self) -> Interruption:
        """Start to listen."""
        if threading.current_thread() is threading.main_thread():
            self._before = {number: signal.signal(number, self._hear) for number in listened_to()}
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Leave the signals as they were."""
        self._restore()

    @property
    def asked(self) -> bool:
        """Whether any rank was asked to stop. Collective."""
        return self.agreed() != Wish.NONE

    def agreed(self, own: Wish = Wish.NONE) -> Wish:
        """Return the largest wish of all ranks, that of this rank and what it heard among them. Collective."""
        if self._heard == Wish.NONE and self._deadline is not None and self._comm.rank == 0:
            self._heard = Wish.WALL_TIME if time.perf_counter() >= self._deadline else Wish.NONE
        mine = max(own, self._heard)
        return mine if self._comm.size == 1 else Wish(self._comm.allreduce(int(mine), op=MPI.MAX))

    def _hear(self, number: int, _frame: FrameType | None) -> None:
        self._heard = Wish.INTERRUPT if number == signal.SIGINT else Wish.TERMINATE
        self._restore()

    def _restore(self) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)
        self._before = {}


class SetUp:
    """Turns the same signals and limit into an error at once, as long as a run has nothing to keep.

    A call into a library ends first. Outside the main thread the limit is looked at by `check` alone.

    Args:
        limit: Wall time of the whole run, s; None: none.

    Attributes:
        started: When the run started, by `time.perf_counter`, s.
        deadline: When to stop; None: never.
        heard: What came: an error that is raised in the middle of a library may get lost there.
    """

    def __init__(self, limit: float | None) -> None:
        self.started = time.perf_counter()
        self.deadline = None if limit is None else self.started + limit
        self.heard = Wish.NONE
        self._before: dict[int, Any] = {}

    def __enter__(self) -> SetUp:
        """Start to listen."""
        if threading.current_thread() is threading.main_thread():
            timed = () if self.deadline is None else (signal.SIGALRM,)
            self._before = {number: signal.signal(number, self._hear) for number in (*listened_to(), *timed)}
            if self.deadline is not None:
                signal.setitimer(signal.ITIMER_REAL, max(self.deadline - time.perf_counter(), 1.0e-3))
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Leave the signals as they were."""
        self.over()

    def over(self) -> None:
        """Leave the signals as they were: there is something to keep from here on."""
        if signal.SIGALRM in self._before:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
        for number, handler in self._before.items():
            signal.signal(number, handler)
        self._before = {}

    def check(self) -> None:
        """Raise what was heard, or that time is over.

        Raises:
            Interrupted: A signal came, or the limit was reached.
        """
        if self.heard == Wish.NONE and self.deadline is not None and time.perf_counter() >= self.deadline:
            self.heard = Wish.WALL_TIME
        if self.heard != Wish.NONE:
            raise Interrupted(f"{self.heard.words} before the march began", self.heard.exit_status)

    def _hear(self, number: int, _frame: FrameType | None) -> None:
        self.heard = {signal.SIGINT: Wish.INTERRUPT, signal.SIGALRM: Wish.WALL_TIME}.get(
            signal.Signals(number), Wish.TERMINATE
        )
        self.over()
        self.check()
