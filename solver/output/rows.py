"""From accepted steps to records of the history."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from solver.energy import Ledger, restraint_energy
from solver.model import Model
from solver.operators import Array
from solver.output.records import COMPONENTS, TANGENTS
from solver.system import VALUE, Load, State, Step

Row = dict[str, "Array | float"]


@dataclass
class Recorder:
    """Turns steps into rows; keeps what a row needs from the steps before it.

    Attributes:
        model: The model.
        impulse: Contact force integrated over time on each face, N s.
        deepest: Largest penetration so far on each face, m.
        peak_force: Largest contact force so far on each face, N.
        peak_friction: Largest friction force so far on each face, N.
        iterations: Contact iterations since the last record.
        largest_restraint_energy: Largest energy in the restraint at a record so far, J.
        largest_energy: Largest kinetic, strain and contact energy together at a record so far, J.
    """

    model: Model
    impulse: Array = field(init=False)
    deepest: Array = field(init=False)
    peak_force: Array = field(init=False)
    peak_friction: Array = field(init=False)
    iterations: int = 0
    largest_restraint_energy: float = 0.0
    largest_energy: float = 0.0
    _last_time: float = 0.0
    _last_velocity: dict[str, Array] = field(default_factory=dict)

    def __post_init__(self) -> None:
        count = len(self.model.system.contact.face_names)
        self.impulse, self.peak_force, self.peak_friction = np.zeros(count), np.zeros(count), np.zeros(count)
        self.deepest = np.full(count, -np.inf)

    @property
    def labels(self) -> dict[str, tuple[str, ...]]:
        """Names along the labeled dimensions of the history; tangents are there with friction only."""
        model = self.model
        rubs = model.law.friction is not None
        return {
            "probe": tuple(model.probes),
            "component": COMPONENTS[model.case.mesh.dimension],
            "face": model.system.contact.face_names,
            "tangent": TANGENTS[model.case.mesh.dimension] if rubs else (),
            "load": tuple(load.name for load in model.system.loads),
        }

    @property
    def restraint_share(self) -> float:
        """Largest energy in the restraint relative to the largest energy."""
        return self.largest_restraint_energy / self.largest_energy if self.largest_energy > 0.0 else 0.0

    def see(self, step: Step) -> None:
        """Take in an accepted step."""
        force = self._by_face(self.model.system.contact.weights * step.stage.pressure)
        self.impulse = self.impulse + step.size * force
        self.peak_force = np.maximum(self.peak_force, force)
        if step.stage.traction is not None:
            friction = np.linalg.norm(self._friction_by_face(step.stage.traction), axis=1)
            self.peak_friction = np.maximum(self.peak_friction, friction)
        self.deepest = np.maximum(self.deepest, self._deepest(step.new))
        self.iterations += step.iterations

    def row(self, state: State, ledger: Ledger) -> Row:
        """Return the record at a state. Collective."""
        system, contact = self.model.system, self.model.system.contact
        forces = contact.weights * state.pressure
        interval = state.time - self._last_time if self._last_velocity else 0.0  # the first record is the start
        probes = self._probes(state)
        motion = self._frame_acceleration(self._last_time, state.time)
        components = len(self.labels["component"])
        relative = {
            name: (velocity - self._last_velocity[name]) / interval if interval > 0.0 else np.zeros(components)
            for name, (_, velocity) in probes.items()
        }
        held = restraint_energy(system, state)
        row: Row = {
            "time": state.time,
            "contact_force": self._by_face(forces),
            "contact_moment": self._by_face(forces * contact.positions[:, 0]),
            "contact_area": self._by_face(np.where(state.pressure > 0.0, contact.weights, 0.0)),
            "penetration": self._deepest(state),
            "impulse": self.impulse,
            "kinetic_energy": ledger.kinetic,
            "restraint_energy": held,
            "strain_energy": ledger.strain - held,
            "contact_energy": ledger.contact,
            "load_work": ledger.load_work,
            "structural_dissipation": ledger.structural,
            "contact_dissipation": ledger.contact_loss,
            "friction_dissipation": ledger.friction_loss,
            "algorithmic_dissipation": ledger.algorithmic,
            "energy_residual": ledger.residual,
            "iterations": float(self.iterations),
            "active_points": self._by_face((state.pressure > 0.0).astype(float)),
        }
        tangents = self.labels["tangent"]
        if tangents:
            still = np.zeros((contact.size, len(tangents)))
            row["friction_force"] = self._friction_by_face(still if state.traction is None else state.traction)
        if probes:
            row["displacement"] = np.array([place for place, _ in probes.values()])
            row["velocity"] = np.array([velocity for _, velocity in probes.values()])
            row["acceleration_relative"] = np.array(list(relative.values()))
            row["acceleration_absolute"] = np.array([a + motion[:components] for a in relative.values()])
        self.largest_restraint_energy = max(self.largest_restraint_energy, held)
        self.largest_energy = max(self.largest_energy, ledger.total)
        self._last_time, self.iterations = state.time, 0
        self._last_velocity = {name: velocity for name, (_, velocity) in probes.items()}
        return row

    def _probes(self, state: State) -> dict[str, tuple[Array, Array]]:
        operators = self.model.system.operators
        return {
            name: (probe.evaluate(state.u[VALUE], operators), probe.evaluate(state.v[VALUE], operators))
            for name, probe in self.model.probes.items()
        }

    def _by_face(self, values: Array) -> Array:
        contact = self.model.system.contact
        return np.asarray(np.bincount(contact.faces, weights=values, minlength=len(contact.face_names)), dtype=float)

    def _friction_by_face(self, traction: Array) -> Array:
        """Return the friction force on each face, (faces, k), N."""
        forces = self.model.system.contact.weights[:, None] * traction
        return np.stack([self._by_face(along) for along in forces.T], axis=1)

    def _deepest(self, state: State) -> Array:
        contact = self.model.system.contact
        penetration = contact.penetration_of(state, self.model.system.operators)
        return np.array([penetration[contact.faces == face].max() for face in range(len(contact.face_names))])

    def _frame_acceleration(self, start: float, end: float) -> Array:
        """Return the mean acceleration of the support over an interval, (3,)."""
        total: Array = np.zeros(3)
        for load in self.model.system.loads:
            total = total + frame_mean(load, start, end)
        return total


def frame_mean(load: Load, start: float, end: float) -> Array:
    """Return the mean acceleration that a base motion gives the support over an interval, (3,); 0 for other loads."""
    if load.frame_direction is None or load.frame_mean is None:
        return np.zeros(3)
    return load.frame_direction * (load.frame_mean(start, end) if end > start else load.factor(start))
