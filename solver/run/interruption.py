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


class Signals:
    """Hears the signals that end a run, and its limit of the wall time, from the set-up to the summary.

    SIGINT, SIGTERM, SIGUSR1, and SIGHUP where it is not ignored. As long as a run has nothing to keep they turn into an
    error at once, though a call into a library ends first. Once the march begins they are noted, and the march ends in
    order. A second signal acts at once, as without this class. Outside the main thread nothing is caught, and the
    limit is looked at by `check` alone.

    Args:
        limit: Wall time of the whole run, s; None: none.

    Attributes:
        started: When the run started, by `time.perf_counter`, s.
        deadline: When to stop; None: never.
        heard: What came: an error that is raised in the middle of a library may get lost there.
        marching: Whether there is something to keep.
    """

    def __init__(self, limit: float | None) -> None:
        self.started = time.perf_counter()
        self.deadline = None if limit is None else self.started + limit
        self.heard = Wish.NONE
        self.marching = False
        self._before: dict[int, Any] = {}

    def __enter__(self) -> Signals:
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
        """Leave the signals as they were."""
        self._stop_timer()
        for number, handler in self._before.items():
            signal.signal(number, handler)
        self._before = {}

    def march_begins(self) -> None:
        """Note what comes from here on: there is something to keep, and every step asks.

        Raises:
            Interrupted: A signal came before, or the limit was reached.
        """
        self._stop_timer()
        self.check()
        self.marching = True

    def check(self) -> None:
        """Raise what was heard before the march, or that time is over.

        Raises:
            Interrupted: A signal came, or the limit was reached.
        """
        if self.heard == Wish.NONE and self.deadline is not None and time.perf_counter() >= self.deadline:
            self.heard = Wish.WALL_TIME
        if self.heard != Wish.NONE:
            raise Interrupted(f"{self.heard.words} before the march began", self.heard.exit_status)

    def _stop_timer(self) -> None:
        if signal.SIGALRM in self._before:
            signal.setitimer(signal.ITIMER_REAL, 0.0)

    def _hear(self, number: int, _frame: FrameType | None) -> None:
        self.heard = {signal.SIGINT: Wish.INTERRUPT, signal.SIGALRM: Wish.WALL_TIME}.get(
            signal.Signals(number), Wish.TERMINATE
        )
        self.over()
        if not self.marching:
            self.check()


class Interruption:
    """A wish to end the run, or to keep its state, that all ranks act on in the same step.

    Args:
        comm: The ranks that agree.
        signals: What this rank hears, and the deadline on rank 0.
    """

    def __init__(self, comm: MPI.Comm, signals: Signals) -> None:
        self._comm, self._signals = comm, signals

    @property
    def asked(self) -> bool:
        """Whether any rank was asked to stop. Collective."""
        return self.agreed() != Wish.NONE

    def agreed(self, own: Wish = Wish.NONE) -> Wish:
        """Return the largest wish of all ranks, that of this rank and what it heard among them. Collective."""
        signals = self._signals
        if signals.heard == Wish.NONE and signals.deadline is not None and self._comm.rank == 0:
            signals.heard = Wish.WALL_TIME if time.perf_counter() >= signals.deadline else Wish.NONE
        mine = max(own, signals.heard)
        return mine if self._comm.size == 1 else Wish(self._comm.allreduce(int(mine), op=MPI.MAX))
