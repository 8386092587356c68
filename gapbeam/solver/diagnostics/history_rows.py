"""Instants of a march (motion, contact, ledger) and the records of the history that are made of them.

Motion is relative to supports that move. The reference of that motion is a straight line that follows the supports,

    r(x, t) = sum_k (w_k(t) - w_k(0)) L_k(x),    u_rel = u - r.

L_k(x) is the line of least squares, at x, through the middles of all supports and joints, where the support that the
motion w_k moves is displaced by a unit along its direction and all others are at rest. Supports that move alike give
r = w; a support alone gives r = w, too. A body without inertia that touches two supports follows r.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gapbeam.solver.assembly.assembled_system import model_motions
from gapbeam.solver.case.case import Case
from gapbeam.solver.diagnostics.assumption import PoseWatch
from gapbeam.solver.diagnostics.energy_ledger import restraint_energy
from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.diagnostics.point_contact import Gauges, PointContact, by_face, deepest_by_face, friction_by_face
from gapbeam.solver.diagnostics.statistics.run_statistics import RunStatistics
from gapbeam.solver.loads.attachments import MeanMotion
from gapbeam.solver.loads.load_choice import axis_point, load_direction
from gapbeam.solver.loads.places import SupportWalls
from gapbeam.solver.loads.support_walls import moved_by
from gapbeam.solver.schema.record_table import COMPONENTS, SLIP_MODES, TANGENTS
from gapbeam.solver.system.operators import Array, Load, Reactions
from gapbeam.solver.system.semi_discrete import VALUE, State

if TYPE_CHECKING:
    from gapbeam.solver.models.model import Model


class Instants(NamedTuple):
    """Some instants, row by row; names as in `gapbeam.solver.schema.record_table.HISTORY` and in `Ledger`.

    Attributes:
        times: (times,), s.
        u: DOFs that are marched and that this rank owns, (times, n).
        v: Their velocities, (times, n).
        contact_force: Contact force by face, (times, faces), N.
        contact_moment: (times, faces), N m.
        contact_resultant: Contact force across the beam, y and z, (times, faces, 2), N; None where no face is around
            the beam.
        contact_area: (times, faces), m^2.
        active_points: (times, faces).
        penetration: (times, faces), m.
        impulse: (times, faces), N s.
        contact_time: (times, faces), s.
        closings: (times, faces).
        approach: Sum of the approach speeds of all closings, (times, faces), m/s.
        force_square: Square of the contact force integrated over time, (times, faces), N^2 s.
        friction_force: (times, faces, tangents), N; None: nothing has rubbed.
        joint_contact: Contact's part of the forces of joints, (times, r), N and N m; None: there are no joints.
        sliding_work: (times, faces), J; None: not measured.
        work_by_mode: Its parts, (times, faces, 3), J.
        point_work: Sliding work of each point, (times, m), J; None: not asked for.
        kinetic: (times,), J, like the rest of the ledger.
        strain: Strain energy, with the restraint.
        restraint: Energy in the restraint.
        contact: Potential of the contact.
        load_work: (times, loads).
        structural: Loss in Rayleigh damping.
        contact_loss: Loss in contact damping.
        friction_loss: Loss in friction.
        algorithmic: Loss by the scheme.
        residual: Residual of the balance.
        iterations: Contact iterations since the instant before, (times,).
    """

    times: Array
    u: Array
    v: Array
    contact_force: Array
    contact_moment: Array
    contact_resultant: Array | None
    contact_area: Array
    active_points: Array
    penetration: Array
    impulse: Array
    contact_time: Array
    closings: Array
    approach: Array
    force_square: Array
    friction_force: Array | None
    joint_contact: Array | None
    sliding_work: Array | None
    work_by_mode: Array | None
    point_work: Array | None
    kinetic: Array
    strain: Array
    restraint: Array
    contact: Array
    load_work: Array
    structural: Array
    contact_loss: Array
    friction_loss: Array
    algorithmic: Array
    residual: Array
    iterations: Array


def instant_of(state: State, accounts: Accounts) -> Instants:
    """Return a state with the accounts at its time; the iterations are reported once. Collective."""
    contact, ledger, peaks = accounts.system.contact, accounts.ledger, accounts.peaks
    across = contact.across
    if contact.circles:
        across = contact.at(contact.interface.trace(state.u[VALUE], accounts.system.operators), state.time).across
    forces = contact.weights * state.pressure
    pressed = state.pressure > 0.0
    iterations, peaks.iterations = peaks.iterations, 0
    found = Instants(
        times=np.asarray(state.time),
        u=state.u[VALUE],
        v=state.v[VALUE],
        contact_force=by_face(contact, forces),
        contact_moment=by_face(contact, forces * contact.positions[:, 0]),
        contact_resultant=np.stack([by_face(contact, forces * along) for along in across.T], axis=-1)
        if contact.support.around
        else None,
        contact_area=by_face(contact, np.where(pressed, contact.weights, 0.0)),
        active_points=by_face(contact, pressed.astype(float)),
        penetration=deepest_by_face(contact, state, accounts.system.operators),
        impulse=peaks.impulse,
        contact_time=accounts.times.time,
        closings=accounts.times.closings,
        approach=accounts.impacts.approach.copy(),
        force_square=peaks.square,
        friction_force=None if state.traction is None else friction_by_face(contact, state.traction),
        joint_contact=_joint_contact(accounts, state, forces, across),
        sliding_work=accounts.sliding.by_face,
        work_by_mode=accounts.sliding.parts_by_face,
        point_work=accounts.sliding.work.copy() if contact.maps_sliding else None,
        kinetic=np.asarray(ledger.kinetic),
        strain=np.asarray(ledger.strain),
        restraint=np.asarray(restraint_energy(accounts.system, state)),
        contact=np.asarray(ledger.contact),
        load_work=ledger.load_work,
        structural=np.asarray(ledger.structural),
        contact_loss=np.asarray(ledger.contact_loss),
        friction_loss=np.asarray(ledger.friction_loss),
        algorithmic=np.asarray(ledger.algorithmic),
        residual=np.asarray(ledger.residual),
        iterations=np.asarray(float(iterations)),
    )
    return Instants._make(None if column is None else column[None] for column in found)


def joined(instants: Sequence[Instants]) -> Instants:
    """Return several instants as one table; where some have no friction yet, theirs is none."""
    if len(instants) == 1:
        return instants[0]
    return Instants._make(_joined_columns(columns) for columns in zip(*instants, strict=True))


def _joined_columns(columns: Sequence[Array | None]) -> Array | None:
    known = [column for column in columns if column is not None]
    if not known:
        return None
    return np.concatenate([np.zeros_like(known[0]) if column is None else column for column in columns])


def _joint_contact(accounts: Accounts, state: State, forces: Array, across: Array) -> Array | None:
    """Return the contact's part of the forces of joints in a state, (r,)."""
    reactions, contact = accounts.system.reactions, accounts.system.contact
    if reactions is None:
        return None
    friction = None if state.traction is None else contact.weights[:, None] * state.traction
    circles, at = contact.circles, contact.circles.points
    turned = circles.forces(across[at], forces[at], None if friction is None or not len(at) else friction[at])
    return reactions.of_contact(forces, friction, turned.reshape(-1))


