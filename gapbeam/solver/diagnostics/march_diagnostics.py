"""Accounts of a march over all accepted steps: energy ledger, gates, contact times, impacts, episodes, peaks, counts.

Impacts become figures: rates, and distributions of approach speed, impulse and duration.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import inf
from typing import Any

import numpy as np

from gapbeam.solver.case.solution_tables import Gates
from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.diagnostics.contact_episodes import (
    COLUMNS,
    UNSEEN,
    Episodes,
    FaceTouches,
    ImpactList,
    RunningImpact,
    after_gap,
    after_touch,
    approach_speed,
)
from gapbeam.solver.diagnostics.energy_gates import EnergyGates
from gapbeam.solver.diagnostics.energy_ledger import Ledger, enter_step, open_ledger, restate
from gapbeam.solver.diagnostics.point_contact import Peaks, SlidingWork, deepest_by_face
from gapbeam.solver.supports.layout import Layout
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import STIFFNESS, ContactOperator, SemiDiscreteSystem, State, Step

HALVED = 0.75  # of the step of the case; a step shorter than this is part of a halved one


@dataclass
class Tally:
    """Counts of a march, over its accepted steps.

    Attributes:
        dt: Step of the case, s.
        steps: Accepted steps, parts of halved steps included.
        halved: Parts of halved steps.
        failures: Steps that were halved because the contact solve did not converge.
        refinements: Steps that were halved because they did not resolve the contact.
        unresolved: Accepted steps that do not resolve the contact, at the limit of halvings.
        shortest: Shortest accepted step, s.
        iterations: Iterations of the contact solve.
        most_iterations: The most in one step.
        advance: Time in the steps themselves, s.
        back_substitution: Time in their back-substitutions, s.
        march: Time of the march with everything, output included, s.
        drift: Largest difference between the image K u that was carried and a new product, N.
        elastic_force: Largest entry of K u at these times, N.
    """

    dt: float
    steps: int = 0
    halved: int = 0
    failures: int = 0
    refinements: int = 0
    unresolved: int = 0
    shortest: float = inf
    iterations: int = 0
    most_iterations: int = 0
    advance: float = 0.0
    back_substitution: float = 0.0
    march: float = 0.0
    drift: float = 0.0
    elastic_force: float = 0.0

    def see(self, step: Step, seconds: float) -> None:
        """Count an accepted step that took some seconds."""
        self.steps += 1
        self.halved += step.size < HALVED * self.dt
        self.failures += step.failures
        self.refinements += step.refinements
        self.unresolved += step.unresolved
        self.shortest = min(self.shortest, step.size)
        self.iterations += step.iterations
        self.most_iterations = max(self.most_iterations, step.iterations)
        self.advance += seconds
        self.back_substitution += step.timings["back_substitution"]
        drift, force = image_drift(step)
        self.drift, self.elastic_force = max(self.drift, drift), max(self.elastic_force, force)

    def convergence(self) -> dict[str, Any]:
        """Return the counts for the summary."""
        return {
            "steps": self.steps,
            "parts_of_halved_steps": self.halved,
            "halvings_not_converged": self.failures,
            "halvings_adaptive": self.refinements,
            "unresolved_steps": self.unresolved,
            "shortest_step": self.shortest,
            "iterations_mean": self.iterations / max(self.steps, 1),
            "iterations_max": self.most_iterations,
            "image_drift": self.drift / self.elastic_force if self.elastic_force > 0.0 else 0.0,
        }

    def seconds(self) -> dict[str, float | None]:
        """Return the wall times for the summary."""
        count = max(self.steps, 1)
        per_step, back = self.march / count, self.back_substitution / count
        return {
            "march": self.march,
            "per_step": per_step,
            "advance": self.advance / count,
            "back_substitution": back,
            "step_over_back_substitution": per_step / back if back > 0.0 else None,
        }


def image_drift(step: Step) -> tuple[float, float]:
    """Return the drift of the image K u when it was refreshed, and the size of K u, N; local part."""
    if step.refreshed is None:
        return 0.0, 0.0
    kept, true = step.new.u[STIFFNESS], step.refreshed.u[STIFFNESS]
    return float(np.max(np.abs(kept - true), initial=0.0)), float(np.max(np.abs(true), initial=0.0))


@dataclass
class ContactTimes:
    """Sums over the accepted steps of a march, by face.

    A face is in contact over a step if a point of it has penetrated at the end of the step: the share of time in
    contact then has an error of second order in the step. The balance of a step, in which a force acts as soon as
    contact begins or ends within the step, would count a step too many for every contact. Where contact leaves no
    penetration, pressure at the end of the step counts.

    Attributes:
        contact: Contact operator, which distinguishes the faces.
        by_depth: Whether penetration shows contact.
        time: Time in contact, (faces,), s.
        closings: Number of closings, (faces,).
        closed: 1 where it was in contact when last seen, else 0, (faces,).
    """

    contact: ContactOperator
    by_depth: bool
    time: Array = field(init=False)
    closings: Array = field(init=False)
    closed: Array = field(init=False)

    def __post_init__(self) -> None:
        count = len(self.contact.face_names)
        self.time, self.closings, self.closed = np.zeros(count), np.zeros(count), np.zeros(count)

    @classmethod
    def opened(cls, contact: ContactOperator, law: ContactLaw, start: State) -> ContactTimes:
        """Return the times at the start of a march."""
        by_depth = contact.symmetric and law.augmented is None and law.stores_energy
        made = cls(contact, by_depth)
        made.closed = made._closed_in(start)
        return made

    def see(self, step: Step) -> None:
        """Take in an accepted step."""
        before = zip(self.time, self.closings, self.closed, strict=True)
        now = self._closed_in(step.new)
        touches = [
            after_touch(FaceTouches(*was), step.size, bool(closed)) for was, closed in zip(before, now, strict=True)
        ]
        self.time, self.closings, self.closed = np.array(touches).T.copy()

    def _closed_in(self, state: State) -> Array:
        touching = (state.depth if self.by_depth else state.pressure) > 0.0
        return self.contact.faces_with(touching).astype(float)


KEPT = ("approach", "depth", "begun", "speed", "duration", "rate")


class Impacts:
    """Running impacts of all faces (see `RunningImpact`), and the impacts that have ended.

    An impact lasts from the step in which a face closes to the step in which it has opened, as `ContactTimes` counts
    them. Its impulse is all that acts between two times at which the face is open.

    Attributes:
        approach: Sum of the approach speeds of all closings since t = 0, (faces,), m/s.
        depth: Largest penetration, (faces,), m.
        begun: Impulse when the face was open last, (faces,), N s.
        speed: Approach speed of the contact that has not ended, (faces,), m/s.
        duration: Its duration so far, (faces,), s.
        rate: Closing speed of the gap in the last step, (faces,), m/s; where contact leaves no penetration, that is the
            approach speed of an impact in the next one.
        ended: The impacts of each face.
    """

    def __init__(self, depth: Array, closed: Array) -> None:
        none = np.zeros(len(depth))
        self.approach, self.begun, self.duration, self.rate = none.copy(), none.copy(), none.copy(), none.copy()
        self.depth, self.speed = np.array(depth, dtype=float), np.where(closed > 0.0, UNSEEN, 0.0)
        self.ended = tuple(ImpactList() for _ in none)

    @classmethod
    def opened(cls, system: SemiDiscreteSystem, law: ContactLaw, start: State) -> Impacts:
        """Return the impacts at the start of a march. Collective for Nitsche's method."""
        closed = ContactTimes.opened(system.contact, law, start).closed
        return cls(deepest_by_face(system.contact, start, system.operators), closed)

    def see(self, step: Step, before: Array, times: ContactTimes, depth: Array, impulse: Array) -> None:
        """Take in an accepted step.

        Args:
            step: The step.
            before: 1 where a face was in contact at its start, else 0, (faces,).
            times: Contact times, with the step.
            depth: Largest penetration at its end, (faces,), m.
            impulse: Contact force over time since t = 0, (faces,), N s.
        """
        for face in range(len(depth)):
            rate = approach_speed(float(self.depth[face]), float(depth[face]), step.size)
            speed = rate if times.by_depth else float(self.rate[face])
            running = RunningImpact(self.depth[face], self.begun[face], self.speed[face], self.duration[face])
            was_closed, closed = bool(before[face]), bool(times.closed[face])
            now, end = after_gap(running, was_closed, closed, speed, depth[face], impulse[face], step.size)
            if closed and not was_closed:
                self.approach[face] += speed
            if end.ended:
                start = step.new.time - end.lag - now.duration
                self.ended[face].add(np.array([[start, running.speed, end.impulse, now.duration]]))
            self.depth[face], self.begun[face], self.speed[face] = now.depth, now.begun, now.speed
            self.duration[face], self.rate[face] = now.duration if closed else 0.0, rate

    def as_json(self) -> dict[str, Any]:
        """Return everything that is kept, for JSON; a depth that is not known is null."""
        plain = {key: [x if np.isfinite(x) else None for x in getattr(self, key).tolist()] for key in KEPT}
        return plain | {"ended": [one.as_json() for one in self.ended]}

    def restore(self, data: Mapping[str, Any]) -> None:
        """Restore new impacts from a checkpoint.

        Raises:
            KeyError: Something is missing; likewise ValueError and TypeError where it is not of the right form.
        """
        for key in KEPT:
            found = np.array([-np.inf if x is None else x for x in data[key]], dtype=float)
            if found.shape != self.depth.shape or not np.all(np.isfinite(found) | (key == "depth")):
                raise ValueError(f"{key} of {len(found)} faces, expected finite numbers of {len(self.depth)}")
            setattr(self, key, found)
        for mine, stored in zip(self.ended, data["ended"], strict=True):
            mine.restore(stored)


