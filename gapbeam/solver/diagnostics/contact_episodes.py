"""Contact episodes, which show whether the time step resolves the impacts, and the list of impacts.

An episode of a face lasts from the step in which it closes to the step in which it has opened. What happens
within a step or two is a matter of the scheme, not of the beam: the share of the impulse that short episodes
carry says how much of the contact force is so.

Loops measure, and these functions count impacts, episodes and peaks after each step. They take and return plain
numbers.

Each impact of a face has time, approach speed, impulse and duration, in bounded memory.

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
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from gapbeam.solver.compilation.jit import shared
from gapbeam.solver.diagnostics.energy_ledger import relative_growth
from gapbeam.solver.schema.record_table import IMPACT_COLUMNS
from gapbeam.solver.system.semi_discrete import ContactOperator, Step
from gapbeam.solver.system.slip_modes import closed_part

UNKNOWN, CLOSED, OPEN = -1, 0, 1
RESOLVING_STEPS = 10  # steps that an episode should have


class Watched(NamedTuple):
    """A face as the gates see it.

    Attributes:
        face: UNKNOWN, CLOSED or OPEN when last seen.
        created: Energy created when the impact that has not ended began, J; NaN: there is none.
        energy: Kinetic and strain energy then, J.
    """

    face: int
    created: float
    energy: float


class Peak(NamedTuple):
    """Contact of a face since t = 0.

    Attributes:
        impulse: Contact force over time, N s.
        square: Its square over time, N^2 s.
        force: Largest contact force, N.
        friction: Largest friction force, N.
        depth: Largest penetration, m.
    """

    impulse: float
    square: float
    force: float
    friction: float
    depth: float


class FaceTouches(NamedTuple):
    """Time in contact of a face, s, and how often it closed, since t = 0; 1 where it is closed now, else 0."""

    time: float
    closings: float
    closed: float


@shared
def after_look(
    before: Watched, closed: bool, created: float, energy: float, round_off: float
) -> tuple[Watched, bool, float]:
    """Return a face after a step, whether an impact ended with it, and the relative growth of energy in that impact.

    Args:
        before: The face before.
        closed: Whether anything presses it now.
        created: Energy created since t = 0, J.
        energy: Kinetic and strain energy, J.
        round_off: Energy that the balance cannot resolve, J.
    """
    now = CLOSED if closed else OPEN
    if before.face == OPEN and now == CLOSED:
        return Watched(now, created, energy), False, 0.0
    if before.face == CLOSED and now == OPEN and not np.isnan(before.created):
        growth = relative_growth(created - before.created, before.energy, round_off)
        return Watched(now, np.nan, np.nan), True, growth
    return Watched(now, before.created, before.energy), False, 0.0


@shared
def breaks_gates(growth: float, most_growth: float, most_loss: float) -> bool:
    """Return whether an impact with this relative growth of energy lies outside the gates."""
    return growth > most_growth or -growth > most_loss


@shared
def after_contact(steps: int, impulse: float, pressed: bool, added: float) -> tuple[int, float, bool, bool]:
    """Return the steps and impulse of the episode of a face after a step, whether it ended, and whether it was short.

    Args:
        steps: Steps of the episode before; 0: there is none.
        impulse: Its impulse, N s.
        pressed: Whether anything presses the face in the balance of the step.
        added: Impulse of the step, N s.
    """
    if pressed:
        return steps + 1, impulse + added, False, False
    return 0, 0.0, steps > 0, 0 < steps < RESOLVING_STEPS


@shared
def after_touch(before: FaceTouches, dt: float, closed: bool) -> FaceTouches:
    """Return the contact times of a face after a step.

    Args:
        before: The times before.
        dt: Size of the step, s.
        closed: Whether the face is in contact at its end.
    """
    if not closed:
        return FaceTouches(before.time, before.closings, 0.0)
    return FaceTouches(before.time + dt, before.closings + 1.0 - before.closed, 1.0)


@shared
def after_forces(before: Peak, dt: float, force: float, friction: float, depth: float) -> Peak:
    """Return the peaks of a face after a step with these forces, N, which ends at this penetration, m."""
    return Peak(
        before.impulse + dt * force,
        before.square + dt * force * force,
        max(before.force, force),
        max(before.friction, friction),
        max(before.depth, depth),
    )


@dataclass
class Episodes:
    """Counts the contact episodes of every face.

    Attributes:
        contact: Contact operator, which distinguishes the faces.
        count: Episodes that ended.
        short: Number of episodes of fewer than `RESOLVING_STEPS` steps.
        impulse: Contact force over time of all episodes, N s.
        short_impulse: Contact force over time of the short ones, N s.
        running: Steps and impulse of the episode of each closed face.
    """

    contact: ContactOperator
    count: int = 0
    short: int = 0
    impulse: float = 0.0
    short_impulse: float = 0.0
    running: dict[int, tuple[int, float]] = field(default_factory=dict)

    def watch(self, step: Step) -> None:
        """Take in an accepted step."""
        pressure, weights = step.stage.pressure, self.contact.weights
        for face, mine in enumerate(self.contact.points_of_faces):
            pressed = bool((pressure[mine] > 0.0).any())
            added = step.size * float(weights[mine] @ pressure[mine]) if pressed else 0.0
            steps, impulse = self.running.pop(face, (0, 0.0))
            now, running, ended, short = after_contact(steps, impulse, pressed, added)
            if now:
                self.running[face] = (now, running)
            self.impulse += added
            self.count += ended
            if short:
                self.short += 1
                self.short_impulse += impulse

    @property
    def unresolved_share(self) -> float:
        """Share of the impulse in short episodes."""
        return self.short_impulse / self.impulse if self.impulse > 0.0 else 0.0

    def figures(self) -> dict[str, Any]:
        """Return the figures for the summary."""
        return {
            "episodes": self.count,
            "short_episodes": self.short,
            "short_means_fewer_steps_than": RESOLVING_STEPS,
            "share_of_impulse_in_short_episodes": self.unresolved_share,
        }


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
        self._kept: np.ndarray = np.zeros((0, len(COLUMNS) + 1))  # the impacts, and the parting before each
        self._new: list[np.ndarray] = []
        self._room = MOST
        self._end = -np.inf

    @property
    def rows(self) -> np.ndarray:
        """The impacts that are kept: closing time, s, approach speed, m/s, impulse, N s, duration, s; (k, 4)."""
        return self._all()[:, :-1]

    @property
    def partings(self) -> np.ndarray:
        """Time that the face was open before each stored impact, (k,), s; infinite before the first."""
        return self._all()[:, -1]

    def add(self, rows: np.ndarray) -> None:
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

    def _all(self) -> np.ndarray:
        if self._new:
            self._kept = np.concatenate([self._kept, *self._new])
            self._new.clear()
        return self._kept

    def as_json(self) -> dict[str, Any]:
        """Return everything that is kept, for JSON; infinite values, before the first impact, are null."""
        rows = [[x if np.isfinite(x) else None for x in row] for row in self._all().tolist()]
        return {"count": self.count, "every": self.every, "rows": rows, "end": self._end if self.count else None}

    def restore(self, data: Mapping[str, Any]) -> None:
        """Restore a new list from a checkpoint.

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
        depth: Penetration at the end of the step, m.
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