NEAR = 1.0e-9  # of the length of the beam: supports at one place


def support_line(case: Case, places: Sequence[float]) -> Array:
    """Return L, by how much a unit of each motion of walls moves the line at places along the beam, (k, places, d).

    Args:
        case: The case, whose loads are in the order of its motions of walls; d is the dimension of its mesh.
        places: x, m.
    """
    supports, dimension = case.layout.supports, case.mesh.dimension
    x = np.array([*(0.5 * (one.start + one.end) for one in supports), *(joint.point for joint in case.joint)])
    length = case.beam.length
    degree = 1 if np.ptp(x) > NEAR * length else 0
    middle = float(np.mean(x))
    fit = np.linalg.pinv(np.vander((x - middle) / length, degree + 1, increasing=True))
    powers = np.vander((np.asarray(places, dtype=float) - middle) / length, degree + 1, increasing=True)
    follows: Array = np.asarray(powers @ fit, dtype=np.float64)
    found = list[Array]()
    for load in case.load:
        if isinstance(load.place, SupportWalls):
            moved = moved_by(load.place, case.layout)
            share: Array = np.zeros(len(places))
            if moved is not None and not load.place.opens:
                share = follows[:, [one.name for one in supports].index(moved.name)]
            found.append(share[:, None] * np.asarray(load_direction(load, dimension)))
    return np.array(found).reshape(len(found), len(places), dimension)