UNGUARDED = Gates(accept_energy_growth=True)


@dataclass
class Accounts:
    """Everything that consumes each accepted step of a march.

    Attributes:
        system: The system.
        law: The contact law.
        ledger: The energy ledger.
        gates: Watches it.
        episodes: Contact episodes.
        peaks: Impulse and peaks of the faces.
        times: Contact times and closings.
        impacts: Their impacts.
        tally: Cost of the march.
        sliding: The work of sliding.
        time: End of the last accepted step, s.
    """

    system: SemiDiscreteSystem
    law: ContactLaw
    ledger: Ledger
    gates: EnergyGates
    episodes: Episodes
    peaks: Peaks
    times: ContactTimes
    impacts: Impacts
    tally: Tally
    sliding: SlidingWork
    time: float

    @classmethod
    def opened(
        cls,
        system: SemiDiscreteSystem,
        law: ContactLaw,
        start: State,
        dt: float,
        limits: Gates = UNGUARDED,
        remedy: str = "Try a smaller time.step",
    ) -> Accounts:
        """Return the accounts at the start of a march in steps of dt, s; by default no growth ends it. Collective."""
        contact, ledger = system.contact, open_ledger(system, law, start)
        watch = (
            EnergyGates(limits, contact, remedy=remedy),
            Episodes(contact),
            Peaks(contact),
            ContactTimes.opened(contact, law, start),
            Impacts.opened(system, law, start),
            Tally(dt),
            SlidingWork.opened(contact, start),
        )
        return cls(system, law, ledger, *watch, start.time)

    def take(self, step: Step, seconds: float = 0.0) -> None:
        """Enter an accepted step that took some seconds.

        Raises:
            NotFinite: The energy is not a number.
            EnergyCreated: More energy was created than the gates allow, unless the case accepts it.

        Collective.
        """
        self.time = step.new.time
        self.ledger = enter_step(self.system, self.law, self.ledger, step)
        if step.refreshed is not None:
            self.ledger = restate(self.system, self.law, self.ledger, step.refreshed)
        depth, closed = self.peaks.see(step, self.system.operators), self.times.closed
        self.episodes.watch(step)
        self.tally.see(step, seconds)
        self.times.see(step)
        self.impacts.see(step, closed, self.times, depth, self.peaks.impulse)
        self.sliding.see(step, self.system.operators)
        self.gates.check(step, self.ledger)


