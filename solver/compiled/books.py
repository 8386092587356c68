"""What is kept of every step, compiled: energy ledger, gates, contact episodes and peaks.

The same sums as in `solver.energy`, `solver.gates`, `solver.episodes` and `solver.output.rows`, in modal coordinates.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from solver.compiled.jit import compiled
from solver.contact.solve import RELATIVE_TOLERANCE, UNRESOLVED
from solver.energy import ROUND_OFF_SAFETY
from solver.episodes import RESOLVING_STEPS
from solver.operators import Array, Indices

# entries of Books.energies, J
(
    KINETIC,
    STRAIN,
    CONTACT,
    START,
    STRUCTURAL,
    CONTACT_LOSS,
    ALGORITHMIC,
    LARGEST_KINETIC,
    ABSOLUTE_WORK,
    ROUND_OFF,
    CONTACT_GAIN,
    FRICTION_LOSS,
) = range(12)
UNKNOWN, CLOSED, OPEN = -1, 0, 1
EPS = float(np.finfo(float).eps)


class Books(NamedTuple):
    """What is kept of every step.

    Attributes:
        energies: The ledger, by the numbers above, (12,), J.
        load_work: Work of each load, (loads,), J.
        impulse: Contact force over time of each face, (faces,), N s.
        deepest: Largest penetration so far of each face, (faces,), m.
        peak_force: Largest contact force so far of each face, (faces,), N.
        face: Whether each face is UNKNOWN, CLOSED or OPEN to the gates, (faces,).
        entry: Energy created, and kinetic and strain energy, when each face closed; NaN: not known, (2, faces), J.
        impacts: Impacts that ended, and how many of them broke the gates, (2,).
        impact_change: Largest relative growth and loss in an impact, (2,).
        episode_steps: Steps of the episode of each face, 0: none, (faces,).
        episode_impulse: Its impulse, (faces,), N s.
        episodes: Episodes that ended, and short ones, (2,).
        episodes_impulse: Their impulse, and that of short ones, (2,), N s.
        solves: Iterations since the last record, of the march, and the most in a step, (3,).
    """

    energies: Array
    load_work: Array
    impulse: Array
    deepest: Array
    peak_force: Array
    face: Indices
    entry: Array
    impacts: Indices
    impact_change: Array
    episode_steps: Indices
    episode_impulse: Array
    episodes: Indices
    episodes_impulse: Array
    solves: Indices


class Limits(NamedTuple):
    """The gates of a case: growth and loss of an impact, growth that ends the march (infinite: none)."""

    impact_growth: float
    impact_loss: float
    total_growth: float


def empty_books(faces: int, loads: int) -> Books:
    """Return books in which nothing is entered."""
    pair = (2,)
    return Books(
        np.zeros(12),
        np.zeros(loads),
        np.zeros(faces),
        np.full(faces, -np.inf),
        np.zeros(faces),
        np.full(faces, UNKNOWN, dtype=np.int64),
        np.full((2, faces), np.nan),
        np.zeros(pair, dtype=np.int64),
        np.zeros(pair),
        np.zeros(faces, dtype=np.int64),
        np.zeros(faces),
        np.zeros(pair, dtype=np.int64),
        np.zeros(pair),
        np.zeros(3, dtype=np.int64),
    )


@compiled
def total_energy(books: Books) -> float:
    """Return T + V + Psi."""
    e = books.energies
    total: float = e[KINETIC] + e[STRAIN] + e[CONTACT]
    return total


@compiled
def residual(books: Books) -> float:
    """Return what is left of the energy balance."""
    e = books.energies
    work = 0.0
    for load in range(len(books.load_work)):
        work += books.load_work[load]
    gained = work - e[STRUCTURAL] - e[CONTACT_LOSS] - e[ALGORITHMIC]
    left: float = (total_energy(books) - e[START]) - (gained - e[FRICTION_LOSS])
    return left


@compiled
def created(books: Books) -> float:
    """Return the energy that came from nowhere."""
    amount: float = residual(books) - books.energies[ALGORITHMIC] + books.energies[CONTACT_GAIN]
    return amount


@compiled
def growth(books: Books) -> float:
    """Return created energy relative to the energy exchanged."""
    e = books.energies
    return _relative(created(books), e[ABSOLUTE_WORK] + e[LARGEST_KINETIC], books)


@compiled
def enter_works(
    books: Books, works: Array, driven: Array, kinetic: float, strain: float, contact: float, structural: float,
    inner: float, elastic_work: float, contact_loss: float,
) -> None:  # fmt: skip
    """Enter the energies after a step and the works during it; see `solver.energy.enter_step`."""
    e = books.energies
    e[ALGORITHMIC] += (inner - (kinetic - e[KINETIC]) - (strain - e[STRAIN])) + elastic_work - (contact - e[CONTACT])
    e[KINETIC], e[STRAIN], e[CONTACT] = kinetic, strain, contact
    absolute = 0.0
    for load in range(len(works)):
        books.load_work[load] += works[load]
        absolute += driven[load] * works[load]
    e[ABSOLUTE_WORK] += abs(absolute)
    e[STRUCTURAL] += structural
    e[CONTACT_LOSS] += contact_loss
    e[CONTACT_GAIN] += max(-contact_loss, 0.0)
    e[LARGEST_KINETIC] = max(e[LARGEST_KINETIC], kinetic)


@compiled
def enter_unresolved(books: Books, largest_depth: float, forces: float) -> None:
    """Enter the work that round-off in the penetration hides, for the sum of the |forces| of a step."""
    books.energies[ROUND_OFF] += UNRESOLVED * largest_depth * forces


@compiled
def enter_round_off(books: Books, squares: Array, q: Array) -> None:
    """Enter what the balance of a state cannot resolve; see `solver.energy.round_off`."""
    total = 0.0
    for j in range(len(q)):
        term = EPS * squares[j] * q[j] * q[j]
        total += term * term
    stored = abs(books.energies[STRAIN]) + books.energies[CONTACT]
    here = ROUND_OFF_SAFETY * np.sqrt(total) + RELATIVE_TOLERANCE * stored
    books.energies[ROUND_OFF] = max(books.energies[ROUND_OFF], here)


@compiled
def enter_forces(books: Books, force: Array, pressed: Array, deepest: Array, dt: float) -> None:
    """Enter contact forces of a step, whether faces were pressed, and the penetration at its end, by face."""
    for face in range(len(force)):
        added = dt * force[face]
        books.impulse[face] += added
        books.peak_force[face] = max(books.peak_force[face], force[face])
        books.deepest[face] = max(books.deepest[face], deepest[face])
        if pressed[face]:
            books.episodes_impulse[0] += added
            books.episode_steps[face] += 1
            books.episode_impulse[face] += added
        elif books.episode_steps[face] > 0:
            books.episodes[0] += 1
            if books.episode_steps[face] < RESOLVING_STEPS:
                books.episodes[1] += 1
                books.episodes_impulse[1] += books.episode_impulse[face]
            books.episode_steps[face] = 0
            books.episode_impulse[face] = 0.0


@compiled
def watch_impacts(books: Books, closed: Array, limits: Limits) -> None:
    """Judge impacts that end with a step; see `EnergyGates`."""
    for face in range(len(closed)):
        now = CLOSED if closed[face] else OPEN
        before = books.face[face]
        if before == UNKNOWN:
            before = now
        if before == OPEN and now == CLOSED:
            books.entry[0, face] = created(books)
            books.entry[1, face] = books.energies[KINETIC] + books.energies[STRAIN]
        elif before == CLOSED and now == OPEN and not np.isnan(books.entry[0, face]):
            books.impacts[0] += 1
            change = _relative(created(books) - books.entry[0, face], books.entry[1, face], books)
            books.impact_change[0] = max(books.impact_change[0], change)
            books.impact_change[1] = max(books.impact_change[1], -change)
            if change > limits.impact_growth or -change > limits.impact_loss:
                books.impacts[1] += 1
            books.entry[0, face] = np.nan
            books.entry[1, face] = np.nan
        books.face[face] = now


@compiled
def _relative(amount: float, energy: float, books: Books) -> float:
    if abs(amount) <= books.energies[ROUND_OFF]:
        return 0.0
    return amount / energy if energy > 0.0 else np.copysign(np.inf, amount)
