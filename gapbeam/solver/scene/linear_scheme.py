"""Time schemes as data: one step in w = (q1 - q) / h, and one kernel for all of them.

    M a* + C v* + K (q + level h w) = f(t + level h) + B^T F,
    a* = (i0 w + i1 v) / h + i2 a,     v* = d0 w + d1 v + d2 h a,
    q1 = q + h w,     v1 = e0 w + e1 v + e2 h a,     a1 = (g0 w + g1 v) / h + g2 a.

F is the mean of the law over the step (`law` = 0: the discrete gradient), or the law at the level `law` of the step (1:
its end).

With exact frequencies, M and C of a mode are those with which the midpoint rule has the frequency and the decay of its
free motion: with the roots l of l^2 + c l + w^2 and g(x) = x / tanh x, m' = g(l1 h / 2) g(l2 h / 2), which is (x / tan
x)^2, x = w h / 2, without damping, and c' = -m' (s1 + s2), s = 2 / h tanh(l h / 2). Stiffness stays, and so do statics;
m' v'^2 = v^2, so velocities and energies stay those of the motion.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg.lapack

from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.scene.argument_checks import checked
from gapbeam.solver.scene.feedback import FeedbackLoop, aligned
from gapbeam.solver.scene.touch_kernel import FORCE, LAST, NEW, POTENTIAL, SLOPE
from gapbeam.solver.system.operators import Array

ROUND_OFF = 1e-13  # of the mobility of a contact motion
Three = tuple[float, float, float]
LOOKS, GROWN, FAR = 1001, 1e-9, 1e4  # angles that are looked at, growth that is round-off, and the largest angle, rad
RESOLVED = 1.2
"""Half angle of a mode in a step, w h / 2, up to which its frequency is exact; faster modes have the m' of this one."""


class LinearScheme(NamedTuple):
    """Numbers of a scheme; see the module.

    Attributes:
        level: Place within the step at which stiffness and loads are taken.
        law: Place within the step at which contact forces are taken; 0: their mean over the step.
        inertia: i0, i1, i2.
        drag: d0, d1, d2.
        velocity: e0, e1, e2.
        acceleration: g0, g1, g2.
        exact: Whether modes have their exact frequencies.
    """

    level: float
    law: float
    inertia: Three
    drag: Three
    velocity: Three
    acceleration: Three = (0.0, 0.0, 0.0)
    exact: bool = False

    @property
    def is_accelerated(self) -> bool:
        """True where the acceleration is part of the state."""
        return any(self.acceleration)

    @property
    def is_conditional(self) -> bool:
        """True where modes that turn far in a step grow."""
        return bool(growth_of(self, np.array([FAR]))[0] > 1.0 + GROWN)


@checked
def theta(level: float, law: float = 0.0) -> LinearScheme:
    """Return the theta rule: of order 1; level 1/2 is the midpoint rule, of order 2.

    Raises:
        UserError: The level is not within 1/2 and 1, where the rule is stable.
    """
    if not 0.5 <= level <= 1.0:
        raise UserError(f"scheme theta: found level {level!r}, expected 0.5 to 1")
    return LinearScheme(level, law, (1 / level, -1 / level, 0.0), (1.0, 0.0, 0.0), (1 / level, 1 - 1 / level, 0.0))


def alpha(mass: float, force: float, beta: float, gamma: float) -> LinearScheme:
    """Return Newmark's formulas with inertia and forces at levels 1 - mass and 1 - force of the step.

    Source: Chung and Hulbert (1993), J. Appl. Mech. 60, 371, eqs. 1 to 7.
    """
    m, f = 1 - mass, 1 - force
    end = 1 / beta, -1 / beta, 1 - 0.5 / beta
    v = gamma / beta, 1 - gamma / beta, 1 - 0.5 * gamma / beta
    inertia = m * end[0], m * end[1], m * end[2] + mass
    return LinearScheme(f, f, inertia, (f * v[0], f * v[1] + force, f * v[2]), v, end)


