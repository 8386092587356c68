"""A march in blocks of one or many steps: what runs and sweeps consume, however the steps are computed."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from gapbeam.solver.diagnostics.history_rows import Recorder, Rows
from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.march.compiled.eligibility import why_not_compiled
from gapbeam.solver.march.paused_march import Paused
from gapbeam.solver.march.python.march import March, march
from gapbeam.solver.system.accepted_step import Step
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import State

if TYPE_CHECKING:
    from mpi4py import MPI

LOG = logging.getLogger("gapbeam")


@dataclass(frozen=True)
class Wanted:
    """What a consumer asks of step blocks.

    Attributes:
        every: Steps between records; None: no records.
        stops: Steps after whose multiples a block ends; None: it does not matter.
        ends: Whether the last step is recorded whatever its number.
        also: Further steps after which a block ends.
    """

    every: int | None = 1
    stops: int | None = None
    ends: bool = False
    also: frozenset[int] = frozenset()

    def records(self, done: int, count: int) -> bool:
        """Return whether a record is due after so many steps of so many."""
        return self.every is not None and (done % self.every == 0 or (self.ends and done == count))


@dataclass(frozen=True)
class StepBlock:
    """Some whole steps.

    Attributes:
        done: Steps since the start.
        steps: Steps of this block.
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
        """The state from which the march continues after the block."""
        return Paused(self.end, self.done, self.since, self.modal)


def marched(
    plan: March, start: State | Paused, accounts: Accounts, recorder: Recorder, wanted: Wanted, comm: MPI.Comm
) -> Iterator[StepBlock]:
    """March a plan, compiled where that can be.

    Args:
        plan: The march.
        start: Its start, or where it was left.
        accounts: Brought up to date before each block is yielded.
        recorder: Makes the records.
        wanted: What is asked of the blocks.
        comm: The ranks that march.

    Raises:
        NotConverged: A step did not converge at the smallest size. What came before it was yielded.
        NotFinite: The energy is not a number; as above.
        EnergyCreated: More energy was created than the gates of `accounts` allow; as above.

    Collective.
    """
    if why_not_compiled(plan) is None:
        return _compiled(plan, start, accounts, recorder, wanted, comm)
    if plan.law.why_not_compiled is not None:
        LOG.info("marched step by step, not compiled: %s", plan.law.why_not_compiled)
    return step_blocks_of(march(plan, start), plan.steps, accounts, recorder, wanted, start)


def step_blocks_of(
    steps: Iterator[Step],
    count: int,
    accounts: Accounts,
    recorder: Recorder,
    wanted: Wanted,
    start: State | Paused | None = None,
) -> Iterator[StepBlock]:
    """Yield each whole step of given ones as a block; errors as in `marched`.

    Args:
        steps: The steps.
        count: How many whole ones there are, with those before `start`.
        accounts: As in `marched`, like the next two.
        recorder: Makes the records.
        wanted: What is asked of the blocks.
        start: Where a march was left that the steps continue.

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


def _whole(end: State, done: int, since: int, recorded: bool, accounts: Accounts, recorder: Recorder) -> StepBlock:
    rows = recorder.row(end, accounts) if recorded else None
    return StepBlock(done, 1, end.time, end.pressure, rows, lambda: end, since)


def _compiled(
    plan: March, start: State | Paused, accounts: Accounts, recorder: Recorder, wanted: Wanted, comm: MPI.Comm
) -> Iterator[StepBlock]:
    from gapbeam.solver.march.compiled.compiled_march import CompiledLoop
    from gapbeam.solver.march.compiled.record_instants import instants_of

    loop, count = CompiledLoop(plan), plan.steps
    agreed: Callable[[int], int] = comm.bcast if comm.size > 1 else int
    every = count if wanted.every is None else wanted.every
    for block in loop.blocks(start, every, accounts, stops=wanted.stops, agreed=agreed, also=wanted.also):
        done = block.first + block.steps
        due = len(block.times)
        if due and done == count and not wanted.records(done, count):
            due -= 1
        rows = recorder.rows(instants_of(block, due)) if due else None
        end = partial(getattr, block, "end")
        yield StepBlock(done, block.steps, block.end_time, block.motion.pressure, rows, end, modal=block.carried)
