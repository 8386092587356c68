"""The impacts of a face: time, approach speed, impulse and duration of each, in bounded memory.

Where there is no room for another impact, every second one goes, and from then on every second one is kept: what is
kept stays spread evenly over all impacts, so that its distribution is theirs. Which ones are kept follows from their
order alone. The parting before each impact, from the end of the impact before, is kept with it.

An impact lasts from the step in which the face closes to the step in which it opens. Within a step the gap is taken as
linear in time, so that instants and durations have an error of second order. The approach speed is the rate at which
the smallest gap of the face closes over the step in which it does: contact takes part of it within that step,
(w h)^2 / 24 of it on average, with w = pi / duration: 0.2 % where a contact has 16 steps, 2.6 % where it has 4.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from gapbeam.solver.jit import shared
from gapbeam.solver.record_table import IMPACT_COLUMNS
from gapbeam.solver.system.slip_modes import closed_part

Array = np.ndarray

MOST = 4096  # impacts that are kept of a face
COLUMNS = tuple(IMPACT_COLUMNS)[:-1]  # how many one stands for is counted at the end
TIME, DURATION = COLUMNS.index("time"), COLUMNS.index("duration")


class ImpactList:
    """Impacts in the order in which they ended.

    Attributes:
        count: Their number.
        every: Every so many of them is kept: 1, 2, 4, ...
    """

    def __init__(self) -> None:
        self.count, self.every = 0, 1
        self._kept: Array = np.zeros((0, len(COLUMNS) + 1))  # the impacts, and the parting before each
        self._new: list[Array] = []
        self._room = MOST
        self._end = -np.inf

    @property
    def rows(self) -> Array:
        """The impacts that are kept: closing time, s, approach speed, m/s, impulse, N s, duration, s; (k, 4)."""
        return self._all()[:, :-1]

    @property
    def partings(self) -> Array:
        """Time that the face was open before each stored impact, (k,), s; infinite before the first."""
        return self._all()[:, -1]

    def add(self, rows: Array) -> None:
        """Take in impacts, (n, 4), in the order in which they ended."""
        if not len(rows):
            return
        ends = rows[:, TIME] + rows[:, DURATION]
        partings = rows[:, TIME] - np.append(self._end, ends[:-1])
        taken = np.arange(self.count, self.count + len(rows)) % self.every == 0
        self.count, self._end = self.count + len(rows), float(ends[-1])
        self._new.append(np.column_stack([rows, partings])[taken])
        self._room -= len(self._new[-1])
        while self._room < 0:
            self.every *= 2
            self._kept = self._all()[::2]
            self._room = MOST - len(self._kept)

    def _all(self) -> Array:
        if self._new:
            self._kept = np.concatenate([self._kept, *self._new])
            self._new.clear()
        return self._kept

    def as_json(self) -> dict[str, Any]:
        """Return everything that is kept, for JSON; what is infinite, before the first impact, is null."""
        rows = [[x if np.isfinite(x) else None for x in row] for row in self._all().tolist()]
        return {"count": self.count, "every": self.every, "rows": rows, "end": self._end if self.count else None}

    def restore(self, data: Mapping[str, Any]) -> None:
        """Bring a list, as it is at a start, to what was stored.

        Raises:
            KeyError: Something is missing; likewise ValueError and TypeError where it is not of the right form.
        """
        rows = np.array([[*row[:-1], np.inf if row[-1] is None else row[-1]] for row in data["rows"]], dtype=float)
        rows = rows.reshape(-1, len(COLUMNS) + 1)
        count, every = int(data["count"]), int(data["every"])
        end = -np.inf if data["end"] is None else float(data["end"])
        whole = np.all(np.isfinite(rows[:, :-1])) and not np.any(np.isnan(rows)) and np.isfinite(end) == (count > 0)
        if every < 1 or len(rows) != -(-count // every) or len(rows) > MOST or not whole:
            raise ValueError(f"{len(rows)} of {count} impacts, each {every}th kept; expected finite numbers of such")
        self.count, self.every, self._end = count, every, end
        self._kept, self._new, self._room = rows, [], MOST - len(rows)


UNSEEN = -1.0  # speed of a contact that began before the march


class RunningImpact(NamedTuple):
    """A face between two steps.

    Attributes:
        depth: Its largest penetration, m; negative: its smallest gap.
        begun: Contact force over time since t = 0 when it was open last, N s.
        speed: Approach speed of the contact that has not ended, m/s; `UNSEEN`: it began before the march.
        duration: Its duration so far, s.
    """

    depth: float
    begun: float
    speed: float
    duration: float


class EndedImpact(NamedTuple):
    """End of an impact in a step: whether one ended, how long before the end of the step, s, and its impulse, N s."""

    ended: bool
    lag: float
    impulse: float


@shared
def approach_speed(before: float, depth: float, dt: float) -> float:
    """Return the rate at which a gap closed over a step, m/s; where it began is not known: the least that it can be.

    Args:
        before: Largest penetration at its start, m.
        depth: At its end, m.
        dt: Size of the step, s.
    """
    return max(depth - before, 0.0) / dt if np.isfinite(before) else max(depth, 0.0) / dt


@shared
def after_gap(
    before: RunningImpact, was_closed: bool, closed: bool, speed: float, depth: float, impulse: float, dt: float
) -> tuple[RunningImpact, EndedImpact]:
    """Return a face after a step, and the impact that ended in it.

    Args:
        before: The face before.
        was_closed: Whether it was in contact before.
        closed: Whether it is in contact at the end of the step.
        speed: Approach speed, if it closed in this step, m/s.
        depth: Largest penetration at the end, m.
        impulse: Contact force over time since t = 0, N s.
        dt: Size of the step, s.
    """
    if closed and was_closed:
        return RunningImpact(depth, before.begun, before.speed, before.duration + dt), EndedImpact(False, 0.0, 0.0)
    if closed:
        part = closed_part(before.depth, depth)
        return RunningImpact(depth, before.begun, speed, part * dt), EndedImpact(False, 0.0, 0.0)
    if not was_closed:
        return RunningImpact(depth, impulse, 0.0, 0.0), EndedImpact(False, 0.0, 0.0)
    part = closed_part(before.depth, depth)
    ended = EndedImpact(before.speed >= 0.0, (1.0 - part) * dt, impulse - before.begun)
    return RunningImpact(depth, impulse, 0.0, before.duration + part * dt), ended
