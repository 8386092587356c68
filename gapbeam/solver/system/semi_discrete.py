"""Semi-discrete system: the equation of motion with contact.

    M a + C v + K u = sum_k s_k(t) f_k + H^T (w p) + T^T (w t),    C = c_M M + c_K K + dashpots,
    g = g0 + G u + W(t)

G (m x n) takes degrees of freedom to the gap at m contact points, H puts pressures back as forces, w (m) are areas, p
the contact pressure, W by how much walls that move open the gaps (`wall_motion`). H = G but for Nitsche's method, where
both contain the stress (`assembly.contact_assembly`). With friction, T takes degrees of freedom to the motion along the
faces, and t is the tangential traction (`laws.damper`). Finite element models (PETSc) and small dense ones (numpy) are
the same type; integrators, laws and analyses never know which. Vectors are numpy arrays of the part that this rank
owns. Snapshots hold what field files show of a motion at some times.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from gapbeam.solver.supports.support import Face, Support
from gapbeam.solver.system.circles import Circles, no_circles
from gapbeam.solver.system.operators import (
    NO_WALLS,
    Array,
    Indices,
    Interface,
    Load,
    Operators,
    RankOnes,
    Reactions,
    Springs,
    Walls,
    factor_rows_of,
)
from gapbeam.solver.system.slip_modes import ALL_SLIDES, SlipModes

FILLED = 0.25  # of the entries of a matrix, from which products of dense arrays are quicker


@dataclass(frozen=True)
class ContactOperator:
    """G, H, w and g0 at the m contact points, replicated on all ranks.

    Attributes:
        interface: The DOFs that G and H touch.
        gap_matrix: G on the interface DOFs, (m, interface.size).
        weights: Area that belongs to each point, (m,), m^2.
        initial_gap: Gap of the undeformed body, (m,), m.
        faces: Index of the face of each point, (m,).
        support: The support that the faces belong to.
        positions: Coordinates of the points, (m, 3), m.
        force_matrix: H on the interface DOFs, (m, interface.size); None: H = G.
        geometry_matrix: G without the stress of Nitsche's method, (m, interface.size); None: G.
        tangents: T on the interface DOFs, (m k, interface.size): motion along x and (k = 2) across; None: not needed.
        walls: The motion of walls, of gaps since t = 0.
        frictionless: Whether T only measures motion, and no force acts along it.
        measures_sliding: Whether the work of sliding is measured.
        maps_sliding: Whether records have this work of each point, too.
        slip_modes: Limits between impact, sliding and sticking in this work.
    """

    interface: Interface
    gap_matrix: scipy.sparse.csr_matrix
    weights: Array
    initial_gap: Array
    faces: Indices
    support: Support
    positions: Array
    force_matrix: scipy.sparse.csr_matrix | None = None
    geometry_matrix: scipy.sparse.csr_matrix | None = None
    tangents: scipy.sparse.csr_matrix | None = None
    walls: Walls = NO_WALLS
    frictionless: bool = False
    measures_sliding: bool = False
    maps_sliding: bool = False
    slip_modes: SlipModes = ALL_SLIDES

    def __post_init__(self) -> None:
        """Sort the entries of each row, once: a later sort would change the last digits of products."""
        for matrix in (self.gap_matrix, self.force_matrix, self.geometry_matrix, self.tangents):
            if matrix is not None:
                matrix.sum_duplicates()

    @property
    def symmetric(self) -> bool:
        """True where H = G."""
        return self.force_matrix is None

    @property
    def rubbed(self) -> scipy.sparse.csr_matrix | None:
        """T where friction acts along it, (m k, interface.size); None: frictionless."""
        return None if self.frictionless else self.tangents

    @property
    def size(self) -> int:
        """Number of contact points m."""
        return len(self.weights)

    @property
    def area(self) -> float:
        """Area of all faces, m^2."""
        return float(self.weights.sum())

    @cached_property
    def across(self) -> Array:
        """Components y and z of the unit vectors that open the gaps, (m, 2); z is the bending axis of slices, too."""
        return self.support.opening(self.faces, self.positions)[:, 1:]

    @property
    def surfaces(self) -> Array:
        """Area of the beam's surface that each point stands for, (m,), m^2: all around at stations in round holes."""
        return self.weights

    @cached_property
    def circles(self) -> Circles:
        """The stations in round holes, whose directions follow the section: the gradient of |r| - c."""
        return no_circles(self.interface.size)

    def circles_at(self, time: float) -> Circles:
        """Return the stations with their holes where they are at a time."""
        return self.circles.moved(self.walls.places(np.array([time]))[0]) if self.walls.motions else self.circles

    def at(self, interface_values: Array, time: float = 0.0) -> ContactOperator:  # noqa: ARG002
        """Return the operator with the directions that it has in a state: itself where none turns."""
        return self

    def turned(self, opening: Array | None) -> ContactOperator:  # noqa: ARG002
        """Return the operator with other directions of the stations that turn, (k, 2): itself where none does."""
        return self

    def holding(self, forces: Array, interface_values: Array) -> scipy.sparse.csr_matrix:  # noqa: ARG002
        """Return the stiffness that contact forces, (m,), N, add as they turn, (interface.size, interface.size)."""
        return scipy.sparse.csr_matrix((self.interface.size, self.interface.size))

    def spread(self, forces: Array) -> Array:
        """Return the forces at the points where the faces were integrated, N, of f, (m,) or (m, times): often f."""
        return forces

    @property
    def face_names(self) -> tuple[str, ...]:
        """Names of the faces."""
        return self.support.face_names

    @cached_property
    def points_of_faces(self) -> tuple[Indices, ...]:
        """The contact points of each face."""
        return tuple(np.flatnonzero(self.faces == face) for face in range(len(self.face_names)))

    def faces_with(self, chosen: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return True for faces that have one of the chosen contact points, (m,), among theirs, (faces,)."""
        return np.asarray(np.bincount(self.faces, weights=chosen, minlength=len(self.face_names)) > 0.0)

    def added_up(self, sizes: Array) -> Array:
        """Return the sums of the sizes of all terms that penetrations add up, (m,), m: round-off is in proportion.

        Args:
            sizes: Sizes of the interface values, (interface.size,).
        """
        return np.asarray(abs(self.gap_matrix) @ sizes + np.abs(self.initial_gap))

    def with_gaps_of(self, faces: Sequence[Face]) -> ContactOperator:
        """Return the operator of the same faces with other gaps."""
        if tuple(faces) == self.support.faces:
            return self
        support, growth = self.support.with_gaps_of(faces, self.faces, self.positions)
        return replace(self, support=support, initial_gap=self.initial_gap + growth)

    def worn(self, depths: Array) -> ContactOperator:
        """Return the operator with gaps that are larger by depths of the points, (m,), m."""
        return replace(self, initial_gap=self.initial_gap + depths)

    def depth(self, interface_values: Array, time: float = 0.0) -> Array:
        """Return the penetrations at a time, d = -(g0 + G u + W), (m,), m; negative where the gap is open."""
        return np.asarray(-(self.initial_gap + self.gap_matrix @ interface_values) - self.walls.opened(time))

    def closing_speed(self, interface_values: Array, time: float) -> Array:
        """Return d' = -(G v + W'), (m,), m/s, of velocities on the interface DOFs at a time."""
        return np.asarray(-(self.gap_matrix @ interface_values) - self.walls.opening_speed(time))

    def penetration(self, interface_values: Array, time: float = 0.0) -> Array:
        """Return the penetration of the faces themselves at a time, (m,), m: the same except for Nitsche's method."""
        matrix = self.gap_matrix if self.geometry_matrix is None else self.geometry_matrix
        return np.asarray(-(self.initial_gap + matrix @ interface_values) - self.walls.opened(time))

    def penetration_of(self, state: State, operators: Operators) -> Array:
        """Return the penetration of the faces in a state, (m,), m. Collective for Nitsche's method."""
        if self.geometry_matrix is None:
            return state.depth
        return self.penetration(self.interface.trace(state.u[VALUE], operators), state.time)

    def springs(self, stiffness: float | Array) -> Springs:
        """Return G^T (stiffness w) G: springs along the normal of both faces, whether open or closed.

        Args:
            stiffness: One for all contact points, or that of each, (m,), Pa/m.
        """
        matrix = self.gap_matrix if self.geometry_matrix is None else self.geometry_matrix
        return Springs(self.interface, spring_matrix(matrix, stiffness * self.weights))

    def resultant(self, forces: Array, friction: Array | None = None) -> Array:
        """Return H^T f + T^T h on the interface DOFs, (interface.size,), N, for f = w p (m,) and h = w t (m, k)."""
        normal = np.asarray(self.resultants @ forces)
        if friction is None:
            return normal
        return np.asarray(normal + self.friction_resultants @ friction.reshape(-1))

    def slip(self, interface_values: Array) -> Array:
        """Return T x, (m, k): the motion of the contact points along the faces; for operators with tangents."""
        assert self.tangents is not None
        return np.asarray(self.tangents @ interface_values).reshape(self.size, -1)

    @cached_property
    def resultants(self) -> scipy.sparse.csr_matrix:
        """H^T on the interface DOFs, (interface.size, m)."""
        return scipy.sparse.csr_matrix((self.gap_matrix if self.force_matrix is None else self.force_matrix).T)

    @cached_property
    def friction_resultants(self) -> scipy.sparse.csr_matrix:
        """T^T on the interface DOFs, (interface.size, m k); without columns where there is no friction."""
        return scipy.sparse.csr_matrix((self.interface.size, 0) if self.rubbed is None else self.rubbed.T)

    def closing(self, old: State, new: State, operators: Operators) -> Array:
        """Return -(H (u1 - u0) + W1 - W0), (m,), m, on which point forces do work. Collective where H is not G."""
        if self.symmetric:
            return new.depth - old.depth
        moved = self.resultants.T @ self.interface.trace(new.u[VALUE] - old.u[VALUE], operators)
        return np.asarray(-moved - self.walls.grown(old.time, new.time))


