"""Contact of each point at the instants of the records, the work of sliding, and the stress at probes.

With the penetrations d0 and d1 at the records at both ends of an interval dt:

    time in contact = sum of dt where d1 > 0,    load = sum of w P(d0, d1) dt,    deepest = max d

P is the mean pressure of the law over the interval, damping included. The march gives the impulse of a face; its points
share it as they share the load. Where a record is written for every step, first touch and time in contact go by the
rule of the faces, see `gapbeam.solver.diagnostics.march_diagnostics`, and P is the pressure of a step of the discrete
gradient. Contacts that begin and end between two records are not seen.

The work of sliding is the integral of N |v_t| over time at every contact point,

    W = sum over steps of N |s|.

N is the normal force of a point in the balance of a step, s the way that the point moves along its face in the step.
Over the time T it is the work rate W / T. Friction with the coefficient mu takes mu W from the motion of a point that
slides; W itself is measured without friction as well. `gapbeam.solver.system.slip_modes` divides it into impact,
sliding and sticking.

Source: Archard, Journal of Applied Physics 24 (1953) 981, for wear in proportion to W; Pettigrew, Taylor, Fisher,
Yetisir and Smith, Nuclear Engineering and Design 185 (1998) 249, for the work rate.

The stress at probes follows from the displacement gradient in the cells that meet there.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.diagnostics.assumption import PoseRows, PoseScales, axial_stress, deformation
from gapbeam.solver.diagnostics.contact_episodes import Peak, after_forces
from gapbeam.solver.schema.record_table import SLIP_MODES
from gapbeam.solver.system.operators import Array, Indices, Operators
from gapbeam.solver.system.semi_discrete import VALUE, ContactOperator, SemiDiscreteSystem, State, Step
from gapbeam.solver.system.slip_modes import by_mode, impact_share, pressed_after, pressed_span

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
        """Return the impulse of each point, (m,), N s; not a number where no record shows the force on its face.

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
        if contact.circles:
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


@dataclass
class Peaks:
    """Impulse and peaks of every face, and the contact iterations since the last report.

    Attributes:
        contact: Contact operator, which distinguishes the faces.
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


@dataclass
class SlidingWork:
    """Sums over the accepted steps of a march.

    Attributes:
        contact: Contact operator, which distinguishes the faces; its `measures_sliding` says whether anything is
            measured.
        work: W at each point, (m,), J; (0,) where nothing is measured.
        parts: Its parts by `SLIP_MODES`, (3, m), J.
        pressed_for: Time that each face has been pressed, (faces,), s; infinite: since the march began; 0 where nothing
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
        """Return the time that each face is pressed in a step, if a force acts on it, (faces,), s."""
        spans, closing = np.full(len(pressed), step.size), np.flatnonzero(pressed & (self.pressed_for == 0.0))
        if len(closing):
            before = self.contact.penetration_of(step.old, operators)
            depth = self.contact.penetration_of(step.new, operators)
            for face in closing:
                points = self.contact.points_of_faces[face]
                deepest = points[np.argmax(depth[points])]
                spans[face] = pressed_span(0.0, before[deepest], depth[deepest], step.size)
        return spans


@dataclass(frozen=True)
class Gauges:
    """Stress gauges at k probes.

    Attributes:
        rows: Give the gradient at each probe in each cell that holds it.
        scales: Material, and how strain is completed.
        numbers: The probe of each of these points, ascending.
        shares: One over the number of cells that meet at a probe, (k,).
    """

    rows: PoseRows
    scales: PoseScales
    numbers: Indices
    shares: Array

    def stresses(self, u: Array) -> tuple[Array, Array]:
        """Return axial and von Mises stress, (times, k) each, Pa; the gradient is the mean of the cells.

        Args:
            u: Marched DOFs, (times, n).

        Collective.
        """
        gradient = self.rows.poses(u)[1]
        mean = np.zeros((len(u), len(self.shares), *gradient.shape[2:]))
        for cell, probe in enumerate(self.numbers):
            mean[:, probe] += gradient[:, cell] * self.shares[probe]
        return axial_stress(mean, self.scales), deformation(mean, self.scales)[2]