def growth_of(scheme: LinearScheme, angles: Array) -> Array:
    """Return the spectral radius of a step of an undamped mode at angles w h.

    Args:
        scheme: The scheme.
        angles: Angles w h of the modes, (modes,), rad.
    """
    found = np.zeros(len(angles))
    for i, x in enumerate(angles):
        row = np.array([x * x, scheme.inertia[1], scheme.inertia[2]]) / -(scheme.inertia[0] + scheme.level * x * x)
        kept = np.array([[1.0, 0.0, 0.0], [0.0, *scheme.velocity[1:]], [0.0, *scheme.acceleration[1:]]])
        step = kept + np.outer([1.0, scheme.velocity[0], scheme.acceleration[0]], row)
        found[i] = np.abs(np.linalg.eigvals(step)).max()
    return found


def check_limit(scheme: LinearScheme, h: float, fastest: float) -> None:
    """Refuse a step beyond the limit of a scheme that has one, such as central differences.

    Args:
        scheme: The scheme.
        h: Step, s.
        fastest: Largest angular frequency of the scene, rad/s.

    Raises:
        UserError: A mode would grow.
    """
    angles: Array = np.asarray(np.linspace(0.0, fastest * h, LOOKS)[1:], dtype=float)
    unstable = np.flatnonzero(growth_of(scheme, angles) > 1.0 + GROWN)
    if unstable.size:
        limit = angles[unstable[0]] / fastest if fastest > 0.0 else 0.0
        raise UserError(
            f"march: the scheme is stable up to about {limit:.3g} s for the fastest mode of {fastest:.4g} "
            f"rad/s, found step {h:g} s; take a smaller step, fewer modes (structure.reduced), or the default scheme"
        )


MIDPOINT = theta(0.5)
"""The default: conserves energy in contact at any step."""


@checked
def midpoint(exact_frequencies: bool = False) -> LinearScheme:
    """Return the midpoint rule, which conserves energy in contact at any step.

    Args:
        exact_frequencies: Whether each mode vibrates at its own frequency at any step; the rule itself lowers it by
            (w h)^2 / 12, relative. Half of the steps then often do. For scenes that march in their modes.
    """
    return MIDPOINT._replace(exact=exact_frequencies)


def exact_modes(squares: Array, drag: Array, h: float) -> tuple[Array, Array]:
    """Return modal mass m' and damping c' of exact frequencies, (n,); see the module."""
    root = np.sqrt(np.asarray(0.25 * drag**2 - squares, dtype=complex))
    ends, g = -0.5 * drag + np.array([[1.0], [-1.0]]) * root, np.ones((2, len(squares)), dtype=complex)
    turn = np.abs(root.imag)
    step = np.minimum(h, 2.0 * RESOLVED / np.where(turn > 0.0, turn, RESOLVED / h))
    x = 0.5 * step * ends
    moving = x != 0.0
    g[moving] = x[moving] / np.tanh(x[moving])
    mass = (g[0] * g[1]).real
    return np.asarray(mass, dtype=float), np.asarray(-mass * (ends / g).sum(0).real, dtype=float)


def euler() -> LinearScheme:
    """Return implicit Euler: of order 1; damps all that a step does not resolve."""
    return theta(1.0, law=1.0)


@checked
def newmark(beta: float = 0.25, gamma: float = 0.5) -> LinearScheme:
    """Return Newmark's scheme. It creates energy in contacts that the step does not resolve.

    Args:
        beta: Parameter beta > 0; below (gamma + 1/2)^2 / 4, marches refuse steps beyond the limit of the fastest mode.
        gamma: Parameter gamma >= 1/2; above 1/2, modes are damped.

    Raises:
        UserError: A number is out of that range.
    """
    if not (beta > 0.0 and gamma >= 0.5):
        raise UserError(f"scheme newmark: found beta {beta!r} and gamma {gamma!r}, expected above 0 and from 1/2 on")
    return alpha(0.0, 0.0, beta, gamma)