def spring_matrix(rows: scipy.sparse.csr_matrix, springs: Array) -> scipy.sparse.csr_matrix:
    """Return R^T diag(s) R of rows R, (m, n), and springs s, (m,), N/m: (n, n)."""
    if rows.nnz > FILLED * rows.shape[0] * rows.shape[1]:
        filled = rows.toarray()
        return scipy.sparse.csr_matrix(filled.T @ (springs[:, None] * filled))
    return scipy.sparse.csr_matrix(rows.T @ rows.multiply(springs[:, None]))


@dataclass(frozen=True)
class SemiDiscreteSystem:
    """M a + C v + K u = f(t) + H^T (w p) + T^T (w t), with C = mass_damping M + stiffness_damping K + dashpots."""

    operators: Operators
    contact: ContactOperator
    loads: tuple[Load, ...] = ()
    mass_damping: float = 0.0
    stiffness_damping: float = 0.0
    dashpots: RankOnes | None = None
    reactions: Reactions | None = None

    @cached_property
    def contact_is_massless(self) -> bool:
        """True where the DOFs that gaps depend on carry no mass, found once. Collective the first time."""
        massless = self.operators.massless[self.contact.interface.owned]
        return bool(self.operators.sum(np.array([float(np.sum(massless))]))[0] > 0.0)

    @cached_property
    def driven(self) -> Array:
        """Mask of the loads that are not static, (loads,): created energy is compared with their work."""
        return np.array([not load.static for load in self.loads], dtype=bool)

    def load_factors(self, time: float) -> Array:
        """Return s_k(t) of all loads."""
        return np.array([load.factor(time) for load in self.loads])

    def load_factor_rows(self, times: Array) -> Array:
        """Return s_k(t) of all loads at many times, (times, loads)."""
        return factor_rows_of(self.loads, times)

    def middle_factors(self, starts: Array, dt: float) -> Array:
        """Return s_k(t) of all loads in the middle of steps of dt, the mean of loads that jump, (steps, loads)."""
        rows = factor_rows_of(self.loads, starts + 0.5 * dt)
        for k, load in enumerate(self.loads):
            if load.mean is not None and load.frame_direction is None and len(starts):
                rows[:, k] = load.mean(starts, starts + dt)
        return rows

    def combine_loads(self, factors: Array) -> Array:
        """Return sum_k s_k f_k, (n,), N."""
        total = np.zeros(self.operators.size)
        for load, factor in zip(self.loads, factors, strict=True):
            if factor != 0.0:
                total += factor * load.pattern
        return total

    def damping_force(self, velocity: Imaged) -> Array:
        """Return C v, (n,), N, of a velocity with its images, (3, n). Collective."""
        force = self.mass_damping * velocity[MASS] + self.stiffness_damping * velocity[STIFFNESS]
        if self.dashpots is not None:
            force += self.dashpots.apply(velocity[VALUE], self.operators)
        return np.asarray(force)

    def dots(self, pairs: Sequence[tuple[Array, Array]]) -> Array:
        """Return several scalar products with a single reduction. Collective."""
        return self.operators.sum(np.array([x @ y for x, y in pairs]))


