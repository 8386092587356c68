"""How long each face was in contact, and how often it closed, since t = 0."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.diagnostics.face_updates import FaceTouches, after_touch
from gapbeam.solver.system.accepted_step import Step
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import ContactOperator, State


@dataclass
class ContactTimes:
    """Sums over the accepted steps of a march, by face.

    A face is in contact over a step if a point of it has penetrated at the end of the step: the share of time in
    contact then has an error of second order in the step. The balance of a step, in which a force acts as soon as
    contact begins or ends within the step, would count a step too many for every contact. Where contact leaves no
    penetration, pressure at the end of the step counts.

    Attributes:
        contact: To distinguish the faces.
        by_depth: Whether penetration shows contact.
        time: Time in contact, (faces,), s.
        closings: How often it closed, (faces,).
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
