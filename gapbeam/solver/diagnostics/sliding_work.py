"""The work of sliding: the integral of N |v_t| over time at every contact point.

    W = sum over steps of N |s|

N is the normal force of a point in the balance of a step, s the way that the point moves along its face in the step.
Over the time T it is the work rate W / T. Friction with the coefficient mu takes mu W from the motion of a point that
slides; W itself is measured without friction as well. `gapbeam.solver.system.slip_modes` says which part of it is
impact, sliding and sticking.

Source: Archard, Journal of Applied Physics 24 (1953) 981, for wear in proportion to W; Pettigrew, Taylor, Fisher,
Yetisir and Smith, Nuclear Engineering and Design 185 (1998) 249, for the work rate.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gapbeam.solver.diagnostics.contact_peaks import by_face
from gapbeam.solver.record_table import SLIP_MODES
from gapbeam.solver.system.accepted_step import Step
from gapbeam.solver.system.operators import Array, Operators
from gapbeam.solver.system.semi_discrete import VALUE, ContactOperator, State
from gapbeam.solver.system.slip_modes import by_mode, impact_share, pressed_after, pressed_span


@dataclass
class SlidingWork:
    """Sums over the accepted steps of a march.

    Attributes:
        contact: To distinguish the faces; its `measures_sliding` says whether anything is measured.
        work: W at each point, (m,), J; (0,) where nothing is measured.
        parts: Its parts by `SLIP_MODES`, (3, m), J.
        pressed_for: How long each face has been pressed, (faces,), s; infinite: since the march began; 0 where nothing
            is measured.
    """

    contact: ContactOperator
    work: Array
    parts: Array
    pressed_for: Array

    @classmethod
    def opened(cls, contact: ContactOperator, start: State) -> SlidingWork:
        """Return the sums at the start of a march."""
        size = contact.size if contact.measures_sliding else 0
        pressed = (by_face(contact, np.maximum(start.pressure, 0.0)) > 0.0) & contact.measures_sliding
        return cls(contact, np.zeros(size), np.zeros((len(SLIP_MODES), size)), np.where(pressed, np.inf, 0.0))

    @property
    def by_face(self) -> Array | None:
        """W of each face, (faces,), J; None: not measured."""
        return by_face(self.contact, self.work) if self.contact.measures_sliding else None

    @property
    def parts_by_face(self) -> Array | None:
        """The parts of W of each face, (faces, 3), J; None: not measured."""
        if not self.contact.measures_sliding:
            return None
        return np.stack([by_face(self.contact, part) for part in self.parts], axis=-1)

    def see(self, step: Step, operators: Operators) -> None:
        """Take in an accepted step. Collective where sliding is measured."""
        contact, modes = self.contact, self.contact.slip_modes
        if not contact.measures_sliding:
            return
        change = contact.interface.trace(step.new.u[VALUE] - step.old.u[VALUE], operators)
        moved = contact.turned(step.stage.opening).slip(change)
        force = np.maximum(contact.weights * step.stage.pressure, 0.0)
        ways = np.linalg.norm(moved, axis=1)
        done = force * ways
        self.work += done
        pressed = by_face(contact, force) > 0.0
        spans = self._spans(step, pressed, operators)
        for point in np.flatnonzero(done):
            face = contact.faces[point]
            share = impact_share(self.pressed_for[face], spans[face], modes)
            self.parts[:, point] += by_mode(done[point], ways[point] / step.size, share, modes)
        for face, touches in enumerate(pressed):
            self.pressed_for[face] = pressed_after(self.pressed_for[face], spans[face], touches)

    def _spans(self, step: Step, pressed: NDArray[np.bool_], operators: Operators) -> Array:
        """Return how long each face is pressed in a step, if a force acts on it, (faces,), s."""
        spans, closing = np.full(len(pressed), step.size), np.flatnonzero(pressed & (self.pressed_for == 0.0))
        if len(closing):
            before = self.contact.penetration_of(step.old, operators)
            depth = self.contact.penetration_of(step.new, operators)
            for face in closing:
                points = self.contact.points_of_faces[face]
                deepest = points[np.argmax(depth[points])]
                spans[face] = pressed_span(0.0, before[deepest], depth[deepest], step.size)
        return spans