@checked
def hht(damping: float = 0.05) -> LinearScheme:
    """Return the scheme of Hilber, Hughes and Taylor; damping, 0 to 1/3, is their -alpha.

    Raises:
        UserError: The damping is out of that range.
    """
    if not 0.0 <= damping <= 1 / 3:
        raise UserError(f"scheme hht: found damping {damping!r}, expected 0 to 1/3")
    return alpha(0.0, damping, (1 + damping) ** 2 / 4, 0.5 + damping)


@checked
def generalized_alpha(rho: float = 0.8) -> LinearScheme:
    """Return the generalized-alpha scheme with a spectral radius at infinite frequency of rho, 0 to 1.

    Raises:
        UserError: rho is out of that range.

    Source: Chung and Hulbert (1993), J. Appl. Mech. 60, 371, eq. 25.
    """
    if not 0.0 <= rho <= 1.0:
        raise UserError(f"scheme generalized_alpha: found rho {rho!r}, expected 0 to 1")
    mass, force = (2 * rho - 1) / (rho + 1), rho / (rho + 1)
    return alpha(mass, force, (1 - mass + force) ** 2 / 4, 0.5 - mass + force)


class Linear(NamedTuple):
    """Arrays of a scene condensed for one time step.

    Ports are rows that something acts on or reads: m contact motions, patterns of the loads, motions of the feedback.

    Attributes:
        weight: (n,) inverse of i0 / h + d0 C + level h K where that is diagonal; else ones, and
        inverse: (n, n) that inverse.
        squares: (n,) squared angular frequencies.
        damping: (1, n) where it is diagonal, or (n, n).
        ports: (m + loads, n).
        answers: (m, n): velocities of unit forces at contacts.
        patterns: (loads, n).
        delassus: (m, m): row j has the velocities of all contact motions for a unit contact force j, feedback included.
        low_rank: (m, k): Q with delassus = Q Q^T; of no columns where that saves nothing.
        carry: (m, p - m + outputs): velocities of the other ports, then feedback forces, for unit contact forces.
        watch: (watched, n).
        root: (n,): root of the modal mass of a scheme with exact frequencies; else ones.
        scheme: (4, 3): inertia, drag, velocity, acceleration.
        feed: The feedback.
    """

    weight: Array
    inverse: Array
    squares: Array
    damping: Array
    ports: Array
    answers: Array
    patterns: Array
    delassus: Array
    low_rank: Array
    carry: Array
    watch: Array
    root: Array
    scheme: Array
    feed: FeedbackLoop


class Slabs(NamedTuple):
    """Contacts as kernels see them: those of a slab share a touch and a workspace, and are asked in one call.

    Attributes:
        address: (slabs,) of each touch.
        place: (slabs,) address of each workspace.
        start: (slabs + 1,) first contact of each slab.
        motions: (slabs,) 1 to 3.
        motion: (contacts,) first motion of each contact, in the order of the slabs.
        work: (slabs, ROWS, WIDTH // L, L).
        spent: (contacts, L), in the same order: energy lost in each contact so far, by its law and by friction.
        rough: Whether there is friction, or a law of impulses: then there is no step potential.
        sticks: (slabs,) whether its friction sticks without creep, by Coulomb's own law.
        settle: (slabs,) address of what its law remembers after a step; 0: nothing.
        kept: (slabs, 2) first row of what its law remembers, and how many.
    """

    address: Any
    place: Any
    start: Any
    motions: Any
    motion: Any
    work: Array
    spent: Array
    rough: bool
    sticks: Any
    settle: Any
    kept: Any

    def memory(self) -> Iterator[Array]:
        """Yield the memory of the laws of each slab, (rows, contacts, L): a part of the workspace."""
        for s, (first, count) in enumerate(self.kept):
            yield self.work[s, first : first + count, : self.start[s + 1] - self.start[s]]


