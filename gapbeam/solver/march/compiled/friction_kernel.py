"""Contact with friction in a compiled step: forces along and across the faces by one Newton iteration.

    d = d_held - s G A^-1 (H^T (f - f_held) + T^T h),    f = w P(d)
    v = v_free + c T A^-1 (H^T (f - f_held) + T^T h),    h = -mu <f> v / sqrt(|v|^2 + v0^2)

The linearized laws are those of `solve.friction_solve`. Where friction that hardly slides keeps the iteration in a
cycle, the step is solved with a large v0 first, which then falls to what was given.

G and T are made of a few rows B of the system, r = S B: of a point that does not turn, each motion is a row of its own;
around sections, G is made of the two motions of the axis. The motions of a station in a round hole are made of those of
the axis and of the surface, along the direction of the step:

    along x: the axis, and -R o . its change across,    around: o x the axis, and -R the rotation

Only points that touch, or that the forces would press on, have equations.
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numpy as np

from gapbeam.solver.contact.laws.damper import BREAKS_AWAY, NOTHING, CoulombFriction
from gapbeam.solver.contact.laws.law_tables import ENDPOINT
from gapbeam.solver.contact.laws.point_law import LawTable, numbers_at, stage_pressure
from gapbeam.solver.contact.laws.springs import at_points
from gapbeam.solver.contact.solve.contact_solve import RELATIVE_TOLERANCE, ROUND_OFF
from gapbeam.solver.contact.solve.friction_solve import ENOUGH
from gapbeam.solver.contact.solve.slip_solve import FLATTEST, NEGLIGIBLE
from gapbeam.solver.contact.solve.slip_solve import ROUND_OFF as ROUND_OFF_OF_SLIP
from gapbeam.solver.jit import compiled, compiled_apart
from gapbeam.solver.march.compiled.contact_kernel import Balance, Solution, StepPoints, point_at
from gapbeam.solver.march.compiled.ordered_cholesky import eliminate
from gapbeam.solver.march.compiled.point_motions import (
    AroundPoints,
    add_rows,
    count_in_play,
    fill,
    in_play,
    inner_product,
    turns,
)
from gapbeam.solver.system.operators import Array, Indices

MOST_UPDATES = 25
EASY, HARDER = 2.0**20, 0.25  # v0 at first, relative to v0 of the law, and its factor from one solve to the next


class Rubbing(NamedTuple):
    """Coulomb friction at m points along k directions, and room for a step; of c listed points, each 1 + k forces.

    Attributes:
        rows: B in modal coordinates, (b, n): those of G or R first.
        compliance: B A^-1 B^T, (b, b).
        own: The first row that is for the friction of a point alone, (m,).
        terms: Most rows of B that a motion is made of.
        sliding: Coefficient mu of points that slide, (m,).
        sticking: And of points that stick, (m,).
        slip_velocity: v0, m/s.
        remembers: Whether it matters if points stick.
        points: The points with equations, (m,).
        chosen: Their number c, (1,).
        listed: 1 for these points, (m,).
        parts: The rows of B of each of their motions, (m (1 + k), 3).
        share: And their shares S, (m (1 + k), 3).
        forces: f - f_held and h of each, (m (1 + k),), N.
        missed: By how much they miss their laws, (m (1 + k),), N.
        order: Of them, those that the laws do not give at once, (m (1 + k),).
        right: Right side of their equations, (m (1 + k),).
        matrix: Room for these equations, (m (1 + k), m (1 + k)).
        on_rows: Forces on the rows of B, (b,), N.
        moved: What they make of the motions of B, (b,).
        free: Motions of B in the balance while the forces stay, where they are asked for, (b,), m/s.
        on_face: Friction force on each face, (faces, k), N.
    """

    rows: Array
    compliance: Array
    own: Indices
    terms: int
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


def room_for_friction(
    rows: Array, compliance: Array, own: Indices, terms: int, law: CoulombFriction, on_face: Array
) -> Rubbing:
    """Return friction with room; arguments as in `Rubbing`."""
    points, bodies = len(own), len(rows)
    size = points * (1 + on_face.shape[1])
    sliding, sticking = (at_points(one.coefficient, points) for one in (law, law.of_points(np.zeros(points))))
    return Rubbing(
        rows=rows,
        compliance=compliance,
        own=own,
        terms=terms,
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
        matrix=np.empty((size, size)),
        on_rows=np.zeros(bodies),
        moved=np.zeros(bodies),
        free=np.zeros(bodies),
        on_face=on_face,
    )


@compiled
def coefficient_at(friction: Rubbing, rubbed: Array, point: int) -> float:
    """Return mu of a point in a step: whether it slides stands in the last column of its memory."""
    slides = rubbed[point, rubbed.shape[1] - 1] > 0.0
    mu: float = friction.sliding[point] if slides else friction.sticking[point]
    return mu


@compiled
def nothing_rubs(friction: Rubbing | None) -> None:
    """List no point, and no force."""
    if friction is not None:
        for number in range(friction.chosen[0]):
            friction.listed[friction.points[number]] = 0.0
        friction.chosen[0] = 0
        fill(friction.moved, 0.0)
        fill(friction.on_rows, 0.0)


@compiled
def made_of(friction: Rubbing, row: int, motions: Array) -> float:
    """Return a motion of a listed point, from those of the rows of B, (b,)."""
    total = 0.0
    for term in range(friction.terms):
        total += friction.share[row, term] * motions[friction.parts[row, term]]
    return total


@compiled
def moved_in(friction: Rubbing, row: int, x: Array) -> float:
    """Return a motion of a listed point along modal coordinates, (n,)."""
    total = 0.0
    for term in range(friction.terms):
        if friction.share[row, term] != 0.0:
            total += friction.share[row, term] * inner_product(friction.rows[friction.parts[row, term]], x)
    return total


@compiled
def _slip(friction: Rubbing, row: int, weight: float) -> float:
    """Return the slip velocity of a listed point along a direction, m/s."""
    return made_of(friction, row, friction.free) + weight * made_of(friction, row, friction.moved)


@compiled_apart
def solve_with_friction(
    friction: Rubbing, around: AroundPoints | None, balance: Balance, step: StepPoints, law: LawTable, rubbed: Array,
    velocity: Array, weight: float, found: Solution, most: int, again: bool,
) -> int:  # fmt: skip
    """Solve contact and friction of a step along given directions; return the iterations, -1 where that fails.

    Args:
        friction: Changed in place.
        around: Points around rigid sections; None: others.
        balance: The linear side.
        step: What the law is given.
        law: The contact law.
        rubbed: Memory of the points at the start of the step, see `KernelState`.
        velocity: Of the balance while the forces stay, (n,).
        weight: c, what a unit of T A^-1 (H^T f + T^T h) adds to the slip velocity.
        found: The solution.
        most: Limit of the iterations.
        again: Whether the points have turned since the solution that `friction` has.
    """
    if not again:
        nothing_rubs(friction)
    for number in range(friction.chosen[0]):
        _aim(friction, around, number)
    _list_points(friction, around, balance, step, rubbed, velocity)
    along = friction.on_face.shape[1]
    arguments = (balance, step, law, rubbed, velocity, weight)
    iterations = _iterate(friction, around, arguments, 1.0, found, min(most, MOST_UPDATES))
    spent, ease = abs(iterations), EASY
    if iterations < 0:
        fill(friction.forces, 0.0)
        while iterations < 0 or ease >= 1.0:
            iterations = _iterate(friction, around, arguments, ease, found, most)
            if iterations < 0:
                return -1
            spent, ease = spent + iterations, ease * HARDER
    for number in range(count_in_play(around, len(balance.held))):
        i = in_play(around, number)
        if friction.listed[i] == 0.0:
            found.depth[i] = balance.held_depth[i] - balance.scale * _opened(friction, around, i)
            found.change[i], found.pressure[i], found.elastic[i] = 0.0, 0.0, 0.0
    for number in range(friction.chosen[0]):
        found.change[friction.points[number]] = friction.forces[number * (1 + along)]
    return spent


@compiled
def _list_points(
    friction: Rubbing, around: AroundPoints | None, balance: Balance, step: StepPoints, rubbed: Array, velocity: Array
) -> None:
    """List further points: under pressure, in contact before the step, or where the forces so far lead into contact."""
    along = friction.on_face.shape[1]
    for number in range(count_in_play(around, len(balance.held))):
        i = in_play(around, number)
        if friction.listed[i] > 0.0:
            continue
        known = balance.held[i] != 0.0 or step.old_depth[i] > 0.0 or step.old_pressure[i] != 0.0
        if known or balance.held_depth[i] - balance.scale * _opened(friction, around, i) > 0.0:
            place = friction.chosen[0]
            friction.points[place], friction.listed[i], friction.chosen[0] = i, 1.0, place + 1
            _aim(friction, around, place)
            row = place * (1 + along)
            friction.forces[row] = balance.weights[i] * step.old_pressure[i] if turns(around, i) else 0.0
            for a in range(along):
                friction.forces[row + 1 + a] = balance.weights[i] * rubbed[i, a]
                for term in range(friction.terms):
                    used = friction.parts[row + 1 + a, term]
                    friction.free[used] = inner_product(friction.rows[used], velocity)


@compiled
def _opened(friction: Rubbing, around: AroundPoints | None, point: int) -> float:
    """Return the change of the gap of a point by the forces, over s."""
    opened = 0.0
    if around is None:
        opened += friction.moved[point]
    else:
        for a in range(2):
            opened += around.directions[point, a] * friction.moved[around.pairs[point, a]]
    return opened


@compiled
def _aim(friction: Rubbing, around: AroundPoints | None, number: int) -> None:
    """Set the rows of B that the motions of a listed point are made of, along the direction of the step."""
    i, along = friction.points[number], friction.on_face.shape[1]
    row, own = number * (1 + along), friction.own[friction.points[number]]
    for a in range(1 + along):
        for term in range(3):
            friction.parts[row + a, term] = own
            friction.share[row + a, term] = 0.0
        if a > 0:
            friction.parts[row + a, 0] = own + a - 1
            friction.share[row + a, 0] = 1.0
    if around is None:
        friction.parts[row, 0] = i
        friction.share[row, 0] = 1.0
    else:
        for term in range(2):
            friction.parts[row, term] = around.pairs[i, term]
            friction.share[row, term] = around.directions[i, term]
        if turns(around, i):
            _aim_station(friction, around, row, i)


@compiled
def _aim_station(friction: Rubbing, around: AroundPoints, row: int, point: int) -> None:
    """Set the rows that the slip of a station in a round hole is made of, along its direction, or up where it has none.

    Its motions begin at `row`.
    """
    index, share, own, radius = friction.parts, friction.share, friction.own[point], around.holes[point, 3]
    aside, up, length = around.directions[point, 0], around.directions[point, 1], 0.0
    length += sqrt(aside * aside + up * up)
    aside = aside / length if length > 0.0 else 0.0
    up = up / length if length > 0.0 else 1.0
    for term in range(1, 3):
        index[row + 1, term] = own + term
    share[row + 1, 1] = -radius * aside
    share[row + 1, 2] = -radius * up
    for term in range(2):
        index[row + 2, term] = around.pairs[point, term]
    share[row + 2, 0] = -up
    share[row + 2, 1] = aside
    index[row + 2, 2] = own + 3
    share[row + 2, 2] = -radius


@compiled
def respond(friction: Rubbing) -> None:
    """Set the forces on the rows of B, and what they make of their motions."""
    fill(friction.on_rows, 0.0)
    fill(friction.moved, 0.0)
    for row in range(friction.chosen[0] * (1 + friction.on_face.shape[1])):
        if friction.forces[row] != 0.0:
            for term in range(friction.terms):
                friction.on_rows[friction.parts[row, term]] += friction.share[row, term] * friction.forces[row]
    add_rows(friction.compliance, friction.on_rows, 1.0, friction.moved)


@compiled_apart
def _iterate(
    friction: Rubbing, around: AroundPoints | None,
    arguments: tuple[Balance, StepPoints, LawTable, Array, Array, float], ease: float, found: Solution, most: int,
) -> int:  # fmt: skip
    """Solve from the forces in `friction` with v0 multiplied by `ease`; return the iterations, below 0: it failed."""
    balance, step, law, rubbed, velocity, weight = arguments
    creep, before, before_slip = ease * friction.slip_velocity, np.inf, np.inf
    for iteration in range(most + 1):
        respond(friction)
        _list_points(friction, around, balance, step, rubbed, velocity)
        missed, largest, steepest, deepest = _press(friction, balance, step, law, found)
        if not np.isfinite(missed):
            return -1 - iteration
        missed_slip, limit, fastest, count = _rub(friction, balance, rubbed, weight, creep, found)
        if missed <= ENOUGH * largest and missed_slip <= ENOUGH * limit:
            return iteration
        floor = max(RELATIVE_TOLERANCE * largest, ROUND_OFF * steepest * deepest)
        floor_of_slip = limit * max(RELATIVE_TOLERANCE, ROUND_OFF_OF_SLIP * fastest / creep)
        stalled = missed >= 0.5 * before or missed_slip >= 0.5 * before_slip
        if stalled and missed <= floor and missed_slip <= floor_of_slip:
            return iteration
        before, before_slip = missed, missed_slip
        _linearize(friction, balance, rubbed, weight, creep, found, count, limit)
        if not eliminate(friction.matrix, friction.right, count):
            return -1 - iteration
        for row in range(count):
            friction.forces[friction.order[row]] += friction.right[row]
    return -1 - most


@compiled
def _press(
    friction: Rubbing, balance: Balance, step: StepPoints, law: LawTable, found: Solution
) -> tuple[float, float, float, float]:
    """Evaluate the contact law of listed points.

    Return how far it is missed, N, the largest force, N, stiffness, N/m, and penetration under the forces held, m.
    """
    missed, largest, steepest, deepest, total = 0.0, 0.0, 0.0, 0.0, 0.0
    for number in range(friction.chosen[0]):
        i, row = friction.points[number], number * (1 + friction.on_face.shape[1])
        depth = balance.held_depth[i] - balance.scale * made_of(friction, row, friction.moved)
        force = balance.held[i] + friction.forces[row]
        pressure, slope, elastic = stage_pressure(step.numbers, numbers_at(law, i), point_at(step, law, i), depth)
        found.depth[i], found.pressure[i], found.slope[i], found.elastic[i] = depth, pressure, slope, elastic
        friction.missed[row] = force - balance.weights[i] * pressure
        missed, largest = max(missed, abs(friction.missed[row])), max(largest, abs(force))
        steepest, total = max(steepest, balance.weights[i] * slope), total + abs(friction.missed[row])
        deepest = max(deepest, abs(balance.held_depth[i]))
    return (missed if np.isfinite(total) else np.nan), largest, steepest, deepest


@compiled
def _rub(
    friction: Rubbing, balance: Balance, rubbed: Array, weight: float, creep: float, found: Solution
) -> tuple[float, float, float, int]:
    """Evaluate the law of friction, and order the forces to solve for.

    Return how far it is missed, N, the largest limit of a force, N, the largest free slip, m/s, and their number.
    """
    missed, largest, fastest, count = 0.0, 0.0, 0.0, 0
    along = friction.on_face.shape[1]
    for number in range(friction.chosen[0]):
        i, row = friction.points[number], number * (1 + along)
        force = balance.held[i] + friction.forces[row]
        bound = coefficient_at(friction, rubbed, i) * force if force > NOTHING else 0.0
        square, held = creep * creep, 0.0
        for a in range(1, 1 + along):
            slip = _slip(friction, row + a, weight)
            friction.missed[row + a] = slip  # until all of them are known
            square += slip * slip
            held += abs(friction.forces[row + a])
            fastest = max(fastest, abs(made_of(friction, row + a, friction.free)) if bound > 0.0 else 0.0)
        largest = max(largest, bound)
        for a in range(1, 1 + along):
            friction.missed[row + a] = friction.forces[row + a] + bound * friction.missed[row + a] / sqrt(square)
            missed = max(missed, abs(friction.missed[row + a]))
        if found.slope[i] > 0.0 or friction.missed[row] != 0.0:
            friction.order[count] = row
            count += 1
        if bound > 0.0 or held > 0.0:
            for a in range(1, 1 + along):
                friction.order[count] = row + a
                count += 1
    return missed, largest, fastest, count


@compiled
def _linearize(
    friction: Rubbing, balance: Balance, rubbed: Array, weight: float, creep: float, found: Solution, count: int,
    limit: float,
) -> None:  # fmt: skip
    """Set the equations of the ordered forces; all rows are gaps, m, those of slip over c / s."""
    scale, along, row = balance.scale, friction.on_face.shape[1], 0
    while row < count:
        force = friction.order[row]
        point = friction.points[force // (1 + along)]
        if force % (1 + along) == 0:
            stiffness = balance.weights[point] * found.slope[point]
            _set_row(friction, scale, row, count, stiffness > 0.0)
            softness = 1.0 / stiffness if stiffness > 0.0 else scale * _coupling(friction, force, force)
            friction.matrix[row, row] += softness
            friction.right[row] = -softness * friction.missed[force]
            row += 1
        else:
            mu, normal = coefficient_at(friction, rubbed, point), balance.held[point] + friction.forces[force - 1]
            _set_rows_of_slip(friction, scale, mu, normal, weight, creep, row, count, limit)
            row += along


@compiled
def _coupling(friction: Rubbing, one: int, other: int) -> float:
    """Return the motion of a point under a unit of the force at another."""
    total = 0.0
    for a in range(friction.terms):
        for b in range(friction.terms):
            entry = friction.compliance[friction.parts[one, a], friction.parts[other, b]]
            total += friction.share[one, a] * friction.share[other, b] * entry
    return total


@compiled
def _set_row(friction: Rubbing, scale: float, row: int, count: int, coupled: bool) -> None:
    """Set a row to what the ordered forces do to its motion; to 0 where its force is known."""
    for column in range(count):
        entry = scale * _coupling(friction, friction.order[row], friction.order[column]) if coupled else 0.0
        friction.matrix[row, column] = entry


@compiled
def _set_rows_of_slip(
    friction: Rubbing, scale: float, mu: float, normal: float, weight: float, creep: float, row: int, count: int,
    limit: float,
) -> None:  # fmt: skip
    """Set the rows of a point that rubs: (b J)^-1 (dh + phi mu df) + c T A^-1 (...) = -(b J)^-1 q, over c / s."""
    matrix, right, along, first = friction.matrix, friction.right, friction.on_face.shape[1], friction.order[row]
    bound = mu * normal if normal > NOTHING else 0.0
    rubs = bound > NEGLIGIBLE * limit
    for a in range(along):
        _set_row(friction, scale, row + a, count, rubs)
        if not rubs:
            own = scale * _coupling(friction, first + a, first + a)
            matrix[row + a, row + a], right[row + a] = own, -own * friction.missed[first + a]
    if rubs:
        square, length = creep * creep, 0.0
        for a in range(along):
            slip = _slip(friction, first + a, weight)
            square += slip * slip
            length += friction.forces[first + a] * friction.forces[first + a]
        speed, within = sqrt(square), bound / max(sqrt(length), bound)
        one = _slip(friction, first, weight) / speed
        pulled = -within * friction.forces[first] / bound
        xx, yy, xy, two = 1.0 + FLATTEST - pulled * one, 1.0, 0.0, 0.0
        if along == 2:
            two = _slip(friction, first + 1, weight) / speed
            across = -within * friction.forces[first + 1] / bound
            yy, xy = 1.0 + FLATTEST - across * two, -0.5 * (pulled * two + across * one)
        inverse = scale / weight * speed / bound / (xx * yy - xy * xy)
        column = row - 1 if row > 0 and friction.order[row - 1] == first - 1 else -1
        for a in range(along):
            for b in range(along):
                part = inverse * ((yy if a == 0 else xx) if a == b else -xy)
                matrix[row + a, row + b] += part
                if column >= 0:
                    matrix[row + a, column] += part * mu * (one if b == 0 else two)
                right[row + a] = (right[row + a] if b > 0 else 0.0) - part * friction.missed[first + b]


@compiled
def enter_friction(friction: Rubbing | None, faces: Indices, moves: Array, peaks: Array) -> float:
    """Set the size of the friction force on each face, (faces,), N; return the work that friction took, J.

    Args:
        friction: None: nothing rubs.
        faces: Face of each point, (m,).
        moves: q1 - q0, (n,).
        peaks: Set in place.
    """
    lost = 0.0
    if friction is not None:
        along = friction.on_face.shape[1]
        for face in range(len(peaks)):
            peaks[face] = 0.0
            for a in range(along):
                friction.on_face[face, a] = 0.0
        for number in range(friction.chosen[0]):
            for a in range(along):
                row = number * (1 + along) + 1 + a
                if friction.forces[row] != 0.0:
                    friction.on_face[faces[friction.points[number]], a] += friction.forces[row]
                    lost -= friction.forces[row] * moved_in(friction, row, moves)
        for face in range(len(peaks)):
            for a in range(along):
                peaks[face] += friction.on_face[face, a] * friction.on_face[face, a]
            peaks[face] = sqrt(peaks[face])
    return lost


@compiled
def keep_friction(
    friction: Rubbing | None, form: int, weights: Array, pressure: Array, new_v: Array, stage_velocity: Array,
    rubbed: Array,
) -> None:  # fmt: skip
    """Make what a solved step leaves of friction the memory of the points, see `KernelState`.

    Args:
        friction: None: nothing rubs.
        form: Of the law in the step.
        weights: w, (m,), m^2.
        pressure: Pressure at the end, (m,), Pa.
        new_v: Velocity at the end, (n,).
        stage_velocity: Velocity in the balance, (n,).
        rubbed: The memory, changed in place.
    """
    if friction is not None:
        along = friction.on_face.shape[1]
        for i in range(len(weights)):
            for a in range(along):
                rubbed[i, a] = 0.0
        for number in range(friction.chosen[0]):
            i, row = friction.points[number], number * (1 + along) + 1
            square = friction.slip_velocity * friction.slip_velocity
            for a in range(along):
                if form != ENDPOINT:
                    rubbed[i, a] = friction.forces[row + a] / weights[i]
                elif pressure[i] > NOTHING:
                    rubbed[i, a] = moved_in(friction, row + a, new_v)
                    square += rubbed[i, a] * rubbed[i, a]
            if form == ENDPOINT and pressure[i] > NOTHING:
                share = -coefficient_at(friction, rubbed, i) * pressure[i] / sqrt(square)
                for a in range(along):
                    rubbed[i, a] *= share
        if friction.remembers:
            slowest = (BREAKS_AWAY * friction.slip_velocity) * (BREAKS_AWAY * friction.slip_velocity)
            for i in range(len(weights)):
                now, old, both = 0.0, 0.0, 0.0
                for a in range(along):
                    slip = inner_product(friction.rows[friction.own[i] + a], stage_velocity)
                    before = rubbed[i, along + a]
                    now, old, both = now + slip * slip, old + before * before, both + slip * before
                    rubbed[i, along + a] = slip
                rubbed[i, 2 * along] = 1.0 if now > slowest and old > slowest and both >= 0.0 else 0.0


@compiled
def record_friction(rubbed: Array, weights: Array, faces: Indices, levers: Array, forces: Array, joints: Array) -> None:
    """Record the friction force on each face, (faces, k), N, and add what it adds to the forces of joints, (r,).

    Args:
        rubbed: Memory of the points.
        weights: w, (m,), m^2.
        faces: Face of each point, (m,).
        levers: What a force along each direction adds there, (m k, r).
        forces: The record, 0 before.
        joints: Changed in place.
    """
    along = forces.shape[1]
    for i in range(len(rubbed)):
        for a in range(along):
            force = weights[i] * rubbed[i, a]
            if force != 0.0:
                forces[faces[i], a] += force
                for k in range(len(joints)):
                    joints[k] += levers[along * i + a, k] * force
