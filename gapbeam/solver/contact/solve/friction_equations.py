"""Equations of the forces in a step with friction, for compiled steps and others.

    d = d_held - s G A^-1 (H^T (f - f_held) + T^T h),    f = w P(d)
    v = v_free + c T A^-1 (H^T (f - f_held) + T^T h),    h = -b phi(v),   b = mu <f>,   phi = v / sqrt(|v|^2 + v0^2)

With the laws missed by r = f - w P and q = h + b phi, an update (df, dh) of Newton's iteration solves

    (w kappa)^-1 df + s G A^-1 (H^T df + T^T dh)                                   = -(w kappa)^-1 r
    (b J)^-1 dh + (b J)^-1 phi mu df + c T A^-1 (H^T df + T^T dh)                  = -(b J)^-1 q
    J = (1 - sym(p phi^T)) / sqrt(|v|^2 + v0^2),    p = -h / b,  |p| <= 1

on the points whose law has a slope kappa, or a limit b > 0. With p = phi this is the tangent of the law, which hardly
sees friction once the point slips; with the p of the forces it is as positive, and a small v0 does no harm.

G and T are made of a few rows B of the system, r = S B, see `RubbingTable`.

Source: Chan, Golub and Mulet (1999), SIAM J. Sci. Comput. 20, 1964-1977, for J.
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numpy as np

from gapbeam.solver.compilation.jit import compiled, entry
from gapbeam.solver.contact.laws.damper import NOTHING, CoulombFriction
from gapbeam.solver.contact.laws.springs import at_points
from gapbeam.solver.contact.solve.contact_solve import EPSILON, RELATIVE_TOLERANCE
from gapbeam.solver.contact.solve.section_solve import SharedMotions, room_for_motions
from gapbeam.solver.system.operators import Array, Indices

ENOUGH = 1.0e-12  # of the largest force
ROUND_OFF = 1.0e-14  # of what cancels in the slip
NEGLIGIBLE = 1.0e-14  # of the largest limit: points that carry nothing
FLATTEST = 1.0e-14  # least slope of the law, relative to 1 / sqrt(|v|^2 + v0^2)
MOST_UPDATES = 25
EASY, HARDER = 2.0**20, 0.25  # v0 at first over the v0 of the law, and the factor by which it changes


class RubbingTable(NamedTuple):
    """The rows of B that the motions of all points are made of; the motion across the face comes first.

    Attributes:
        terms: Most rows that a motion is made of.
        parts: The rows of each motion, (m, 1 + k, 3).
        share: Their shares S, (m, 1 + k, 3).
        own: The first row for the friction of each station in a round hole, (m,); elsewhere it does not matter.
    """

    terms: int
    parts: Indices
    share: Array
    own: Indices


def rows_of_their_own(first: Indices, along: int) -> tuple[Indices, Array]:
    """Return parts and shares where each motion has its own row: the one across, and those along from `first` on."""
    points = len(first)
    parts, share = np.zeros((points, 1 + along, 3), dtype=np.int64), np.zeros((points, 1 + along, 3))
    parts[:, 0, 0], parts[:, 1:, 0], share[:, :, 0] = np.arange(points), first[:, None] + np.arange(along), 1.0
    return parts, share


class Rubbing(NamedTuple):
    """Coulomb friction at m points along k directions, and room for a step; of c listed points, each 1 + k forces.

    Attributes:
        rows: B in modal coordinates, (b, n): those of G or R first.
        compliance: B A^-1 B^T, (b, b).
        table: Rows of B that make up the motions of all points.
        sliding: Coefficient mu of points that slide, (m,).
        sticking: And of points that stick, (m,).
        slip_velocity: v0, m/s.
        remembers: Whether it matters if points stick.
        points: The points with equations, (m,).
        chosen: Their number c, (1,).
        listed: 1 for these points, (m,).
        parts: The rows of B of each of their motions in the step, (m (1 + k), 3).
        share: And their shares S, (m (1 + k), 3).
        forces: f - f_held and h of each, (m (1 + k),), N.
        missed: Residuals of their laws, (m (1 + k),), N.
        order: Numbers of the forces that the laws do not give at once, (m (1 + k),).
        right: Right side of their equations, (m (1 + k),).
        matrix: Room for these equations, (m (1 + k), m (1 + k)), where the compliance is known.
        on_rows: Forces on the rows of B, (b,), N.
        moved: Motions of B under these forces, (b,).
        free: Motions of B in the balance while the forces stay, NaN where none was asked for, (b,), m/s.
        on_face: Friction force on each face, (faces, k), N.
        shared: Room for equations of the motions that points share.
    """

    rows: Array
    compliance: Array
    table: RubbingTable
    sliding: Array
    sticking: Array
    slip_velocity: float
    remembers: bool
    points: Indices
    chosen: Indices
    listed: Array
    parts: Indices
    share: Array
    forces: Array
    missed: Array
    order: Indices
    right: Array
    matrix: Array
    on_rows: Array
    moved: Array
    free: Array
    on_face: Array
    shared: SharedMotions


def room_for_friction(table: RubbingTable, rows: Array, compliance: Array, law: CoulombFriction, faces: int) -> Rubbing:
    """Return friction with room, on so many faces; other arguments as in `Rubbing`."""
    points, motions, _ = table.parts.shape
    size, bodies = points * motions, len(compliance)
    sliding, sticking = (at_points(one.coefficient, points) for one in (law, law.of_points(np.zeros(points))))
    return Rubbing(
        rows=rows,
        compliance=compliance,
        table=table,
        sliding=np.array(sliding, dtype=float),
        sticking=np.array(sticking, dtype=float),
        slip_velocity=law.slip_velocity,
        remembers=law.static_coefficient is not None,
        points=np.zeros(points, dtype=np.int64),
        chosen=np.zeros(1, dtype=np.int64),
        listed=np.zeros(points),
        parts=np.zeros((size, 3), dtype=np.int64),
        share=np.zeros((size, 3)),
        forces=np.zeros(size),
        missed=np.zeros(size),
        order=np.zeros(size, dtype=np.int64),
        right=np.zeros(size),
        matrix=np.empty((size, size) if compliance.size > 0 else (0, 0)),
        on_rows=np.zeros(bodies),
        moved=np.zeros(bodies),
        free=np.zeros(bodies),
        on_face=np.zeros((faces, motions - 1)),
        shared=room_for_motions(bodies if table.terms > 1 else 0),
    )


@compiled
def coefficient_at(friction: Rubbing, rubbed: Array, point: int) -> float:
    """Return mu of a point in a step: whether it slides stands in the last column of its memory."""
    slides = rubbed[point, rubbed.shape[1] - 1] > 0.0
    mu: float = friction.sliding[point] if slides else friction.sticking[point]
    return mu


class PressedPoints(NamedTuple):
    """Points under their contact law: f_held, N, w, m^2, and the slope of the law, Pa/m, (m,) each."""

    held: Array
    weights: Array
    slope: Array


class SlipStep(NamedTuple):
    """Data of the linearized laws, beside the forces.

    Attributes:
        points: The points under their contact law.
        scale: s.
        rubbed: Whether points slide, in its last column, (m, ...).
        weight: c.
        creep: v0, m/s.
        limit: Largest limit of a friction force, N.
    """

    points: PressedPoints
    scale: float
    rubbed: Array
    weight: float
    creep: float
    limit: float


class Missed(NamedTuple):
    """Forces by which contact and friction miss their laws, N; infinite before the first iteration."""

    contact: float
    friction: float


@compiled
def made_of(friction: Rubbing, row: int, motions: Array) -> float:
    """Return a motion of a listed point from the motions of the rows of B, (b,)."""
    total = 0.0
    for term in range(friction.table.terms):
        total += friction.share[row, term] * motions[friction.parts[row, term]]
    return total


@compiled
def coupling(friction: Rubbing, one: int, other: int) -> float:
    """Return the motion of one force for a unit of another."""
    total = 0.0
    for a in range(friction.table.terms):
        for b in range(friction.table.terms):
            entry = friction.compliance[friction.parts[one, a], friction.parts[other, b]]
            total += friction.share[one, a] * friction.share[other, b] * entry
    return total


@compiled
def _slip(friction: Rubbing, row: int, weight: float) -> float:
    """Return the slip velocity of a listed point along a direction, m/s."""
    return made_of(friction, row, friction.free) + weight * made_of(friction, row, friction.moved)


@compiled
def order_forces(
    friction: Rubbing, points: PressedPoints, rubbed: Array, weight: float, creep: float, missed: float,
    largest: float, floor: float, before: Missed,
) -> tuple[int, Missed, float]:  # fmt: skip
    """Evaluate the law of friction, and order the forces to solve for; arguments as in `set_linear_laws`.

    Return their number, -1 where none needs an update, what is missed, and the largest limit of a force, N.
    """
    missed_slip, limit, fastest, heaviest, count = _rub(friction, points, rubbed, weight, creep)
    now = Missed(missed, missed_slip)
    if missed <= ENOUGH * largest and missed_slip <= ENOUGH * limit:
        return -1, now, limit
    left = EPSILON * heaviest  # of forces that let go of those held, and of the friction that they limit
    floor_of_slip = limit * max(RELATIVE_TOLERANCE, ROUND_OFF * fastest / creep, left / max(largest, NOTHING))
    stalled = 0.0 < 0.5 * before.contact <= missed or missed_slip >= 0.5 * before.friction
    if stalled and missed <= max(RELATIVE_TOLERANCE * largest, floor, left) and missed_slip <= floor_of_slip:
        return -1, now, limit
    return count, now, limit


@entry
def set_linear_laws(
    friction: Rubbing, points: PressedPoints, scale: float, rubbed: Array, weight: float, creep: float,
    missed: float, largest: float, floor: float, before: Missed, stiffness: Array, pull: Array,
) -> tuple[int, Missed]:  # fmt: skip
    """Set the linearized laws L x = -r - E z of an update x of all forces, with z their motions for c = s.

    Args:
        friction: Its forces, what they move, and the normal forces by which the contact law is missed are given; what
            is missed along the faces and the order are set.
        points: The points under their contact law.
        scale: s.
        rubbed: Whether points slide, in its last column, (m, ...).
        weight: c.
        creep: v0, m/s.
        missed: Largest force by which the contact law is missed, N.
        largest: Largest contact force, N.
        floor: Round-off of that force due to round-off of the penetration, N.
        before: Residuals before the last update.
        stiffness: E of each point, is set, (m, 1 + k, 1 + k), N/m.
        pull: L - 1 of each point, mu e, is set, (m, k).

    Returns:
        The number of ordered forces, -1 where the forces need no update; and what is missed.
    """
    count, now, limit = order_forces(friction, points, rubbed, weight, creep, missed, largest, floor, before)
    step, along = SlipStep(points, scale, rubbed, weight, creep, limit), friction.on_face.shape[1]
    for point in range(len(stiffness) if count > 0 else 0):
        one, two, xx, yy, xy, _ = law_of_slip(friction, step, point * (1 + along) + 1)
        stiffness[point, 0, 0] = points.weights[point] * points.slope[point]
        stiffness[point, 1, 1], pull[point, 0] = xx, one
        if along == 2:
            stiffness[point, 2, 2], pull[point, 1] = yy, two
            stiffness[point, 1, 2], stiffness[point, 2, 1] = xy, xy
    return count, now


@compiled
def _rub(
    friction: Rubbing, points: PressedPoints, rubbed: Array, weight: float, creep: float
) -> tuple[float, float, float, float, int]:
    """Evaluate the law of friction, and order the forces to solve for.

    Return how far it is missed, N, the largest limit of a force, N, the largest free slip, m/s, the largest force held,
    N, and their number.
    """
    missed, largest, fastest, heaviest, count = 0.0, 0.0, 0.0, 0.0, 0
    along = friction.on_face.shape[1]
    for number in range(friction.chosen[0]):
        i, row = friction.points[number], number * (1 + along)
        force = points.held[i] + friction.forces[row]
        bound = coefficient_at(friction, rubbed, i) * force if force > NOTHING else 0.0
        square, held = creep * creep, 0.0
        for a in range(1, 1 + along):
            slip = _slip(friction, row + a, weight)
            friction.missed[row + a] = slip  # until all of them are known
            square += slip * slip
            held += abs(friction.forces[row + a])
            fastest = max(fastest, abs(made_of(friction, row + a, friction.free)) if bound > 0.0 else 0.0)
        largest, heaviest = max(largest, bound), max(heaviest, abs(points.held[i]))
        for a in range(1, 1 + along):
            friction.missed[row + a] = friction.forces[row + a] + bound * friction.missed[row + a] / sqrt(square)
            missed = max(missed, abs(friction.missed[row + a]))
        if points.slope[i] > 0.0 or friction.missed[row] != 0.0:
            friction.order[count] = row
            count += 1
        if bound > 0.0 or held > 0.0:
            for a in range(1, 1 + along):
                friction.order[count] = row + a
                count += 1
    return missed, largest, fastest, heaviest, count


@compiled
def law_of_slip(friction: Rubbing, step: SlipStep, first: int) -> tuple[float, float, float, float, float, float]:
    """Return the linearized law of friction of a point, whose forces along the face begin at `first`.

    dh = -q - mu e df - b J dz, with dz the motions for c = s: mu e along both directions, and the entries xx, yy, xy
    of b J; all of them 0 where the point does not rub.
    """
    along = friction.on_face.shape[1]
    point = friction.points[first // (1 + along)]
    mu, normal = coefficient_at(friction, step.rubbed, point), step.points.held[point] + friction.forces[first - 1]
    bound = mu * normal if normal > NOTHING else 0.0
    if bound <= NEGLIGIBLE * step.limit:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    square, length = step.creep * step.creep, 0.0
    for a in range(along):
        moved = _slip(friction, first + a, step.weight)
        square += moved * moved
        length += friction.forces[first + a] * friction.forces[first + a]
    speed, within = sqrt(square), bound / max(sqrt(length), bound)
    one = _slip(friction, first, step.weight) / speed
    pulled = -within * friction.forces[first] / bound
    xx, yy, xy, two = 1.0 + FLATTEST - pulled * one, 1.0, 0.0, 0.0
    if along == 2:
        two = _slip(friction, first + 1, step.weight) / speed
        across = -within * friction.forces[first + 1] / bound
        yy, xy = 1.0 + FLATTEST - across * two, -0.5 * (pulled * two + across * one)
    factor = step.weight / step.scale * bound / speed
    return mu * one, mu * two, factor * xx, factor * yy, factor * xy, 1.0


@compiled
def linearize(friction: Rubbing, step: SlipStep, count: int) -> None:
    """Set the equations of the ordered forces; all rows are gaps, m, those of slip over c / s."""
    along, row, scale, points = friction.on_face.shape[1], 0, step.scale, step.points
    while row < count:
        force = friction.order[row]
        point = friction.points[force // (1 + along)]
        if force % (1 + along) == 0:
            stiffness = points.weights[point] * points.slope[point]
            _set_row(friction, scale, row, count, stiffness > 0.0)
            softness = 1.0 / stiffness if stiffness > 0.0 else scale * coupling(friction, force, force)
            friction.matrix[row, row] += softness
            friction.right[row] = -softness * friction.missed[force]
            row += 1
        else:
            _set_rows_of_slip(friction, step, row, count)
            row += along


@compiled
def _set_row(friction: Rubbing, scale: float, row: int, count: int, coupled: bool) -> None:
    """Set a row to the effect of the ordered forces on its motion; to 0 where its force is known."""
    for column in range(count):
        entry = scale * coupling(friction, friction.order[row], friction.order[column]) if coupled else 0.0
        friction.matrix[row, column] = entry


@compiled
def _set_rows_of_slip(friction: Rubbing, step: SlipStep, row: int, count: int) -> None:
    """Set the rows of a point that rubs: (b J)^-1 (dh + mu e df) + c T A^-1 (...) = -(b J)^-1 q, over c / s."""
    matrix, right, along, first = friction.matrix, friction.right, friction.on_face.shape[1], friction.order[row]
    one, two, xx, yy, xy, rubs = law_of_slip(friction, step, first)
    for a in range(along):
        _set_row(friction, step.scale, row + a, count, rubs > 0.0)
        if rubs == 0.0:
            own = step.scale * coupling(friction, first + a, first + a)
            matrix[row + a, row + a], right[row + a] = own, -own * friction.missed[first + a]
    if rubs > 0.0:
        inverse = 1.0 / (xx * yy - xy * xy) if along == 2 else 1.0 / xx
        column = row - 1 if row > 0 and friction.order[row - 1] == first - 1 else -1
        for a in range(along):
            for b in range(along):
                part = inverse * (((yy if a == 0 else xx) if a == b else -xy) if along == 2 else 1.0)
                matrix[row + a, row + b] += part
                if column >= 0:
                    matrix[row + a, column] += part * (one if b == 0 else two)
                right[row + a] = (right[row + a] if b > 0 else 0.0) - part * friction.missed[first + b]
