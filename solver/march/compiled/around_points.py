"""Contact points around rigid sections, which share the motions of these sections.

    d = -(g0 + Phi q),    Phi = T R,    D = Phi A^-1 Phi^T = T (R A^-1 R^T) T^T

The points around a section that keeps its shape all move by the two motions s = R q of the section across the beam: R
has two rows for each section, and each row of T two entries, the direction c of a point. Products then cost as many
rows as there are sections, and not points; and of the points, only those that may touch in a step are looked at.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gapbeam.solver.system.operators import Array, Indices
from gapbeam.solver.system.semi_discrete import ContactOperator

SAME_PLACE = 1.0e-9  # of the length over which points stand; at one x
SAME_ROWS = 1.0e-10  # of the largest entry; round-off of places
WORTH = 4  # points for each row from which sharing pays


class AroundPoints(NamedTuple):
    """T, the k / 2 sections, and room for a step.

    Attributes:
        pairs: The two rows of R by which each point moves, (m, 2).
        directions: c, (m, 2).
        columns: R^T, (n, k), read faster than R by products of R.
        starts: Where the points of each section begin among the members, (k / 2 + 1,).
        members: The points, section by section, (m,).
        least_gap: The smallest g0 of each section, (k / 2,), m.
        faces: Face of each section, (k / 2,).
        near: The points that may touch in the step, the first `chosen` entries, (m,).
        chosen: How many they are, (1,).
        forces: Room for forces on the rows of R, (k,), N.
        motions: Room for motions of the rows of R, (k,).
        place: s of the state, (k,), m.
        after: s at the end of the step, (k,), m.
        guess: Change of s up to the guess of the scheme, (k,), m.
        rate: Its rate, (k,), m/s.
        free: What the step adds to the guess as long as the contact forces stay, (k,), m.
        bound: How far each section may move in the step, (k / 2,), m.
        pressed: 1 for sections with a point under pressure, else 0, (k / 2,).
    """

    pairs: Indices
    directions: Array
    columns: Array
    starts: Indices
    members: Indices
    least_gap: Array
    faces: Indices
    near: Indices
    chosen: Indices
    forces: Array
    motions: Array
    place: Array
    after: Array
    guess: Array
    rate: Array
    free: Array
    bound: Array
    pressed: Array


def around_points(gaps: Array, contact: ContactOperator) -> tuple[Array, AroundPoints | None]:
    """Return R, and the points around it; Phi and None where hardly any points share their motions, or walls move.

    Args:
        gaps: Phi, (m, n).
        contact: Its points.
    """
    if contact.walls.motions or not contact.support.around:
        return gaps, None
    x, largest = contact.positions[:, 0], float(np.abs(gaps).max())
    members = np.argsort(x, kind="stable")
    breaks = np.flatnonzero(np.diff(x[members]) > SAME_PLACE * np.ptp(x)) + 1
    rows = list[Array]()
    for section in np.split(members, breaks):
        directions = contact.across[section]
        motions = np.linalg.lstsq(directions, gaps[section], rcond=None)[0]
        if np.abs(directions @ motions - gaps[section]).max() > SAME_ROWS * largest:
            return gaps, None
        rows += list(motions)
    if WORTH * len(rows) > len(gaps):
        return gaps, None
    shared, starts, points = np.array(rows), np.array([0, *breaks, len(x)]), len(x)
    numbers = np.empty(points, dtype=np.int64)
    numbers[members] = np.repeat(np.arange(len(starts) - 1), np.diff(starts))
    return shared, AroundPoints(
        pairs=np.stack([2 * numbers, 2 * numbers + 1], axis=1),
        directions=np.ascontiguousarray(contact.across),
        columns=np.ascontiguousarray(shared.T),
        starts=starts.astype(np.int64),
        members=members.astype(np.int64),
        least_gap=np.minimum.reduceat(contact.initial_gap[members], starts[:-1]),
        faces=contact.faces[members[starts[:-1]]].astype(np.int64),
        near=np.zeros(points, dtype=np.int64),
        chosen=np.zeros(1, dtype=np.int64),
        forces=np.zeros(len(rows)),
        motions=np.zeros(len(rows)),
        place=np.zeros(len(rows)),
        after=np.zeros(len(rows)),
        guess=np.zeros(len(rows)),
        rate=np.zeros(len(rows)),
        free=np.zeros(len(rows)),
        bound=np.zeros(len(rows) // 2),
        pressed=np.zeros(len(rows) // 2),
    )