PERCENTILES = (5, 50, 95)
HIGHEST = "largest"


def impact_figures(impacts: Impacts, layout: Layout, seconds: float) -> dict[str, Any]:
    """Return the figures of the impacts of each support and of each of its faces, by name.

    Args:
        impacts: Impacts of a march.
        layout: Its supports, whose faces are those of the march in this order.
        seconds: Span of the march, s.
    """
    lists, found = iter(impacts.ended), dict[str, Any]()
    for support in layout.supports:
        mine = [next(lists) for _ in support.faces]
        faces = {face.name: figures_of_lists([one], seconds) for face, one in zip(support.faces, mine, strict=True)}
        found[support.name] = figures_of_lists(mine, seconds) | {"faces": faces}
    return found


def figures_of_lists(lists: Sequence[ImpactList], seconds: float) -> dict[str, Any]:
    """Return count, rate and distributions of the impacts of some lists together, over a span of time, s."""
    count = sum(one.count for one in lists)
    every = [one.every for one in lists]
    rows = np.concatenate([np.repeat(one.rows, one.every // min(every), axis=0) for one in lists])
    found: dict[str, Any] = {"count": count, "rate": count / seconds if seconds > 0.0 else 0.0}
    found["kept_one_in"] = max(every)
    for number, name in enumerate(COLUMNS[1:], start=1):
        found[name], values = None, rows[:, number]
        if len(values):
            shares = {f"percentile_{p}": float(np.percentile(values, p)) for p in PERCENTILES}
            found[name] = {"mean": float(values.mean()), **shares, HIGHEST: float(values.max())}
    return found