def low_rank_factor(delassus: Array, movable: bool) -> Array:
    """Return Q, (m, k), with delassus = Q Q^T to round-off, by a Cholesky factorization with pivots.

    Q has no columns where the operator may change (`movable`), is not symmetric, or has k of m / 2 or more.
    """
    m = len(delassus)
    none, size = np.zeros((m, 0)), np.sqrt(np.abs(np.diag(delassus)))
    if movable or m < 3:
        return none
    size[size == 0.0] = 1.0
    scaled = delassus / size / size[:, None]
    factor, pivots, rank, _ = scipy.linalg.lapack.dpstrf(scaled, lower=1, tol=ROUND_OFF)
    if 2 * rank >= m:
        return none
    Q = np.empty((m, rank))
    Q[pivots - 1] = np.tril(factor)[:, :rank]
    exact = np.abs(Q @ Q.T - scaled).max() <= ROUND_OFF
    return np.ascontiguousarray(size[:, None] * Q) if exact else none


class SolveRoom(NamedTuple):
    """Work arrays of the contact solve: of all motions, (m, L), then of those that are closed, and their lists."""

    law: Array
    J: Array
    new: Array
    way: Array
    base: Array
    x: Array
    inverse: Array
    line: Array
    A: Array
    D: Array
    flag: Any
    closed: Any
    span: Any
    shut: Any
    size: Any


class Space(NamedTuple):
    """Work arrays of a step: kernels allocate nothing.

    u has velocities of the ports, then feedback forces; `worked` (outputs, L) is the work of the feedback, J.
    """

    r: Array
    speed: Array
    lag: Array
    u: Array
    free: Array
    y1: Array
    stack: Array
    felt: Array
    moved: Array
    place: Array
    lost: Array
    worked: Array


class StepRecords(NamedTuple):
    """Records of the steps of a march; arrays without steps are not kept.

    Attributes:
        seen: Displacements of the watched motions, (steps or 0, watched, lanes), m.
        felt: Contact forces, the mean over the step, (steps or 0, motions, lanes), N.
        speeds: Velocities of the watched motions, likewise, m/s.
        places: Places of contacts relative to their regions, (steps or 0, motions, lanes), m.
        energies: The ledger, then kinetic and strain energy, (steps or 0, 8, lanes), J.
        works: Work of the feedback since the start, (steps or 0, outputs, lanes), J.
    """

    seen: Array
    felt: Array
    speeds: Array
    places: Array
    energies: Array
    works: Array


WINDOW = 8  # steps whose harmonics are summed by one product


class StepSums(NamedTuple):
    """Sums over the steps of a march; it gathers none where no motion is watched and no contact is listed.

    Rows of contacts are followed by those of faces with several contacts, whose force is the sum of theirs.

    Attributes:
        most: Largest displacement in absolute value, (watched, lanes), m.
        square: Sum of squares of displacements.
        top: Largest contact force, (contacts + faces, lanes), N.
        total: Sum of contact forces.
        closed: Steps that touched.
        closings: Number of closings of each contact.
        before: 1 where a contact touched in the step before, else 0.
        whole: Force of each face in the present step, (faces, lanes).
        face: Face of each contact; -1: it stands alone.
        first: First motion of each contact, and their number, (contacts + 1,).
        waves: Sums of displacements times turns, (watched, rows, lanes).
        turns: Cosines and sines of each step of a period, (rows, period).
        window: Displacements of the last steps that are not in `waves` yet, (watched, WINDOW, lanes).
        turned: Their turns, (rows, WINDOW).
        at: Next step within the period, and the next place in the window, (2,).
    """

    most: Array
    square: Array
    top: Array
    total: Array
    closed: Array
    closings: Array
    before: Array
    whole: Array
    face: Any
    first: Any
    waves: Array
    turns: Array
    window: Array
    turned: Array
    at: Any


