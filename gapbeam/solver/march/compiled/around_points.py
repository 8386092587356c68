"""Contact points around rigid sections, which share the motions of these sections.

    d = -(g0 + Phi q),    Phi = T R,    D = Phi A^-1 Phi^T = T (R A^-1 R^T) T^T

The points around a section that keeps its shape all move by the two motions s = R q of the section across the beam: R
has two rows for each section, and each row of T two entries, the direction c of a point. Products then cost as many
rows as there are sections, and not points; and of the points, only those that may touch in a step are looked at.

A station in a round hole is one point, whose direction is that of each step (`circle_contact`):

    d = |r| - c,    r = s - m,    c_i = -(r0 + r1) / (|r0| + |r1|)
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
        rows: R, (k, n).
        starts: Where the points of each section begin among the members, (k / 2 + 1,).
        members: The points, section by section, (m,).
        least_gap: The smallest g0 of each section, (k / 2,), m.
        faces: Face of each section, (k / 2,).
        near: The points that may touch in the step, the first `chosen` entries, (m,).
        chosen: Their number, (1,).
        forces: Room for forces on the rows of R, (k,), N.
        motions: Room for motions of the rows of R, (k,).
        place: s of the state, (k,), m.
        after: s at the end of the step, (k,), m.
        guess: Change of s up to the guess of the scheme, (k,), m.
        rate: Its rate, (k,), m/s.
        free: What the step adds to the guess as long as the contact forces stay, (k,), m.
        bound: Largest motion of each section in the step, (k / 2,), m.
        pressed: 1 for sections with a point under pressure, else 0, (k / 2,).
        turning: Points that are stations in round holes, (t,).
        holes: Middle m and clearance c of the hole of each station at the start of the step, the radius of its section,
            and m and c at the end of the step; NaN at points whose directions are fixed, (m, 7), m.
    """

    pairs: Indices
    directions: Array
    rows: Array
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
    turning: Indices
    holes: Array


def around_points(
    gaps: Array, contact: ContactOperator, planes: Array | None = None
) -> tuple[Array, AroundPoints | None]:
    """Return R, and the points around it; Phi and None where hardly any points share their motions, or walls move.

    Stations in round holes are always there, and so are all other points beside them.

    Args:
        gaps: Phi, (m, n).
        contact: Its points.
        planes: The motions of the axes of the stations, (t, 2, n); None: there are none.
    """
    if not contact.support.around or (contact.walls.motions and contact.turning is None):
        return gaps, None
    sections = _sections(gaps, contact, planes)
    if sections is None:
        return gaps, None
    rows = np.concatenate([motions for _, motions in sections])
    if contact.turning is None and WORTH * len(rows) > len(gaps):
        return gaps, None
    starts = np.cumsum([0, *(len(points) for points, _ in sections)])
    members, points = np.concatenate([points for points, _ in sections]), contact.size
    numbers = np.empty(points, dtype=np.int64)
    numbers[members] = np.repeat(np.arange(len(sections)), np.diff(starts))
    circles = contact.turning
    return rows, AroundPoints(
        pairs=np.stack([2 * numbers, 2 * numbers + 1], axis=1),
        directions=np.array(contact.across, order="C"),
        rows=np.ascontiguousarray(rows),
        starts=starts.astype(np.int64),
        members=members.astype(np.int64),
        least_gap=_least_gaps(contact, members, starts),
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
        turning=np.zeros(0, dtype=np.int64) if circles is None else circles.points.astype(np.int64),
        holes=_holes(contact),
    )


def _sections(gaps: Array, contact: ContactOperator, planes: Array | None) -> list[tuple[Indices, Array]] | None:
    """Return the points of each section along the beam, and the two rows by which they move.

    A station is a section of its own. Beside stations, a point that shares no rows has its own; else there are none.
    """
    x, largest = contact.positions[:, 0], float(np.abs(gaps).max())
    members = np.argsort(x, kind="stable")
    apart = np.diff(x[members]) > SAME_PLACE * np.ptp(x)
    stations = dict[int, Array]()
    if planes is not None and contact.turning is not None:
        stations = {int(point): plane for point, plane in zip(contact.turning.points, planes, strict=True)}
        turns = np.isin(members, contact.turning.points)
        apart |= turns[1:] | turns[:-1]
    found = list[tuple[Indices, Array]]()
    for section in np.split(members, np.flatnonzero(apart) + 1):
        if int(section[0]) in stations:
            found.append((section, stations[int(section[0])]))
            continue
        motions = _fitted(contact.across[section], gaps[section])
        if np.abs(contact.across[section] @ motions - gaps[section]).max() <= SAME_ROWS * largest:
            found.append((section, motions))
        elif stations:
            found += [(point, _fitted(contact.across[point], gaps[point])) for point in section[:, None]]
        else:
            return None
    return found


def _fitted(directions: Array, gaps: Array) -> Array:
    """Return the least rows, (2, n), of which directions, (m, 2), make the rows of points, (m, n)."""
    return np.asarray(np.linalg.lstsq(directions, gaps, rcond=None)[0])


def _holes(contact: ContactOperator) -> Array:
    """Return middle, clearance and radius of each station, middle and clearance again, NaN at other points, (m, 7)."""
    found, circles = np.full((contact.size, 7), np.nan), contact.turning
    if circles is not None:
        hole = np.column_stack([circles.middles, circles.clearances])
        found[circles.points] = np.column_stack([hole, circles.radii, hole])
    return found


def _least_gaps(contact: ContactOperator, members: Indices, starts: Indices) -> Array:
    """Return the smallest g0 of each section, (k / 2,), m; of stations whose holes move -inf: they may always touch."""
    gaps = contact.initial_gap.copy()
    if contact.turning is not None and contact.walls.motions:
        gaps[contact.turning.points] = -np.inf
    return np.asarray(np.minimum.reduceat(gaps[members], starts[:-1]))
