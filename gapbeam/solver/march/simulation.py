"""Simulation of a case, from the model to its motion in blocks of one or many steps.

    case -> model -> scheme -> plan -> seat -> start -> steps

Runs, studies, predictions, benchmarks and Python sessions all go this way; they differ in what they do with the steps.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np

from gapbeam.solver.diagnostics.history_rows import Instants, Recorder, Rows, instant_of, joined
from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.integrators.time_scheme import TimeScheme
from gapbeam.solver.march.compiled.compiled_march import why_not_compiled
from gapbeam.solver.march.stepwise_march import EffectiveOperators, March, Paused, Resolution, march
from gapbeam.solver.messages.errors import NotConverged, RunError
from gapbeam.solver.models.reduction.contact_lines import refuse_other_faces
from gapbeam.solver.seat.escape import RigidMotions
from gapbeam.solver.seat.start import start_of_case
from gapbeam.solver.seat.static_seat import Seat, find_seat
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import VALUE, Snapshots, State, Step

if TYPE_CHECKING:
    from mpi4py import MPI

    from gapbeam.solver.case.case import Case
    from gapbeam.solver.march.compiled.compiled_march import CompiledBlock
    from gapbeam.solver.models.model import Model


def march_of_model(model: Model, scheme: TimeScheme) -> March:
    """Return the march of a model: system, law, scheme, steps and their limits."""
    settings, gates = model.case.time, model.case.gates
    limits = () if scheme.conserves_energy else (gates.impact_growth, gates.impact_loss)
    resolution = Resolution(model.contact_duration, *limits)
    return March(
        model.system,
        model.law,
        scheme,
        EffectiveOperators(model.system, scheme),
        model.step,
        round(settings.end / model.step),
        settings.max_halvings,
        settings.max_iterations,
        resolution if settings.adaptive else None,
    )


class Simulation:
    """A model with its time scheme, ready for seat and march.

    Args:
        model: The model.
        scheme: Its time scheme; None: the scheme of the case.

    Attributes:
        model: The model.
        case: Its case, the time step a number.
        scheme: The time scheme.
        plan: Everything that a march needs but its start; operators are factored when they are first asked for.
    """

    def __init__(self, model: Model, scheme: TimeScheme | None = None) -> None:
        self.model, self.case = model, model.case
        self.scheme = model.scheme if scheme is None else scheme
        self.plan: March = march_of_model(model, self.scheme)

    @classmethod
    def of_case(cls, case: Case, comm: MPI.Comm) -> Simulation:
        """Mesh, assemble and reduce a case; errors as in `gapbeam.solver.models.model.build_model`. Collective."""
        from gapbeam.solver.models.model import build_model

        return cls(build_model(case, comm))

    @property
    def steps(self) -> int:
        """Whole steps up to the end of the case."""
        return self.plan.steps

    def factor(self) -> dict[str, float]:
        """Factor the operator of a whole step; return the wall time of each part, s. Collective."""
        return self.plan.operators.at(self.plan.dt).seconds

    def seat(self) -> Seat:
        """Find the contact equilibrium under the static loads.

        Raises:
            NotConverged: Nothing holds the beam against the static loads.
            UserError: The faces of a model with fewer contact points are not where those of its mesh are.

        Collective.
        """
        model = self.model
        contact = model.system.contact
        refuse_other_faces(self.case, contact, np.zeros(contact.interface.size), "undeformed")
        seat = find_seat(
            model.system,
            model.law,
            model.seat_springs,
            self.scheme.carries_acceleration,
            lambda: RigidMotions.of_body(model.body, model.system.operators.size),
        )
        values = contact.interface.trace(seat.state.u[VALUE], model.system.operators)
        refuse_other_faces(self.case, contact, values, "at the seat")
        return seat

    def seat_or_failure(self) -> Seat | NotConverged:
        """Return the seat, or why there is none where the case needs none; errors as in `seat` else. Collective."""
        try:
            return self.seat()
        except NotConverged as failure:
            if self.case.analysis.needs_seat:
                raise
            return failure

    def start(self, seat: Seat | NotConverged, left: State | None = None) -> State:
        """Return the state at t = 0 that the case asks for; arguments, errors as in `start_of_case`. Collective."""
        return start_of_case(self.case, self.model, seat.state if isinstance(seat, Seat) else None, left)

    def march(self, start: State | Seat | None = None, steps: int | None = None) -> Iterator[Step]:
        """Yield the accepted steps one by one; the loop may be left at any of them.

        The energy gates of the case are not judged: that is what a run does with the steps.

        Args:
            start: State to start from; None: as the case asks for, from a seat found now.
            steps: Number of whole steps; None: up to the end of the case.

        Raises:
            NotConverged: Nothing holds the beam, or a step did not converge at the smallest size.

        Collective.
        """
        if start is None or isinstance(start, Seat):
            start = self.start(self.seat_or_failure() if start is None else start)
        plan = self.plan if steps is None else replace(self.plan, steps=steps)
        return march(plan, start)

    def __repr__(self) -> str:
        model, contact = self.model, self.model.system.contact
        return (
            f"<Simulation: {self.case.title}: {model.dofs} DOFs ({self.case.model.type}), {contact.size} contact "
            f"points, {self.case.time.scheme.type}, {self.steps} steps of {self.plan.dt:.4g} s>"
        )


MOST_STEPS = 32  # of a block whose steps come one by one
MOST_UNKNOWNS = 200_000  # of all states that such a block keeps
CADENCE = 0.05  # s of wall time between blocks, where a step takes less


@dataclass(frozen=True)
class StepBlock:
    """Some whole steps.

    Attributes:
        done: Steps since the start.
        steps: Steps of this block.
        time: Its end, s.
        pressure: Contact pressure there, (m,), Pa.
        record: Makes the records that fell due.
        show: Makes the snapshots that fell due.
        state: Returns the state at the end.
        since: Steps, parts of halved ones included, since the images of that state were formed anew.
        modal: As in `Paused`.
    """

    done: int
    steps: int
    time: float
    pressure: Array
    record: Callable[[], Rows | None]
    show: Callable[[], Snapshots | None]
    state: Callable[[], State]
    since: int = 0
    modal: tuple[Array, ...] | None = None

    @cached_property
    def rows(self) -> Rows | None:
        """Records that fell due, None: none did; to be asked for block after block, for their maker has a memory."""
        return self.record()

    @cached_property
    def snapshots(self) -> Snapshots | None:
        """Snapshots that fell due; None: none did."""
        return self.show()

    @property
    def end(self) -> State:
        """The state at the end."""
        return self.state()

    @property
    def paused(self) -> Paused:
        """The state from which the march continues after the block."""
        return Paused(self.end, self.done, self.since, self.modal)


class OpenBlock:
    """A block to which whole steps are added one by one.

    Args:
        accounts: Accounts of every step.
        recorder: Makes the records.

    Attributes:
        steps: Steps so far.
    """

    def __init__(self, accounts: Accounts, recorder: Recorder) -> None:
        self._accounts, self._recorder = accounts, recorder
        self._instants: list[Instants] = []
        self._shown: list[State] = []
        self._end: State
        self._done = self._since = self.steps = 0

    def add(self, end: State, done: int, since: int, recorded: bool, shown: bool) -> None:
        """Add a step that the accounts have taken in.

        Args:
            end: Its end.
            done: Steps since the start.
            since: As in `StepBlock`.
            recorded: Whether a record is due.
            shown: Whether a snapshot is due.

        Collective.
        """
        self._end, self._done, self._since = end, done, since
        self.steps += 1
        if recorded:
            self._instants.append(instant_of(end, self._accounts))
        if shown:
            self._shown.append(end)

    def closed(self) -> StepBlock:
        """Return the block. Collective."""
        end = self._end
        rows = self._recorder.rows(joined(self._instants)) if self._instants else None
        shown = Snapshots.of_states(self._shown) if self._shown else None
        return StepBlock(
            self._done, self.steps, end.time, end.pressure, lambda: rows, lambda: shown, lambda: end, self._since
        )

    def most_steps(self, seconds: float) -> int:
        """Return the largest number of steps for the next block.

        Args:
            seconds: Wall time of a step with its output, s.
        """
        within = min(MOST_STEPS, MOST_UNKNOWNS // max(1, self._end.u.shape[1]))
        return max(1, min(within, int(CADENCE / max(seconds, 1.0e-9))))


@dataclass(frozen=True)
class Wanted:
    """Request of a consumer for step blocks.

    Attributes:
        every: Steps between records; None: no records.
        stops: Steps after whose multiples a block ends; None: it does not matter.
        ends: Whether the last step is recorded whatever its number.
        also: Further steps after which a block ends.
        snapshots: Steps between snapshots; the last step has one as well. None: there are none.
    """

    every: int | None = 1
    stops: int | None = None
    ends: bool = False
    also: frozenset[int] = frozenset()
    snapshots: int | None = None

    def records(self, done: int, count: int) -> bool:
        """Return whether a record is due after so many steps of so many."""
        return self.every is not None and (done % self.every == 0 or (self.ends and done == count))

    def shows(self, done: int, count: int) -> bool:
        """Return whether a snapshot is due after so many steps of so many."""
        return self.snapshots is not None and (done % self.snapshots == 0 or done == count)

    def ends_block(self, done: int, count: int) -> bool:
        """Return whether a block has to end after so many steps of so many."""
        return done == count or done in self.also or (self.stops is not None and done % self.stops == 0)


def marched(
    plan: March, start: State | Paused, accounts: Accounts, recorder: Recorder, wanted: Wanted, comm: MPI.Comm
) -> Iterator[StepBlock]:
    """March a plan, compiled where that can be.

    Args:
        plan: The march.
        start: Its start, or where it was left.
        accounts: Brought up to date before each block is yielded.
        recorder: Makes the records.
        wanted: Request for the blocks.
        comm: The ranks that march.

    Raises:
        NotConverged: A step did not converge at the smallest size. What came before it was yielded.
        NotFinite: The energy is not a number; as above.
        EnergyCreated: More energy was created than the gates of `accounts` allow; as above.

    Collective.
    """
    if why_not_compiled(plan) is None:
        return _compiled(plan, start, accounts, recorder, wanted, comm)
    return step_blocks_of(march(plan, start), plan.steps, accounts, recorder, wanted, start, agreement(comm))


def step_blocks_of(
    steps: Iterator[Step],
    count: int,
    accounts: Accounts,
    recorder: Recorder,
    wanted: Wanted,
    start: State | Paused | None = None,
    agreed: Callable[[int], int] = int,
) -> Iterator[StepBlock]:
    """Yield given steps in blocks, of one whole step each where steps are slow or large; errors as in `marched`.

    Args:
        steps: The steps.
        count: Number of whole ones, with those before `start`.
        accounts: As in `marched`, like the next two.
        recorder: Makes the records.
        wanted: Request for the blocks.
        start: State in which a march was left that the steps continue.
        agreed: Makes all ranks agree on the number of steps of a block.

    Collective.
    """
    done, since = (start.done, start.since) if isinstance(start, Paused) else (0, 0)
    block, most, begun = OpenBlock(accounts, recorder), 1, time.perf_counter()
    mark = begun
    try:
        for step in steps:
            accounts.take(step, time.perf_counter() - mark)
            since += 1
            if step.completes:
                done += 1
                since = 0 if step.refreshed is not None else since
                recorded, shown = wanted.records(done, count), wanted.shows(done, count)
                block.add(step.refreshed or step.new, done, since, recorded, shown)
                if block.steps >= most or wanted.ends_block(done, count):
                    yield block.closed()
                    now = time.perf_counter()
                    most = agreed(block.most_steps((now - begun) / block.steps))
                    block, begun = OpenBlock(accounts, recorder), now
            mark = time.perf_counter()
    except RunError:
        if block.steps:
            yield block.closed()
        raise


def _compiled(
    plan: March, start: State | Paused, accounts: Accounts, recorder: Recorder, wanted: Wanted, comm: MPI.Comm
) -> Iterator[StepBlock]:
    from gapbeam.solver.march.compiled.compiled_march import CompiledLoop

    loop, count = CompiledLoop(plan), plan.steps
    agreed, between = agreement(comm), wanted.snapshots or 0
    every = count if wanted.every is None else wanted.every
    blocks = loop.blocks(
        start, every, accounts, stops=wanted.stops, agreed=agreed, also=wanted.also, between_snapshots=between
    )
    for block in blocks:
        done = block.first + block.steps
        due = len(block.times)
        if due and done == count and not wanted.records(done, count):
            due -= 1
        record = partial(_rows_of, block, due, recorder)
        end, show = partial(getattr, block, "end"), partial(getattr, block, "snapshots")
        yield StepBlock(
            done, block.steps, block.end_time, block.motion.pressure, record, show, end, modal=block.carried
        )


def _rows_of(block: CompiledBlock, due: int, recorder: Recorder) -> Rows | None:
    """Return the first records of a block."""
    from gapbeam.solver.march.compiled.compiled_march import instants_of

    return recorder.rows(instants_of(block, due)) if due else None


def agreement(comm: MPI.Comm) -> Callable[[int], int]:
    """Return a function that gives all ranks the number of the first one."""
    return comm.bcast if comm.size > 1 else int
