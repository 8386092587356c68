"""Ending a run in order when the user, a scheduler or the clock asks for it."""

from __future__ import annotations

import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from enum import IntEnum
from types import FrameType, TracebackType
from typing import TYPE_CHECKING, Any

from gapbeam.solver.messages.errors import Interrupted

if TYPE_CHECKING:
    from mpi4py import MPI

PATIENCE = 2.0  # s that a step, or a library that has lost the error, may go on after a signal
MARCH = "gapbeam.solver.march.stepwise_march"  # its frames are those of a step

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGUSR1)  # Slurm and mpirun pass the last one on as a warning


def listened_to() -> tuple[signal.Signals, ...]:
    """Return the signals that end a run in order; that of a terminal that is closed unless nohup keeps it away."""
    return SIGNALS if signal.getsignal(signal.SIGHUP) == signal.SIG_IGN else (*SIGNALS, signal.SIGHUP)


@contextmanager
def left_to_rank_zero(rank: int) -> Iterator[None]:
    """Leave the signals that end a run to rank 0, while the other ranks wait for the outcome of its work.

    Args:
        rank: Rank of this process.
    """
    waits = rank != 0 and threading.current_thread() is threading.main_thread()
    before = {number: signal.signal(number, signal.SIG_IGN) for number in listened_to()} if waits else {}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


class Wish(IntEnum):
    """Request of a rank at the end of a step; of several requests the largest counts."""

    NONE = 0
    CHECKPOINT = 1
    WALL_TIME = 2
    INTERRUPT = 3
    TERMINATE = 4
    GIVE_UP = 5  # the disk is full, or the like

    @property
    def ends(self) -> bool:
        """True where the request ends the run in order."""
        return Wish.CHECKPOINT < self < Wish.GIVE_UP

    @property
    def exit_status(self) -> int:
        """Exit status of the run that it ends: those of the shell and of the command timeout."""
        return {Wish.WALL_TIME: 124, Wish.TERMINATE: 143}.get(self, 130)

    @property
    def words(self) -> str:
        """Reason for the end, in words."""
        return {Wish.WALL_TIME: "the wall-time limit was reached", Wish.TERMINATE: "terminated"}.get(
            self, "interrupted"
        )


class GivenUp(Interrupted):
    """A signal came, and the step that was under way did not end soon."""


class Signals:
    """Hears the signals that end a run, and its limit of the wall time, from the set-up to the summary.

    SIGINT, SIGTERM, SIGUSR1, and SIGHUP where it is not ignored. As long as a run has nothing to keep they turn into an
    error at once, though a call into a library ends first. Once the march begins they are noted, and the march ends in
    order. A second signal acts at once, as without this class. Outside the main thread nothing is caught, and the
    limit is looked at by `check` alone.

    An error that is raised in the middle of a library may get lost there, or come back as an error of the library. It
    is raised again every `PATIENCE` seconds, and `turned` makes an interruption of whatever comes back. A step of a
    march that goes on for so long is given up where one rank marches alone; the run ends at the step before.

    Args:
        limit: Wall time of the whole run, s; None: none.
        alone: Whether no other rank waits in the middle of a step.

    Attributes:
        started: Time at which the run started, by `time.perf_counter`, s.
        deadline: Time at which to stop; None: never.
        heard: The request that came.
        marching: Whether there is something to keep.
    """

    def __init__(self, limit: float | None, alone: bool = False) -> None:
        self.alone = alone
        self.started = time.perf_counter()
        self.deadline = None if limit is None else self.started + limit
        self.heard = Wish.NONE
        self.marching = False
        self._before: dict[int, Any] = {}
        self._insisting: Any = None
        self._lost = sys.unraisablehook

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
        sys.unraisablehook = self._lost

    def over(self) -> None:
        """Leave the signals as they were."""
        self._stop_timer()
        if self._insisting is not None:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            signal.signal(signal.SIGALRM, self._insisting)
            self._insisting = None
        for number, handler in self._before.items():
            signal.signal(number, handler)
        self._before = {}

    def march_begins(self) -> None:
        """Note that the march begins: there are results to keep, and every step asks.

        Raises:
            Interrupted: A signal came before, or the limit was reached.
        """
        self._stop_timer()
        self.check()
        self.marching = True

    def check(self) -> None:
        """Raise a signal that came before the march, or the end of the wall time.

        Raises:
            Interrupted: A signal came, or the limit was reached.
        """
        if self.look() != Wish.NONE:
            raise self._interrupted()

    def look(self) -> Wish:
        """Return the request that came, the end of the wall time among them."""
        if self.heard == Wish.NONE and self.deadline is not None and time.perf_counter() >= self.deadline:
            self.heard = Wish.WALL_TIME
        return self.heard

    @contextmanager
    def turned(self) -> Iterator[None]:
        """Turn an error of a library that hides one of `check` into that one.

        Raises:
            Interrupted: A signal came before the march, and anything but an interruption came out.
        """
        try:
            yield
        except Interrupted:
            raise
        except Exception as error:
            if self.heard == Wish.NONE or self.marching:
                raise
            raise self._interrupted() from error

    def _interrupted(self) -> Interrupted:
        return Interrupted(f"{self.heard.words} before the march began", self.heard.exit_status)

    def _stop_timer(self) -> None:
        if signal.SIGALRM in self._before:
            signal.setitimer(signal.ITIMER_REAL, 0.0)

    def _hear(self, number: int, _frame: FrameType | None) -> None:
        self.heard = {signal.SIGINT: Wish.INTERRUPT, signal.SIGALRM: Wish.WALL_TIME}.get(
            signal.Signals(number), Wish.TERMINATE
        )
        self.over()
        self._insisting = signal.signal(signal.SIGALRM, self._insist)
        signal.setitimer(signal.ITIMER_REAL, PATIENCE, PATIENCE)
        sys.unraisablehook = self._let_go
        if not self.marching:
            self.check()

    def _insist(self, _number: int, frame: FrameType | None) -> None:
        """Raise a lost signal again, or give up a long step."""
        if not self.marching:
            self.check()
        while frame is not None and self.alone:
            if frame.f_globals.get("__name__") == MARCH:
                raise GivenUp(f"{self.heard.words} within a step", self.heard.exit_status)
            frame = frame.f_back

    def _let_go(self, lost: Any) -> None:
        """Say nothing of an interruption that a library has dropped: it comes again."""
        if not isinstance(lost.exc_value, Interrupted):
            self._lost(lost)


class Interruption:
    """A wish to end the run, or to keep its state, that all ranks act on in the same step.

    Args:
        comm: The ranks that agree.
        signals: Requests to this rank, and the deadline on rank 0.
    """

    def __init__(self, comm: MPI.Comm, signals: Signals) -> None:
        self._comm, self._signals = comm, signals

    @property
    def heard(self) -> bool:
        """True where this rank was asked to stop; not collective."""
        return self._signals.heard != Wish.NONE

    @property
    def asked(self) -> bool:
        """True where any rank was asked to stop. Collective."""
        return self.agreed() != Wish.NONE

    def agreed(self, own: Wish = Wish.NONE) -> Wish:
        """Return the strongest request of all ranks, signals of this rank included. Collective."""
        signals = self._signals
        mine = max(own, signals.look() if self._comm.rank == 0 else signals.heard)
        if self._comm.size == 1:
            return mine
        return Wish(max(self._comm.allgather(int(mine))))
