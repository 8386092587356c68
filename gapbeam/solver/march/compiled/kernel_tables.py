"""The arrays that kernels march with: system, scheme, state, snapshots, room and records.

Modal coordinates are filled up to whole SIMD lanes with coordinates that never move.

Loops over rows are compiled to work on 16 numbers at a time, and what is left of a row is worked on one by one: rows
of 64 numbers take less time than those of 59.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gapbeam.solver.compilation.jit import shared
from gapbeam.solver.contact.solve.friction_equations import Rubbing
from gapbeam.solver.march.compiled.contact_kernel import Solution
from gapbeam.solver.march.compiled.point_motions import AroundPoints
from gapbeam.solver.system.operators import Array, Indices
from gapbeam.solver.system.slip_modes import SlipModes


class Modal(NamedTuple):
    """The system, all arrays contiguous, rows over the n modal coordinates in whole lanes (`lanes.widened`).

    Attributes:
        squares: s, (n,), 1/s^2.
        damping: C without the dashpots, (n,), 1/s.
        dashpots: beta, (k, n).
        dashpot_factors: c, (k,), 1/s.
        inverse: 1 / A without the dashpots, (n,).
        updates: omega, which with rho take the dashpots into A^-1 = inverse - sum_j rho_j omega_j omega_j^T, (k, n).
        update_factors: rho, (k,).
        gaps: Phi, (m, n), or R, (k, n), where points around rigid sections share its rows.
        initial_gap: g0, (m,), m.
        weights: w, (m,), m^2.
        faces: Face of each point, (m,).
        arms: x of each point, (m,), m.
        across: y and z of the direction in which each point is pressed, (m, 2).
        loads: L, (loads, n).
        driven: 1 for loads that are not static, else 0, (loads,).
        delassus: D = Phi A^-1 Phi^T, (m, m), or R A^-1 R^T, (k, k).
        largest: Largest entry of the diagonal of D, m/N.
        around: Points around rigid sections; None: all points move by themselves.
        friction: Points that rub; None: no point rubs.
    """

    squares: Array
    damping: Array
    dashpots: Array
    dashpot_factors: Array
    inverse: Array
    updates: Array
    update_factors: Array
    gaps: Array
    initial_gap: Array
    weights: Array
    faces: Indices
    arms: Array
    across: Array
    loads: Array
    driven: Array
    delassus: Array
    largest: float
    around: AroundPoints | None
    friction: Rubbing | None


class Scheme(NamedTuple):
    """The step in s, and the numbers of the scheme: `gapbeam.solver.integrators.time_scheme.KernelNumbers`."""

    dt: float
    form: int
    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float


class KernelState(NamedTuple):
    """The state, changed in place.

    Attributes:
        q: (n,).
        v: (n,).
        a: (n,); of no meaning to the midpoint rules.
        depth: (m,), m.
        pressure: (m,), Pa.
        touch_speed: (m,), m/s; of no meaning to laws that do not ask.
        rubbed: Memory of friction: traction, Pa, slip velocity of the step before, m/s, along k directions each, and 1
            where a point slides, (m, 2k + 1); (m, 0) without friction.
    """

    q: Array
    v: Array
    a: Array
    depth: Array
    pressure: Array
    touch_speed: Array
    rubbed: Array


class WallRows(NamedTuple):
    """Walls that move in the steps of a block, all arrays contiguous.

    Attributes:
        loads: Number of the load that each of k motions is, (k,).
        growths: S, by how much a unit of each opens the gaps, (k, m).
        places: w - w(0) at the start of the first step and at the end of each, (steps + 1, k).
        speeds: w' at the same times, (steps + 1, k).
        holes: Middle and clearance of the hole of each station at t = 0, (t, 3), m.
        shifts: Shifts of these by a unit of each motion, (k, t, 3); S is 0 at stations.
    """

    loads: Indices
    growths: Array
    places: Array
    speeds: Array
    holes: Array
    shifts: Array


class Room(NamedTuple):
    """Room of a step: vectors of the DOFs, of the points and of the faces, and the contact solution.

    `opened` is by how much walls have opened the gaps at the end of the step since t = 0, `grown` by how much in the
    step, `opening_speed` how fast they do at its end.
    """

    right: Array
    free: Array
    u_guess: Array
    v_guess: Array
    new_q: Array
    new_v: Array
    stage_velocity: Array
    inner: Array
    held: Array
    held_depth: Array
    guess_depth: Array
    guess_rate: Array
    opened: Array
    grown: Array
    opening_speed: Array
    force: Array
    pressed: Array
    closed: Array
    deepest: Array
    friction: Array
    works: Array
    solution: Solution


class SlidingArrays(NamedTuple):
    """The work of sliding, see `gapbeam.solver.diagnostics.point_contact`; without points where it is not measured.

    Attributes:
        tangents: T in modal coordinates, (m, k, n).
        surface: Rows that give the motion of the surface at each station in a round hole, (t, 4, n).
        work: Work at each point, changed in place, (m,), J.
        parts: Its parts, changed in place, (3, m), J.
        pressed_for: Time that each face has been pressed, changed in place, (faces,), s.
        modes: Limits between the parts.
        rows: Work of each face at the records, (rows, faces), J.
        part_rows: Its parts, (rows, faces, 3), J.
        point_rows: Work of each point at the records, (rows, m), J; (rows, 0): not asked for.
    """

    tangents: Array
    surface: Array
    work: Array
    parts: Array
    pressed_for: Array
    modes: SlipModes
    rows: Array
    part_rows: Array
    point_rows: Array

    def first(self, count: int) -> SlidingArrays:
        """Return the first records."""
        rows = {name: getattr(self, name)[:count] for name in ("rows", "part_rows", "point_rows")}
        return self._replace(**rows)


class SnapshotRoom(NamedTuple):
    """Room for snapshots, one row each.

    Attributes:
        every: Steps between them, counted from the start of the march, (1,); 0: none.
        filled: Rows that are filled, changed in place, (1,).
        steps: Steps since the start of the march, (rows,).
        q: Modal coordinates, (rows, n).
        v: Their rates, (rows, n).
        pressure: Contact pressure, (rows, m), Pa.
    """

    every: Indices
    filled: Indices
    steps: Indices
    q: Array
    v: Array
    pressure: Array


class Records(NamedTuple):
    """Records, one row each; `energies` and `over_time` as in `LedgerArrays`, `iterations` since the last row.

    `levers`, (m, r), is what a force at each point adds to the forces of joints, `turning_levers`, (t, 6, r), what the
    forces at each station in a round hole do, see `Circles.forces`, and `friction_levers`, (m k, r), what friction
    does. In `Modal`, of which every step passes copies on, one array more costs every step half of its time again.
    `impacts` that ended are `listed` in the order of time, (k, 5): face, closing time since the start of the march,
    approach speed, impulse, duration.
    """

    steps: Indices
    q: Array
    v: Array
    force: Array
    moment: Array
    resultant: Array
    friction: Array
    joint_contact: Array
    levers: Array
    turning_levers: Array
    friction_levers: Array
    area: Array
    active: Array
    penetration: Array
    over_time: Array
    impacts: Array
    listed: Indices
    energies: Array
    load_work: Array
    residual: Array
    iterations: Indices
    snapshots: SnapshotRoom
    sliding: SlidingArrays

    def first(self, count: int) -> Records:
        """Return the first records, and all snapshots."""
        columns = [column[:count] for column in self[:-2]]
        return Records._make([*columns, self.snapshots, self.sliding.first(count)])


@shared
def is_due(room: SnapshotRoom, number: int, last: int) -> bool:
    """Return whether there is a snapshot after a step: after multiples, and after the last one of the march."""
    every = room.every[0]
    return bool(every > 0 and (number % every == 0 or number == last))


@shared
def take_snapshot(room: SnapshotRoom, number: int, motion: KernelState) -> None:
    """Keep the state after a step."""
    row = room.filled[0]
    room.steps[row] = number
    for j in range(room.q.shape[1]):
        room.q[row, j], room.v[row, j] = motion.q[j], motion.v[j]
    for i in range(len(motion.pressure)):
        room.pressure[row, i] = motion.pressure[i]
    room.filled[0] = row + 1


LANES = 16  # numbers that a compiled loop works on at a time
MOST_ADDED = 0.2  # of the numbers that there are


def lanes_for(size: int) -> int:
    """Return the length of a kernel's rows for `size` coordinates."""
    whole = -(-size // LANES) * LANES
    return whole if whole <= (1.0 + MOST_ADDED) * size else size


def widened(x: Array) -> Array:
    """Return an array whose last axis, of coordinates, is filled up with zeros to whole lanes."""
    wide = np.zeros((*x.shape[:-1], lanes_for(x.shape[-1])))
    wide[..., : x.shape[-1]] = x
    return wide