# An imaged vector: rows x, M x and K x, shape (3, n). Linear combinations of imaged vectors are imaged vectors,
# so that a time step never needs a product with K: K x follows from the equation that x solves.
Imaged = Array
VALUE, MASS, STIFFNESS = 0, 1, 2


def imaged(operators: Operators, x: Array) -> Imaged:
    """Return (x, M x, K x), (3, n), by two products. Collective."""
    return np.stack([x, operators.apply_mass(x), operators.apply_stiffness(x)])


@dataclass(frozen=True, repr=False)
class State:
    """The motion at one time.

    Attributes:
        time: t, s.
        u: Displacement and its images, (3, n).
        v: Velocity and its images, (3, n).
        a: Acceleration and its images, (3, n), for the schemes that carry one.
        lagged: K v as it stood in the last balance of an explicit scheme, (n,), N/s; None: that of v.
        touch_speed: Approach speed of each contact point, frozen while it is closed, (m,), m/s, for the laws that ask.
        depth: Penetration at the contact points, (m,), m.
        pressure: Contact pressure that acted last, (m,), Pa.
        traction: Tangential traction of friction on the beam that acted last, (m, k), Pa; None: none has acted.
        plastic_set: Plastic set of each contact point, (m,), m, for the laws that yield.
        slip: Slip velocity in the balance before, (m, k), m/s, for static friction.
        slides: 1 where a contact point slides, 0 where it sticks, (m,), for static friction.
        closed_since: Time at which each face closed, (faces,), s, infinite while it is open, for adaptive marches.
    """

    time: float
    u: Imaged
    v: Imaged
    depth: Array
    pressure: Array
    a: Imaged | None = None
    touch_speed: Array | None = None
    lagged: Array | None = None
    traction: Array | None = None
    closed_since: Array | None = None
    plastic_set: Array | None = None
    slip: Array | None = None
    slides: Array | None = None

    def __repr__(self) -> str:
        closed = int(np.count_nonzero(self.pressure))
        return f"<State at {self.time:.6g} s: {self.u.shape[-1]} DOFs, {closed} of {len(self.depth)} points pressed>"


