"""What each contact point has met, seen at the instants of the records.

With the penetrations d0 and d1 at the records at both ends of an interval dt:

    time in contact = sum of dt where d1 > 0,    load = sum of w P(d0, d1) dt,    deepest = max d

P is the mean pressure of the law over the interval, damping included. The impulse of a face is that of the march; its
points share it as they share the load. Where a record is written for every step, first touch and time in contact go by
the rule of the faces, see `gapbeam.solver.diagnostics.contact_times`, and P is the pressure of a step of the discrete
gradient. Contacts that begin and end between two records are not seen.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import SemiDiscreteSystem

PIECE = 500  # records that are seen at once
KEPT = ("begin", "last", "depth", "touch_speed", "first_touch", "time", "load", "deepest")
EVEN = 1.0e-9  # of the longest interval between records: what round-off makes of equal ones


@dataclass
class PointContact:
    """Sums over the records of a march, by contact point.

    Attributes:
        system: The system.
        law: The contact law, which goes by the penetration.
        begin: Time of the first record, s; infinite: there is none.
        last: Time of the last one, s.
        depth: Penetrations there, (m,), m.
        touch_speed: Closing speeds when the points were open last, (m,), m/s, for the laws that ask.
        first_touch: Time of the first record at which the point was in contact, (m,), s; infinite: none.
        time: Time in contact, (m,), s.
        load: Force of the law over time, (m,), N s; 0 for laws that yield, whose pressure has a past.
        deepest: Largest penetration, (m,), m; negative: the smallest gap.
    """

    system: SemiDiscreteSystem
    law: ContactLaw
    begin: float = np.inf
    last: float = 0.0
    depth: Array = field(init=False)
    touch_speed: Array = field(init=False)
    first_touch: Array = field(init=False)
    time: Array = field(init=False)
    load: Array = field(init=False)
    deepest: Array = field(init=False)

    def __post_init__(self) -> None:
        size = self.system.contact.size
        self.first_touch, self.deepest = np.full(size, np.inf), np.full(size, -np.inf)
        self.time, self.load = np.zeros(size), np.zeros(size)
        self.depth, self.touch_speed = np.zeros(size), np.zeros(size)

    def see(self, times: Array, u: Array, v: Array) -> None:
        """See records.

        Args:
            times: (times,), s.
            u: Marched DOFs, (times, n).
            v: Their velocities, (times, n).

        Collective.
        """
        for first in range(0, len(times), PIECE):
            piece = slice(first, first + PIECE)
            self._see(times[piece], *self._motion(times[piece], u[piece], v[piece]))

    def impulses(self, of_faces: Array) -> Array:
        """Return the impulse of each point, (m,), N s; not a number where no record shows what pressed its face.

        Args:
            of_faces: The impulses of the faces, (faces,), N s.
        """
        faces = self.system.contact.faces
        loads = np.bincount(faces, weights=self.load, minlength=len(of_faces))
        known = (loads > 0.0) | (of_faces == 0.0)
        shares = np.divide(of_faces, loads, out=np.zeros(len(loads)), where=loads > 0.0)
        return np.asarray(np.where(known[faces], self.load * shares[faces], np.nan))

    @property
    def shares(self) -> Array:
        """Share of the time between the first record and the last one in contact, (m,); 0 of a single record."""
        span = self.last - self.begin
        return np.asarray(self.time / span) if span > 0.0 else np.zeros(self.system.contact.size)

    def as_json(self) -> dict[str, Any]:
        """Return the sums for JSON."""
        return {name: np.asarray(getattr(self, name)).tolist() for name in KEPT}

    def _see(self, times: Array, depths: Array, speeds: Array) -> None:
        if np.isinf(self.begin):
            self.begin = self.last = float(times[0])
            self.depth, self.touch_speed = depths[0], speeds[0]
        intervals = np.diff(times, prepend=self.last)
        touching = depths > 0.0
        touched = touching.any(axis=0)
        firsts = np.where(touched, times[np.argmax(touching, axis=0)], np.inf)
        self.first_touch = np.minimum(self.first_touch, firsts)
        self.time += intervals @ touching
        self.deepest = np.maximum(self.deepest, depths.max(axis=0))
        if not self.law.keeps_set:
            before = np.concatenate([self.depth[None], depths[:-1]])
            self.load += self.system.contact.weights * self._pressed(before, depths, speeds, intervals)
        self.last, self.depth = float(times[-1]), depths[-1]

    def _pressed(self, before: Array, after: Array, speeds: Array, intervals: Array) -> Array:
        """Return the pressure over time of some intervals, (m,), Pa s; remember the speeds at touch."""
        longest = float(intervals.max())
        even = bool(np.all((intervals == 0.0) | (intervals > (1.0 - EVEN) * longest)))
        if self.law.touch_product is None and even:
            pressures = self.law.discrete_gradient(before, after, longest).pressure if longest > 0.0 else before
            return np.asarray(intervals @ pressures)
        found = np.zeros(after.shape[1])
        for old, new, dt, speed in zip(before, after, intervals, speeds, strict=True):
            if dt > 0.0 and max(old.max(), new.max()) > 0.0:
                law = self.law.touched_at(self.touch_speed)
                found += dt * law.discrete_gradient(old, new, float(dt)).pressure
            self.touch_speed = np.where(new > 0.0, self.touch_speed, speed)
        return found

    def _motion(self, times: Array, u: Array, v: Array) -> tuple[Array, Array]:
        """Return penetrations, m, and closing speeds, m/s, at records, (times, m) each. Collective.

        Speeds are 0 where no law asks for them.
        """
        contact = self.system.contact
        places, rates = self._traces(u), self._traces(v)
        if contact.turning is not None:
            pairs = list(zip(places, rates, times, strict=True))
            speeds = np.array([contact.at(place, time).closing_speed(rate, time) for place, rate, time in pairs])
            return np.array([contact.depth(place, time) for place, _, time in pairs]), speeds
        walls, matrix = contact.walls, contact.gap_matrix
        depths = -(contact.initial_gap + (matrix @ places.T).T) - walls.places(times) @ walls.growths
        if self.law.touch_product is None:
            return depths, np.zeros_like(depths)
        return depths, -(matrix @ rates.T).T - walls.speeds(times) @ walls.growths

    def _traces(self, x: Array) -> Array:
        """Return the interface values of some vectors, (times, n): (times, interface.size). Collective."""
        interface = self.system.contact.interface
        owned = np.zeros((len(x), interface.size))
        owned[:, interface.slots] = x[:, interface.owned]
        return self.system.operators.sum(owned)