Rows = dict[str, Array]
BODY_ROWS = ("support_displacement", "support_velocity", "support_force")
TOUCHED = 1.0e-9  # weight of a DOF in what a probe reads; less is round-off of shape functions


@dataclass
class Recorder:
    """Turn instants into records, with sums carried from record to record.

    Attributes:
        case: The case.
        model: Its model.
        watch: Observer of the pose at every record; None: there is none.
        gauges: Gauges, which read the stress at probes; None: no probe asks for it.
        statistics: Collector of the statistics of a random motion; None: there is none.
        points: Collector of the contact of each point; None: there is none.
        largest_restraint_energy: Largest energy in the restraint at a record so far, J.
        largest_energy: Largest kinetic, strain and contact energy together at a record so far, J.
    """

    case: Case
    model: Model
    watch: PoseWatch | None = None
    gauges: Gauges | None = None
    statistics: RunStatistics | None = None
    points: PointContact | None = None
    largest_restraint_energy: float = 0.0
    largest_energy: float = 0.0
    _last_time: float | None = None
    _last_place: Array | None = None
    _last_velocity: Array | None = None

    @cached_property
    def labels(self) -> dict[str, tuple[str, ...]]:
        """Names along the labeled dimensions of the history; tangents are there with friction only."""
        case, model = self.case, self.model
        rubs = model.law.friction is not None
        shifted = any(isinstance(one.place, SupportWalls) and not one.place.opens for one in case.load)
        return {
            "probe": tuple(model.probes),
            "moved_probe": tuple(model.probes) if shifted else (),
            "turned_probe": tuple(model.turned_probes),
            "component": COMPONENTS[model.dimension],
            "face": model.system.contact.face_names,
            "worn_face": model.system.contact.face_names if model.system.contact.measures_sliding else (),
            "slip_mode": SLIP_MODES if model.system.contact.measures_sliding else (),
            "tangent": TANGENTS[model.dimension] if rubs else (),
            "load": tuple(load.name for load in model.system.loads),
            "across": COMPONENTS[3][1:] if case.layout.holes else (),
            "moving": tuple(model.system.loads[one.load].name for one in model.system.contact.walls.motions),
            "support_body": tuple(dict.fromkeys(one.support.name for one in model.bodies)),
            "support_axis": tuple(sorted({one.axis_name for one in model.bodies})),
            "joint": tuple(joint.name for joint in case.joint),
            "translation": self._motions(turns=False),
            "turn": self._motions(turns=True),
            "gauge": tuple(probe.name for probe in case.probe if probe.stress),
        }

    @property
    def restraint_share(self) -> float:
        """Largest energy in the restraint relative to the largest energy."""
        return self.largest_restraint_energy / self.largest_energy if self.largest_energy > 0.0 else 0.0

    def row(self, state: State, accounts: Accounts) -> Rows:
        """Return the record at a state, with a leading axis of one time. Collective."""
        return self.rows(instant_of(state, accounts))

    def rows(self, instants: Instants) -> Rows:
        """Return the records at one or more instants, by name, each with a leading axis of times. Collective."""
        count = len(instants.times)
        found: Rows = {
            "time": instants.times,
            "contact_force": instants.contact_force,
            "contact_moment": instants.contact_moment,
            "contact_area": instants.contact_area,
            "penetration": instants.penetration,
            "impulse": instants.impulse,
            "contact_time": instants.contact_time,
            "closings": instants.closings,
            "kinetic_energy": instants.kinetic,
            "restraint_energy": instants.restraint,
            "strain_energy": instants.strain - instants.restraint,
            "contact_energy": instants.contact,
            "load_work": instants.load_work,
            "structural_dissipation": instants.structural,
            "contact_dissipation": instants.contact_loss,
            "friction_dissipation": instants.friction_loss,
            "algorithmic_dissipation": instants.algorithmic,
            "energy_residual": instants.residual,
            "iterations": instants.iterations,
            "active_points": instants.active_points,
        }
        tangents = self.labels["tangent"]
        if tangents:
            still = np.zeros((count, len(self.labels["face"]), len(tangents)))
            found["friction_force"] = still if instants.friction_force is None else instants.friction_force
        if instants.sliding_work is not None:
            found["sliding_work"] = instants.sliding_work
        if instants.work_by_mode is not None:
            found["work_by_mode"] = instants.work_by_mode
        if self.model.probes:
            found |= self._probe_rows(instants)
        if turned := self.model.turned_probes.values():
            found["rotation"] = np.stack(
                [row.evaluate(instants.u, self.model.system.operators)[..., -1] for row in turned], axis=1
            )
        if self.labels["across"]:
            assert instants.contact_resultant is not None
            found["contact_resultant"] = instants.contact_resultant
        if self.labels["moving"]:
            found["wall_motion"] = self.model.system.contact.walls.places(instants.times)
        if self.model.bodies:
            found |= self._body_rows(instants)
        if self.gauges is not None:
            found["axial_stress"], found["von_mises_stress"] = self.gauges.stresses(instants.u)
        if self.model.system.reactions is not None:
            found |= self._joint_rows(instants, self.model.system.reactions)
        total = instants.kinetic + instants.strain + instants.contact
        self.largest_restraint_energy = max(self.largest_restraint_energy, float(instants.restraint.max()))
        self.largest_energy = max(self.largest_energy, float(total.max()))
        self._last_time = float(instants.times[-1])
        if self.watch is not None:
            self.watch.see(instants.times, instants.u, instants.strain)
        if self.points is not None:
            self.points.see(instants.times, instants.u, instants.v)
        if self.statistics is not None:
            seen = {"approach_speeds": instants.approach, "force_square": instants.force_square}
            if instants.point_work is not None:
                seen["point_work"] = instants.point_work
            self.statistics.labels = self.labels
            self.statistics.see(found | seen)
        return found

    def _body_rows(self, instants: Instants) -> Rows:
        """Return motions of support bodies and the forces under them, 0 along axes on which a body does not move."""
        names, axes = self.labels["support_body"], self.labels["support_axis"]
        found: Rows = {name: np.zeros((len(instants.times), len(names), len(axes))) for name in BODY_ROWS}
        first = instants.u.shape[1] - len(self.model.bodies)
        for number, one in enumerate(self.model.bodies):
            place, speed = instants.u[:, first + number], instants.v[:, first + number]
            force = one.body.stiffness * place + one.body.damping * speed
            at = names.index(one.support.name), axes.index(one.axis_name)
            for name, values in zip(BODY_ROWS, (place, speed, force), strict=True):
                found[name][(slice(None), *at)] = values
        return found

    def _motions(self, turns: bool) -> tuple[str, ...]:
        """Return the motions of cross-sections that joints of the model hold or spring: turns, or displacements."""
        return tuple(name for name in model_motions(self.case) if MeanMotion(0.0, name).turns == turns)

    def _joint_rows(self, instants: Instants, reactions: Reactions) -> Rows:
        """Return the forces and moments of the joints. Collective."""
        system, case = self.model.system, self.case
        assert instants.joint_contact is not None
        factors = system.load_factor_rows(np.atleast_1d(instants.times))
        whole = reactions.total(instants.u, instants.v, factors, instants.joint_contact, system.operators)
        motions = model_motions(case)
        whole = whole.reshape(len(whole), len(case.joint), len(motions))
        turns = np.array([MeanMotion(0.0, name).turns for name in motions])
        return {"joint_force": whole[..., ~turns], "joint_moment": whole[..., turns]}

    def agrees_with(self, time: float, velocity: Array, share: float) -> bool:
        """Return whether the last record is of another time, or of probes that move as in a state then.

        Args:
            time: Time of the state, s.
            velocity: Its velocity, (n,).
            share: Allowed difference of velocities, over the largest.

        Collective.
        """
        if self._last_velocity is None or self._last_time != time:
            return True
        now, kept = (np.where(self._massless, 0.0, of) for of in (self._probes(velocity[None]), self._last_velocity))
        largest = max(float(np.max(np.abs(now), initial=0.0)), float(np.max(np.abs(kept), initial=0.0)))
        return bool(np.all(np.abs(now - kept) <= share * largest))

    @cached_property
    def _massless(self) -> Array:
        """Mask of probes on DOFs without mass, (probes, components): no scheme has their velocity. Collective."""
        operators = self.model.system.operators
        return np.asarray(np.abs(self._probes(operators.massless.astype(float)[None])[0]) > TOUCHED)

    def _probe_rows(self, instants: Instants) -> Rows:
        """Return the motion of the probes; the first record of all has no interval, and no acceleration.

        The velocity of DOFs without mass, which follow from equilibrium, is the mean since the last record.
        """
        first = self._last_time is None
        place, velocity = self._probes(instants.u), self._probes(instants.v)
        ends = instants.times
        starts = np.concatenate([[ends[0] if first else self._last_time], ends[:-1]])
        intervals = (ends - starts)[:, None, None]
        if self._massless.any():
            mean = _rates(place, self._last_place, intervals)
            velocity = np.where(self._massless & (intervals > 0.0), mean, velocity)
        relative = _rates(velocity, self._last_velocity, intervals)
        motion = _frame_means(self.model.system.loads, starts, ends)
        self._last_place, self._last_velocity = place[-1:], velocity[-1:]
        found = {
            "displacement": place,
            "velocity": velocity,
            "acceleration_relative": relative,
            "acceleration_absolute": relative + motion[:, None, : relative.shape[2]],
        }
        if self.labels["moved_probe"]:
            walls = self.model.system.contact.walls
            ran, before = (np.tensordot(walls.speeds(times), self._line, 1) for times in (ends, starts))
            rates = np.divide(ran - before, intervals, out=np.zeros_like(ran), where=intervals > 0.0)
            found |= {
                "displacement_from_supports": place - np.tensordot(walls.places(ends), self._line, 1),
                "velocity_from_supports": velocity - ran,
                "acceleration_from_supports": relative - rates,
            }
        return found

    @cached_property
    def _line(self) -> Array:
        """Shift of the line of the supports at the probes by a unit of each motion of walls, (k, probes, d)."""
        return support_line(self.case, [float(axis_point(probe.point)[0]) for probe in self.case.probe])

    def _probes(self, x: Array) -> Array:
        """Return the motions of the probes for DOFs x, (times, n): (times, probes, components)."""
        operators = self.model.system.operators
        return np.stack([probe.evaluate(x, operators) for probe in self.model.probes.values()], axis=1)


def _rates(values: Array, before: Array | None, intervals: Array) -> Array:
    """Return the change of values from record to record over the intervals; none where an interval is none."""
    change = np.empty_like(values)
    np.subtract(values[0], values[0] if before is None else before[0], out=change[0])
    np.subtract(values[1:], values[:-1], out=change[1:])
    return np.asarray(np.divide(change, intervals, out=np.zeros_like(change), where=intervals > 0.0))


def _frame_means(loads: Sequence[Load], starts: Array, ends: Array) -> Array:
    """Return the mean acceleration of the support by all loads over intervals, (times, 3)."""
    motion = np.zeros((len(ends), 3))
    for load in loads:
        if load.frame_direction is not None and load.mean is not None:
            means = np.where(ends > starts, load.mean(starts, ends), load.factors(starts))
            motion += means[:, None] * load.frame_direction
    return motion