def step_sums(watched: int, first: Any, face: Any, lanes: int, turns: Array, settled: int) -> StepSums:
    """Return sums of no step, of watched motions and of contacts with these first motions and faces, from a step on."""
    rows, faces = len(turns), int(np.max(face, initial=-1)) + 1
    parts = (np.zeros((count, lanes)) for count in (watched, watched, *5 * [len(face) + faces], faces))
    waves, window = np.zeros((watched, rows, lanes)), np.zeros((watched, WINDOW, lanes))
    at = np.array([settled % max(turns.shape[1], 1), 0])
    whole: tuple[Any, ...] = (
        *parts,
        face,
        first,
        waves,
        np.ascontiguousarray(turns),
        window,
        np.zeros((rows, WINDOW)),
        at,
    )
    return StepSums(*whole)


def step_records(linear: Linear, steps: int, lanes: int, kept: bool, with_energies: bool) -> StepRecords:
    """Return room for the records of a block of steps: motions and forces, and speeds, places and energies."""
    some, all_ = steps * (kept or with_energies), steps * with_energies
    watched, motions, outputs = len(linear.watch), len(linear.delassus), len(linear.feed.acted)
    sizes = (some, watched), (some, motions), (all_, watched), (all_, motions), (all_, 8), (all_, outputs)
    return StepRecords(*(np.zeros((*size, lanes)) for size in sizes))


def rooms(linear: Linear, slabs: Slabs, lanes: int) -> tuple[Space, SolveRoom]:
    """Return the work arrays of a condensed scene.

    A and D take so many closed motions as are solved by their forces: more than twice the columns of the factor of low
    rank are solved by these, unless there is friction, whose slopes are not symmetric.
    """
    n, m, outputs, watched = len(linear.squares), len(linear.delassus), len(linear.feed.acted), len(linear.watch)
    sizes = (n, n, n, linear.feed.acted.shape[1], m, m, linear.feed.stack, outputs, m, watched, 1, outputs)
    space = Space(*(aligned(np.zeros((rows, lanes))) for rows in sizes))
    arrays = (np.zeros((rows, lanes)) for rows in (m, 3 * m, m, m, m, m, m, 4))
    lists = tuple(np.zeros(count, dtype=np.int64) for count in (len(slabs.motion), m, m, m, 1))
    columns = linear.low_rank.shape[1]
    few = m if slabs.rough or not columns else max(2 * columns, 3)
    whole: tuple[Any, ...] = (*arrays, np.zeros((few, few, lanes)), np.zeros((few, few)), *lists)
    return space, SolveRoom(*whole)


def rest(slabs: Slabs, y: Array, h: float = 1.0, end: Array | None = None) -> tuple[Array, Array, Array]:
    """Ask all contacts for a step at rest at places y, (motions, lanes), or to places `end`.

    Returns:
        Forces (motions, lanes); slopes by the new place, of the first lane, (motions, motions); stored energy (lanes,).
    """
    lanes = y.shape[1]
    F, J, stored = np.zeros_like(y), np.zeros((len(y), len(y))), np.zeros(lanes)
    kind = ctypes.CFUNCTYPE(None, ctypes.c_double, ctypes.c_int64, ctypes.c_void_p)
    for s, w in enumerate(slabs.work):
        d, motions = slabs.motions[s], slabs.motion[slabs.start[s] : slabs.start[s + 1]]
        for c, o in enumerate(motions):
            w[:d, c], w[NEW : NEW + d, c] = y[o : o + d], (y if end is None else end)[o : o + d]
            w[LAST : LAST + 3, c] = w[FORCE : FORCE + 3, c] = 0.0  # a slip and a force before
        kind(int(slabs.address[s]))(h, int(lanes * len(motions)), int(slabs.place[s]))
        for c, o in enumerate(motions):
            F[o : o + d], stored = w[FORCE : FORCE + d, c], stored + w[POTENTIAL, c]
            for i in range(d):
                J[o + i, o : o + d] = w[SLOPE + 3 * i : SLOPE + 3 * i + d, c, 0]
    return F, J, stored
