"""What contact did to each face since t = 0: impulse, largest penetration, largest forces."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from solver.operators import Array, Operators
from solver.system import ContactOperator, State, Step


@dataclass
class Peaks:
    """Impulse and peaks of every face, and the contact iterations since they were last told.

    Attributes:
        contact: To tell the faces apart.
        impulse: Contact force integrated over time on each face, N s.
        deepest: Largest penetration so far on each face, m.
        force: Largest contact force so far on each face, N.
        friction: Largest friction force so far on each face, N.
        iterations: Contact iterations since the last record.
    """

    contact: ContactOperator
    impulse: Array = field(init=False)
    deepest: Array = field(init=False)
    force: Array = field(init=False)
    friction: Array = field(init=False)
    iterations: int = 0

    def __post_init__(self) -> None:
        count = len(self.contact.face_names)
        self.impulse, self.force, self.friction = np.zeros(count), np.zeros(count), np.zeros(count)
        self.deepest = np.full(count, -np.inf)

    def see(self, step: Step, operators: Operators) -> None:
        """Take in an accepted step. Collective for Nitsche's method."""
        force = by_face(self.contact, self.contact.weights * step.stage.pressure)
        self.impulse = self.impulse + step.size * force
        self.force = np.maximum(self.force, force)
        if step.stage.traction is not None:
            friction = np.linalg.norm(friction_by_face(self.contact, step.stage.traction), axis=1)
            self.friction = np.maximum(self.friction, friction)
        self.deepest = np.maximum(self.deepest, deepest_by_face(self.contact, step.new, operators))
        self.iterations += step.iterations


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
    return np.array([penetration[contact.faces == face].max() for face in range(len(contact.face_names))])
