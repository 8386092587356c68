"""What each contact point has met, seen at the instants of the records.

With the penetrations d at the record that ends an interval dt:

    time in contact = sum of dt where d > 0,    load = sum of w e(d) dt,    deepest = max d

e is the law at rest. The impulse of a face is that of the march; its points share it as they share the load. A damper
that is zero before and after a contact adds nothing to the impulse of a point over the whole contact, so that the load
alone is needed. Where a record is written for every step, first touch and time in contact go by the rule of the faces,
see `gapbeam.solver.diagnostics.contact_times`; contacts that begin and end between two records are not seen.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import SemiDiscreteSystem

PIECE = 500  # records that are seen at once
KEPT = ("begin", "last", "first_touch", "time", "load", "deepest")


@dataclass
class PointContact:
    """Sums over the records of a march, by contact point.

    Attributes:
        system: The system.
        law: The contact law, which goes by the penetration.
        begin: Time of the first record, s; infinite: there is none.
        last: Time of the last one, s.
        first_touch: Time of the first record at which the point was in contact, (m,), s; infinite: none.
        time: Time in contact, (m,), s.
        load: Force of the law at rest over time, (m,), N s; 0 for laws that yield, whose pressure has a past.
        deepest: Largest penetration, (m,), m; negative: the smallest gap.
    """

    system: SemiDiscreteSystem
    law: ContactLaw
    begin: float = np.inf
    last: float = 0.0
    first_touch: Array = field(init=False)
    time: Array = field(init=False)
    load: Array = field(init=False)
    deepest: Array = field(init=False)

    def __post_init__(self) -> None:
        size = self.system.contact.size
        self.first_touch, self.deepest = np.full(size, np.inf), np.full(size, -np.inf)
        self.time, self.load = np.zeros(size), np.zeros(size)

    def see(self, times: Array, u: Array) -> None:
        """See records.

        Args:
            times: (times,), s.
            u: Marched DOFs, (times, n).

        Collective.
        """
        for first in range(0, len(times), PIECE):
            piece = slice(first, first + PIECE)
            self._see(times[piece], self._depths(times[piece], u[piece]))

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

    def _see(self, times: Array, depths: Array) -> None:
        if np.isinf(self.begin):
            self.begin = self.last = float(times[0])
        intervals = np.diff(times, prepend=self.last)
        touching = depths > 0.0
        touched = touching.any(axis=0)
        firsts = np.where(touched, times[np.argmax(touching, axis=0)], np.inf)
        self.first_touch = np.minimum(self.first_touch, firsts)
        self.time += intervals @ touching
        if not self.law.keeps_set:
            pressures = np.where(touching, self.law.static(depths).pressure, 0.0)
            self.load += (intervals @ pressures) * self.system.contact.weights
        self.deepest = np.maximum(self.deepest, depths.max(axis=0))
        self.last = float(times[-1])

    def _depths(self, times: Array, u: Array) -> Array:
        """Return the penetrations at records, (times, m), m. Collective."""
        contact = self.system.contact
        interface = contact.interface
        owned = np.zeros((len(u), interface.size))
        owned[:, interface.slots] = u[:, interface.owned]
        values = self.system.operators.sum(owned)
        if contact.turning is not None:
            return np.array([contact.depth(row, time) for row, time in zip(values, times, strict=True)])
        opened = contact.walls.places(times) @ contact.walls.growths
        return np.asarray(-(contact.initial_gap + (contact.gap_matrix @ values.T).T) - opened)
