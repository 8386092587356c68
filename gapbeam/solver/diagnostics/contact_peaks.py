"""What contact did to each face since t = 0: impulse, largest penetration, largest forces."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from gapbeam.solver.diagnostics.face_updates import Peak, after_forces
from gapbeam.solver.system.accepted_step import Step
from gapbeam.solver.system.operators import Array, Operators
from gapbeam.solver.system.semi_discrete import ContactOperator, State


@dataclass
class Peaks:
    """Impulse and peaks of every face, and the contact iterations since the last report.

    Attributes:
        contact: To distinguish the faces.
        impulse: Contact force integrated over time on each face, N s.
        square: Its square integrated over time on each face, N^2 s; of the mean force of each step.
        deepest: Largest penetration so far on each face, m.
        force: Largest contact force so far on each face, N.
        friction: Largest friction force so far on each face, N.
        iterations: Contact iterations since the last record.
    """

    contact: ContactOperator
    impulse: Array = field(init=False)
    square: Array = field(init=False)
    deepest: Array = field(init=False)
    force: Array = field(init=False)
    friction: Array = field(init=False)
    iterations: int = 0

    def __post_init__(self) -> None:
        count = len(self.contact.face_names)
        self.impulse, self.square = np.zeros(count), np.zeros(count)
        self.force, self.friction = np.zeros(count), np.zeros(count)
        self.deepest = np.full(count, -np.inf)

    def see(self, step: Step, operators: Operators) -> Array:
        """Take in an accepted step; return the largest penetrations at its end, m. Collective for Nitsche's method."""
        contact, traction = self.contact, step.stage.traction
        forces = by_face(contact, contact.weights * step.stage.pressure)
        rubbing = np.zeros_like(forces)
        if traction is not None:
            rubbing = np.linalg.norm(friction_by_face(contact, traction), axis=1)
        depths = deepest_by_face(contact, step.new, operators)
        peaks = [
            after_forces(Peak(*before), step.size, *now)
            for before, now in zip(self._columns(), zip(forces, rubbing, depths, strict=True), strict=True)
        ]
        self.impulse, self.square, self.force, self.friction, self.deepest = np.array(peaks).T.copy()
        self.iterations += step.iterations
        return depths

    def _columns(self) -> Iterator[tuple[float, float, float, float, float]]:
        """Yield the peaks of each face."""
        return zip(self.impulse, self.square, self.force, self.friction, self.deepest, strict=True)


def by_face(contact: ContactOperator, values: Array) -> Array:
    """Return the sums of values (m,) over the points of each face, (faces,)."""
    return np.asarray(np.bincount(contact.faces, weights=values, minlength=len(contact.face_names)), dtype=float)


def friction_by_face(contact: ContactOperator, traction: Array) -> Array:
    """Return the friction force of tractions (m, k) on each face, (faces, k), N."""
    forces = contact.weights[:, None] * traction
    return np.stack([by_face(contact, along) for along in forces.T], axis=1)


def deepest_by_face(contact: ContactOperator, state: State, operators: Operators) -> Array:
    """Return the largest penetration of each face in a state, (faces,), m. Collective for Nitsche's method."""
    penetration = contact.penetration_of(state, operators)
    return np.array([penetration[points].max() for points in contact.points_of_faces])
