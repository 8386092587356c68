"""The impacts of every face of a march: what is running, what has ended, and the sum of the approach speeds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.diagnostics.contact_peaks import deepest_by_face
from gapbeam.solver.diagnostics.contact_times import ContactTimes
from gapbeam.solver.diagnostics.impact_list import ImpactList
from gapbeam.solver.diagnostics.impact_updates import UNSEEN, RunningImpact, after_gap, approach_speed
from gapbeam.solver.system.accepted_step import Step
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import SemiDiscreteSystem, State

KEPT = ("approach", "depth", "begun", "speed", "duration", "rate")


class Impacts:
    """What `RunningImpact` holds, for all faces at once, and the impacts that have ended.

    An impact lasts from the step in which a face closes to the step in which it has opened, as `ContactTimes` counts
    them. Its impulse is all that acts between two times at which the face is open.

    Attributes:
        approach: Sum of the approach speeds of all closings since t = 0, (faces,), m/s.
        depth: Largest penetration, (faces,), m.
        begun: Impulse when the face was open last, (faces,), N s.
        speed: Approach speed of the contact that has not ended, (faces,), m/s.
        duration: Its duration so far, (faces,), s.
        rate: How fast the gap closed in the last step, (faces,), m/s; where contact leaves no penetration, that is the
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
        """Bring impacts, as they are at a start, to what was stored.

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
