"""Some whole steps of a march, and how those that come one by one are gathered."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

from gapbeam.solver.diagnostics.history_rows import Recorder, Rows
from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.diagnostics.output_instants import Instants, instant_of, joined
from gapbeam.solver.march.paused_march import Paused
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import State
from gapbeam.solver.system.snapshots import Snapshots

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
        """Those that fell due, None: none did."""
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
        accounts: What is kept of every step.
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
        """Return how many steps the next block may have.

        Args:
            seconds: Wall time of a step with its output, s.
        """
        within = min(MOST_STEPS, MOST_UNKNOWNS // max(1, self._end.u.shape[1]))
        return max(1, min(within, int(CADENCE / max(seconds, 1.0e-9))))
