"""Arrays of a scene as its compiled step sees them: condensed for a step, contacts in slabs, and room to work in."""

from __future__ import annotations

import ctypes
from typing import Any, NamedTuple

import numpy as np

from gapbeam.solver.system.operators import Array


class Linear(NamedTuple):
    """Arrays of a scene condensed for one time step.

    Ports are rows that something acts on or reads: m contact motions, then sensed and acted motions of the feedback,
    then patterns of the loads.

    Attributes:
        weight: (n,) inverse of i0 / h + d0 C + level h K where that is diagonal; else ones, and
        inverse: (n, n) that inverse.
        squares: (n,) squared angular frequencies.
        damping: (1, n) where it is diagonal, or (n, n).
        ports: (p, n).
        answers: (m + outputs, n): velocities of unit forces at contacts and acted motions.
        patterns: (loads, n).
        delassus: (m, m): row j has the velocities of all contact motions for a unit contact force j, feedback included.
        carry: (p - m, m): velocities of the other ports for unit contact forces, feedback included.
        acted: (p, outputs): velocities of the ports for unit feedback forces.
        fed: (outputs, states + 2 inputs): free feedback force of (z, y, v).
        fed_back: (outputs, m): feedback force of a unit contact force.
        states: (states, states + 2 inputs): new states of (z, y, v).
        watch: (watched, n).
        root: (n,): root of the modal mass of a scheme with exact frequencies; else ones.
        scheme: (4, 3): inertia, drag, velocity, acceleration.
    """

    weight: Array
    inverse: Array
    squares: Array
    damping: Array
    ports: Array
    answers: Array
    patterns: Array
    delassus: Array
    carry: Array
    acted: Array
    fed: Array
    fed_back: Array
    states: Array
    watch: Array
    root: Array
    scheme: Array


class Slabs(NamedTuple):
    """Contacts as kernels see them: those of a slab share a touch and a workspace, and are asked in one call.

    Attributes:
        address: (slabs,) of each touch.
        place: (slabs,) address of each workspace.
        start: (slabs + 1,) first contact of each slab.
        motions: (slabs,) 1 or 2.
        motion: (contacts,) first motion of each contact, in the order of the slabs.
        work: (slabs, ROWS, WIDTH // L, L).
        spent: (contacts, L), in the same order: energy lost in each contact so far, by its law and by friction.
        rough: Whether there is friction: then there is no step potential.
        sticks: (slabs,) whether its friction sticks without creep, by Coulomb's own law.
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


class SolveRoom(NamedTuple):
    """Work arrays of the contact solve: of all motions, (m, L), then of those that are closed, and their lists."""

    law: Array
    J: Array
    new: Array
    way: Array
    base: Array
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
    """Work arrays of a step: kernels allocate nothing. `worked` (outputs, L) is the work of the feedback, J."""

    r: Array
    speed: Array
    lag: Array
    u: Array
    free: Array
    y1: Array
    stack: Array
    phi: Array
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
        places: Where contacts are relative to their regions, (steps or 0, motions, lanes), m.
        energies: The ledger, then kinetic and strain energy, (steps or 0, 9, lanes), J.
        works: Work of the feedback since the start, (steps or 0, outputs, lanes), J.
    """

    seen: Array
    felt: Array
    speeds: Array
    places: Array
    energies: Array
    works: Array


def step_records(linear: Linear, steps: int, lanes: int, kept: bool, with_energies: bool) -> StepRecords:
    """Return room for the records of a block of steps: motions and forces, and speeds, places and energies."""
    some, all_ = steps * (kept or with_energies), steps * with_energies
    watched, motions, outputs = len(linear.watch), len(linear.delassus), len(linear.fed)
    sizes = (some, watched), (some, motions), (all_, watched), (all_, motions), (all_, 9), (all_, outputs)
    return StepRecords(*(np.zeros((*size, lanes)) for size in sizes))


def rooms(linear: Linear, contacts: int, lanes: int) -> tuple[Space, SolveRoom]:
    """Return the work arrays of a condensed scene."""
    n, m, outputs, watched = len(linear.squares), len(linear.delassus), len(linear.fed), len(linear.watch)
    sizes = (n, n, n, len(linear.acted), m, m, linear.fed.shape[1], outputs, m, watched, 1, outputs)
    space = Space(*(np.zeros((rows, lanes)) for rows in sizes))
    arrays = (np.zeros((rows, lanes)) for rows in (m, 2 * m, m, m, m, m, 4))
    lists = tuple(np.zeros(count, dtype=np.int64) for count in (contacts, m, m, m, 1))
    whole: tuple[Any, ...] = (*arrays, np.zeros((m, m, lanes)), np.zeros((m, m)), *lists)
    return space, SolveRoom(*whole)


def rest(slabs: Slabs, y: Array, h: float = 1.0) -> tuple[Array, Array, Array]:
    """Ask all contacts for a step of no motion at places y, (motions, lanes).

    Returns:
        Forces (motions, lanes); slopes by the new place, of the first lane, (motions, motions); stored energy (lanes,).
    """
    lanes = y.shape[1]
    F, J, stored = np.zeros_like(y), np.zeros((len(y), len(y))), np.zeros(lanes)
    kind = ctypes.CFUNCTYPE(None, ctypes.c_double, ctypes.c_int64, ctypes.c_void_p)
    for s, w in enumerate(slabs.work):
        d, motions = slabs.motions[s], slabs.motion[slabs.start[s] : slabs.start[s + 1]]
        for c, o in enumerate(motions):
            w[:d, c] = w[2 : 2 + d, c] = y[o : o + d]
        kind(int(slabs.address[s]))(h, int(lanes * len(motions)), int(slabs.place[s]))
        for c, o in enumerate(motions):
            F[o : o + d], stored = w[4 : 4 + d, c], stored + w[10, c]
            for i in range(d):
                J[o + i, o : o + d] = w[6 + 2 * i : 6 + 2 * i + d, c, 0]
    return F, J, stored
