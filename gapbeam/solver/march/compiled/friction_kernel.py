"""Contact with friction in a compiled step: forces along and across the faces by one Newton iteration.

    d = d_held - s G A^-1 (H^T (f - f_held) + T^T h),    f = w P(d)
    v = v_free + c T A^-1 (H^T (f - f_held) + T^T h),    h = -mu <f> v / sqrt(|v|^2 + v0^2)

The linearized laws are those of `solve.friction_solve`. Where friction that hardly slides keeps the iteration in a
cycle, the step is solved with a large v0 first, which then falls to what was given.
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numpy as np

from gapbeam.solver.contact.laws.damper import BREAKS_AWAY, NOTHING
from gapbeam.solver.contact.laws.law_tables import ENDPOINT
from gapbeam.solver.contact.laws.point_law import LawTable, numbers_at, stage_pressure
from gapbeam.solver.contact.solve.contact_solve import RELATIVE_TOLERANCE, ROUND_OFF
from gapbeam.solver.contact.solve.friction_solve import ENOUGH
from gapbeam.solver.contact.solve.slip_solve import FLATTEST, NEGLIGIBLE
from gapbeam.solver.contact.solve.slip_solve import ROUND_OFF as ROUND_OFF_OF_SLIP
from gapbeam.solver.jit import compiled, compiled_apart
from gapbeam.solver.march.compiled.contact_kernel import Balance, Solution, StepPoints, point_at
from gapbeam.solver.march.compiled.ordered_cholesky import eliminate
from gapbeam.solver.march.compiled.point_motions import add_rows, fill, inner_product, set_products
from gapbeam.solver.system.operators import Array, Indices

MOST_UPDATES = 25
EASY, HARDER = 2.0**20, 0.25  # v0 at first, relative to that of the law, and by how much it changes at a time


class Rubbing(NamedTuple):
    """Coulomb friction at m points along k directions, and room for a step.

    Attributes:
        tangents: T in modal coordinates, (m k, n).
        compliance: [G; T] A^-1 [G; T]^T, (m + m k, m + m k).
        sliding: Coefficient mu of points that slide, (m,).
        sticking: And of points that stick, (m,).
        slip_velocity: v0, m/s.
        remembers: Whether it matters if points stick.
        free: v_free, (m k,), m/s.
        forces: f - f_held and h, (m + m k,), N.
        moved: What they make of all motions, (m + m k,).
        missed: By how much forces miss their laws, (m + m k,), N.
        order: The forces that the laws do not give at once, (m + m k,).
        matrix: Room for their equations, (m + m k, m + m k).
        right: Their right side, (m + m k,).
        on_face: Friction force on each face, (faces, k), N.
    """

    tangents: Array
    compliance: Array
    sliding: Array
    sticking: Array
    slip_velocity: float
    remembers: bool
    free: Array
    forces: Array
    moved: Array
    missed: Array
    order: Indices
    matrix: Array
    right: Array
    on_face: Array


def room_for_friction(
    tangents: Array, compliance: Array, coefficients: tuple[Array, Array], slip_velocity: float, remembers: bool,
    faces: int,
) -> Rubbing:  # fmt: skip
    """Return friction with room; arguments as in `Rubbing`, coefficients of points that slide and that stick."""
    size, points = len(compliance), len(coefficients[0])
    vectors = np.zeros((4, size))
    return Rubbing(
        tangents=tangents,
        compliance=compliance,
        sliding=coefficients[0],
        sticking=coefficients[1],
        slip_velocity=slip_velocity,
        remembers=remembers,
        free=np.zeros(len(tangents)),
        forces=vectors[0],
        moved=vectors[1],
        missed=vectors[2],
        order=np.zeros(size, dtype=np.int64),
        matrix=np.empty((size, size)),
        right=vectors[3],
        on_face=np.zeros((faces, len(tangents) // points)),
    )


@compiled
def coefficient_at(friction: Rubbing, rubbed: Array, point: int) -> float:
    """Return mu of a point in a step: whether it slides stands in the last column of its memory."""
    slides = rubbed[point, rubbed.shape[1] - 1] > 0.0
    mu: float = friction.sliding[point] if slides else friction.sticking[point]
    return mu


@compiled_apart
def solve_with_friction(
    friction: Rubbing, balance: Balance, step: StepPoints, law: LawTable, rubbed: Array, weight: float,
    found: Solution, most: int,
) -> int:  # fmt: skip
    """Solve contact and friction of a step into `found` and `friction`; return the iterations, -1 where that fails.

    Args:
        friction: With v_free.
        balance: The linear side.
        step: What the law is given.
        law: The contact law.
        rubbed: Memory of the points at the start of the step, see `KernelState`.
        weight: c, what a unit of T A^-1 (H^T f + T^T h) adds to the slip velocity.
        found: The solution.
        most: Limit of the iterations.
    """
    points = len(balance.held)
    along = len(friction.free) // points
    for i in range(points):
        friction.forces[i] = 0.0
        for a in range(along):
            friction.forces[points + along * i + a] = balance.weights[i] * rubbed[i, a]
    iterations = _iterate(friction, balance, step, law, rubbed, weight, 1.0, found, min(most, MOST_UPDATES))
    spent, ease = abs(iterations), EASY
    if iterations < 0:
        fill(friction.forces, 0.0)
        while iterations < 0 or ease >= 1.0:
            iterations = _iterate(friction, balance, step, law, rubbed, weight, ease, found, most)
            if iterations < 0:
                return -1
            spent, ease = spent + iterations, ease * HARDER
    for i in range(points):
        found.change[i] = friction.forces[i]
    return spent


@compiled_apart
def _iterate(
    friction: Rubbing, balance: Balance, step: StepPoints, law: LawTable, rubbed: Array, weight: float, ease: float,
    found: Solution, most: int,
) -> int:  # fmt: skip
    """Solve from the forces in `friction` with v0 multiplied by `ease`; return the iterations, below 0: it failed."""
    points, creep = len(balance.held), ease * friction.slip_velocity
    before, before_slip = np.inf, np.inf
    for iteration in range(most + 1):
        fill(friction.moved, 0.0)
        add_rows(friction.compliance, friction.forces, 1.0, friction.moved)
        missed, largest, steepest = _press(friction, balance, step, law, found)
        if not np.isfinite(missed):
            return -1 - iteration
        missed_slip, limit, fastest, count = _rub(friction, balance, rubbed, weight, creep, found)
        if missed <= ENOUGH * largest and missed_slip <= ENOUGH * limit:
            return iteration
        deepest = 0.0
        for i in range(points):
            deepest = max(deepest, abs(balance.held_depth[i]))
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
) -> tuple[float, float, float]:
    """Evaluate the contact law; return how far it is missed, N, the largest force, N, and stiffness, N/m."""
    missed, largest, steepest, total = 0.0, 0.0, 0.0, 0.0
    for i in range(len(balance.held)):
        depth = balance.held_depth[i] - balance.scale * friction.moved[i]
        force = balance.held[i] + friction.forces[i]
        found.depth[i] = depth
        pressure, slope, elastic = 0.0, 0.0, 0.0
        if depth > 0.0 or step.old_depth[i] > 0.0 or balance.held[i] != 0.0 or force != 0.0:
            pressure, slope, elastic = stage_pressure(step.numbers, numbers_at(law, i), point_at(step, law, i), depth)
        found.pressure[i], found.slope[i], found.elastic[i] = pressure, slope, elastic
        friction.missed[i] = force - balance.weights[i] * pressure
        missed, largest = max(missed, abs(friction.missed[i])), max(largest, abs(force))
        steepest, total = max(steepest, balance.weights[i] * slope), total + abs(friction.missed[i])
    return (missed if np.isfinite(total) else np.nan), largest, steepest


@compiled
def _rub(
    friction: Rubbing, balance: Balance, rubbed: Array, weight: float, creep: float, found: Solution
) -> tuple[float, float, float, int]:
    """Evaluate the law of friction, and list the forces to solve for.

    Return how far it is missed, N, the largest limit of a force, N, the largest free slip, m/s, and their number.
    """
    points, missed, largest, fastest, count = len(balance.held), 0.0, 0.0, 0.0, 0
    along = len(friction.free) // points
    for i in range(points):
        force, first = balance.held[i] + friction.forces[i], points + along * i
        bound = coefficient_at(friction, rubbed, i) * force if force > NOTHING else 0.0
        square, held = creep * creep, 0.0
        for a in range(along):
            slip = friction.free[along * i + a] + weight * friction.moved[first + a]
            square += slip * slip
            held += abs(friction.forces[first + a])
        largest = max(largest, bound)
        for a in range(along):
            slip = friction.free[along * i + a] + weight * friction.moved[first + a]
            friction.missed[first + a] = friction.forces[first + a] + bound * slip / sqrt(square)
            missed = max(missed, abs(friction.missed[first + a]))
            fastest = max(fastest, abs(friction.free[along * i + a]) if bound > 0.0 else 0.0)
        if found.slope[i] > 0.0 or friction.missed[i] != 0.0:
            friction.order[count] = i
            count += 1
        if bound > 0.0 or held > 0.0:
            for a in range(along):
                friction.order[count] = first + a
                count += 1
    return missed, largest, fastest, count


@compiled
def _linearize(
    friction: Rubbing, balance: Balance, rubbed: Array, weight: float, creep: float, found: Solution, count: int,
    limit: float,
) -> None:  # fmt: skip
    """Set the equations of the listed forces; all rows are gaps, m, those of slip over c / s."""
    points, scale, order = len(balance.held), balance.scale, friction.order
    along = len(friction.free) // points
    row = 0
    while row < count:
        force = order[row]
        if force < points:
            stiffness = balance.weights[force] * found.slope[force]
            _set_row(friction, scale, row, count, stiffness > 0.0)
            softness = 1.0 / stiffness if stiffness > 0.0 else scale * friction.compliance[force, force]
            friction.matrix[row, row] += softness
            friction.right[row] = -softness * friction.missed[force]
            row += 1
        else:
            point = (force - points) // along
            _set_rows_of_slip(friction, balance, rubbed, weight, creep, row, count, point, limit)
            row += along


@compiled
def _set_row(friction: Rubbing, scale: float, row: int, count: int, coupled: bool) -> None:
    """Set a row to what the listed forces do to its motion; to 0 where its force is known."""
    motions, entries = friction.compliance[friction.order[row]], friction.matrix[row]
    for column in range(count):
        entries[column] = scale * motions[friction.order[column]] if coupled else 0.0


@compiled
def _set_rows_of_slip(
    friction: Rubbing, balance: Balance, rubbed: Array, weight: float, creep: float, row: int, count: int,
    point: int, limit: float,
) -> None:  # fmt: skip
    """Set the rows of a point that rubs: (b J)^-1 (dh + phi mu df) + c T A^-1 (...) = -(b J)^-1 q, over c / s."""
    points, scale, matrix, right = len(balance.held), balance.scale, friction.matrix, friction.right
    along, normal = len(friction.free) // points, balance.held[point] + friction.forces[point]
    first, mu = points + along * point, coefficient_at(friction, rubbed, point)
    bound = mu * normal if normal > NOTHING else 0.0
    rubs = bound > NEGLIGIBLE * limit
    for a in range(along):
        _set_row(friction, scale, row + a, count, rubs)
        if not rubs:
            own = scale * friction.compliance[first + a, first + a]
            matrix[row + a, row + a], right[row + a] = own, -own * friction.missed[first + a]
    if rubs:
        square, length = creep * creep, 0.0
        for a in range(along):
            slip = friction.free[along * point + a] + weight * friction.moved[first + a]
            square += slip * slip
            length += friction.forces[first + a] * friction.forces[first + a]
        speed, within = sqrt(square), bound / max(sqrt(length), bound)
        one = (friction.free[along * point] + weight * friction.moved[first]) / speed
        pulled = -within * friction.forces[first] / bound
        xx, yy, xy, two = 1.0 + FLATTEST - pulled * one, 1.0, 0.0, 0.0
        if along == 2:
            two = (friction.free[along * point + 1] + weight * friction.moved[first + 1]) / speed
            across = -within * friction.forces[first + 1] / bound
            yy, xy = 1.0 + FLATTEST - across * two, -0.5 * (pulled * two + across * one)
        inverse = scale / weight * speed / bound / (xx * yy - xy * xy)
        column = row - 1 if row > 0 and friction.order[row - 1] == point else -1
        for a in range(along):
            for b in range(along):
                part = inverse * ((yy if a == 0 else xx) if a == b else -xy)
                matrix[row + a, row + b] += part
                missed = friction.missed[first + b]
                if column >= 0:
                    matrix[row + a, column] += part * mu * (one if b == 0 else two)
                right[row + a] = (right[row + a] if b > 0 else 0.0) - part * missed


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
        points, along = len(faces), friction.on_face.shape[1]
        for face in range(len(peaks)):
            for a in range(along):
                friction.on_face[face, a] = 0.0
        for i in range(points):
            for a in range(along):
                force = friction.forces[points + along * i + a]
                if force != 0.0:
                    friction.on_face[faces[i], a] += force
                    lost -= force * inner_product(friction.tangents[along * i + a], moves)
        for face in range(len(peaks)):
            square = 0.0
            for a in range(along):
                square += friction.on_face[face, a] * friction.on_face[face, a]
            peaks[face] = sqrt(square)
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
        points, along = len(weights), friction.on_face.shape[1]
        for i in range(points):
            square = friction.slip_velocity * friction.slip_velocity
            for a in range(along):
                if form != ENDPOINT:
                    rubbed[i, a] = friction.forces[points + along * i + a] / weights[i]
                elif pressure[i] > NOTHING:
                    rubbed[i, a] = inner_product(friction.tangents[along * i + a], new_v)
                    square += rubbed[i, a] * rubbed[i, a]
                else:
                    rubbed[i, a] = 0.0
            if form == ENDPOINT and pressure[i] > NOTHING:
                share = -coefficient_at(friction, rubbed, i) * pressure[i] / sqrt(square)
                for a in range(along):
                    rubbed[i, a] *= share
        if friction.remembers:
            set_products(friction.tangents, stage_velocity, friction.free)
            slowest = (BREAKS_AWAY * friction.slip_velocity) * (BREAKS_AWAY * friction.slip_velocity)
            for i in range(points):
                now, old, both = 0.0, 0.0, 0.0
                for a in range(along):
                    slip, before = friction.free[along * i + a], rubbed[i, along + a]
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