class Snapshots(NamedTuple):
    """Some instants, row by row.

    Attributes:
        times: (times,), s.
        u: DOFs that are marched and that this rank owns, (times, n).
        v: Their velocities, (times, n).
        pressure: Contact pressure at all points, (times, m), Pa.
    """

    times: Array
    u: Array
    v: Array
    pressure: Array

    @classmethod
    def of_states(cls, states: Sequence[State]) -> Snapshots:
        """Return the snapshots of one or more states."""
        return cls(
            np.array([state.time for state in states]),
            np.stack([state.u[VALUE] for state in states]),
            np.stack([state.v[VALUE] for state in states]),
            np.stack([state.pressure for state in states]),
        )


@dataclass(frozen=True)
class Stage:
    """Balance of a step, for the energy ledger.

    Attributes:
        load_factors: s_k in the balance.
        inertia_and_elastic: M a + K u as they stood in the balance, (n,), N.
        velocity: Velocity in the damping term, with images, (3, n).
        pressure: Contact pressure in the balance, (m,), Pa.
        elastic_pressure: Its part that derives from the contact potential, (m,), Pa.
        traction: Tangential traction of friction in the balance, (m, k), Pa; None: without friction.
        unresolved: Work of contact forces that round-off in the contact solve hides, J.
        opening: Directions in which the stations in round holes opened their gaps, (k, 2); None: none turn.
    """

    load_factors: Array
    inertia_and_elastic: Array
    velocity: Imaged
    pressure: Array
    elastic_pressure: Array
    traction: Array | None = None
    unresolved: float = 0.0
    opening: Array | None = None


@dataclass(frozen=True, repr=False)
class Step:
    """One accepted step.

    Attributes:
        old: State at its start.
        new: State at its end.
        stage: The balance that held.
        iterations: Iterations of the contact solve.
        completes: False for a part of a halved step that leaves a rest to do.
        failures: Attempts right before it that did not converge and were halved.
        refinements: Attempts right before it that did not resolve the contact and were halved.
        unresolved: Whether it does not resolve the contact either, at the limit of halvings.
        refreshed: `new` with its images formed anew by products with M and K, when that was due.
        timings: Wall time of parts of the step, s.
    """

    old: State
    new: State
    stage: Stage
    iterations: int
    completes: bool = True
    failures: int = 0
    refinements: int = 0
    unresolved: bool = False
    refreshed: State | None = None
    timings: dict[str, float] = field(default_factory=dict)

    @property
    def size(self) -> float:
        """Step size, s."""
        return self.new.time - self.old.time

    def __repr__(self) -> str:
        return f"<Step to {self.new.time:.6g} s: {self.size:.4g} s, {self.iterations} contact iterations>"
