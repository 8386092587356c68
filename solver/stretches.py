"""A march in stretches of one or many steps: what runs and sweeps consume, however the steps are computed."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

from mpi4py import MPI

from solver.accounts import Accounts
from solver.analyses.paused import Paused
from solver.analyses.transient import March, march
from solver.compiled.reasons import why_not_compiled
from solver.operators import Array
from solver.output.rows import Recorder, Rows
from solver.system import State, Step


@dataclass(frozen=True)
class Wanted:
    """What a consumer asks of stretches.

    Attributes:
        every: Steps between records; None: no records.
        stops: Steps after whose multiples a stretch ends; None: it does not matter.
        ends: Whether the last step is recorded whatever its number.
    """

    every: int | None = 1
    stops: int | None = None
    ends: bool = False

    def records(self, done: int, count: int) -> bool:
        """Return whether a record is due after so many steps of so many."""
        return self.every is not None and (done % self.every == 0 or (self.ends and done == count))


@dataclass(frozen=True)
class Stretch:
    """Some whole steps.

    Attributes:
        done: Steps since the start.
        steps: Steps of this stretch.
        time: Its end, s.
        pressure: Contact pressure there, (m,), Pa.
        rows: Records that fell due, None: none did.
        state: Returns the state at the end.
        since: Steps, parts of halved ones included, since the images of that state were formed anew.
        modal: As in `Paused`.
    """

    done: int
    steps: int
    time: float
    pressure: Array
    rows: Rows | None
    state: Callable[[], State]
    since: int = 0
    modal: tuple[Array, ...] | None = None

    @property
    def end(self) -> State:
        """The state at the end."""
        return self.state()

    @property
    def paused(self) -> Paused:
        """What the march goes on from at the end."""
        return Paused(self.end, self.done, self.since, self.modal)


def marched(
    plan: March, start: State | Paused, accounts: Accounts, recorder: Recorder, wanted: Wanted, comm: MPI.Comm
) -> Iterator[Stretch]:
    """March a plan, compiled where that can be.

    Args:
        plan: The march.
        start: Its start, or where it was left.
        accounts: Brought up to date before each stretch is yielded.
        recorder: Makes the records.
        wanted: What is asked of the stretches.
        comm: The ranks that march.

    Raises:
        NotConverged: A step did not converge at the smallest size. What came before it was yielded.
        NotFinite: The energy is not a number; as above.
        EnergyCreated: More energy was created than the gates of `accounts` allow; as above.

    Collective.
    """
    if why_not_compiled(plan) is None:
        return _compiled(plan, start, accounts, recorder, wanted, comm)
    return stretches_of(march(plan, start), plan.steps, accounts, recorder, wanted, start)


def stretches_of(
    steps: Iterator[Step],
    count: int,
    accounts: Accounts,
    recorder: Recorder,
    wanted: Wanted,
    start: State | Paused | None = None,
) -> Iterator[Stretch]:
    """Yield each whole step of given ones as a stretch; errors as in `marched`.

    Args:
        steps: The steps.
        count: How many whole ones there are, with those before `start`.
        accounts: As in `marched`, like the next two.
        recorder: Makes the records.
        wanted: What is asked of the stretches.
        start: Where a march was left that the steps go on from.

    Collective.
    """
    done, since = (start.done, start.since) if isinstance(start, Paused) else (0, 0)
    mark = time.perf_counter()
    for step in steps:
        accounts.take(step, time.perf_counter() - mark)
        since += 1
        if step.completes:
            done += 1
            since = 0 if step.refreshed is not None else since
            yield _whole(step.refreshed or step.new, done, since, wanted.records(done, count), accounts, recorder)
        mark = time.perf_counter()


def _whole(end: State, done: int, since: int, recorded: bool, accounts: Accounts, recorder: Recorder) -> Stretch:
    rows = recorder.row(end, accounts) if recorded else None
    return Stretch(done, 1, end.time, end.pressure, rows, lambda: end, since)


def _compiled(
    plan: March, start: State | Paused, accounts: Accounts, recorder: Recorder, wanted: Wanted, comm: MPI.Comm
) -> Iterator[Stretch]:
    from solver.compiled.instants import instants_of
    from solver.compiled.loop import CompiledLoop

    loop, count = CompiledLoop(plan), plan.steps
    agreed: Callable[[int], int] = comm.bcast if comm.size > 1 else int
    every = count if wanted.every is None else wanted.every
    for block in loop.blocks(start, every, accounts, stops=wanted.stops, agreed=agreed):
        done = block.first + block.steps
        due = len(block.times)
        if due and done == count and not wanted.records(done, count):
            due -= 1
        rows = recorder.rows(instants_of(block, due)) if due else None
        end = partial(getattr, block, "end")
        yield Stretch(done, block.steps, block.end_time, block.motion.pressure, rows, end, modal=block.carried)
