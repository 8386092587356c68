"""Points that rub in a compiled step: their motions, the forces on them, and the memory that a step leaves.

G and T are made of a few rows B of the system, r = S B: of a point alone, each motion is a row of its own; around a
section, points share the two motions of the axis and, where the section keeps its shape, three along x and one about x
(`rubbing_table`). The motions of a station in a round hole are made of those of the axis and of the surface, along the
direction of the step:

    along x: the axis, and -R o . its change across,    around: o x the axis, and -R the rotation
"""

from __future__ import annotations

from math import sqrt

from gapbeam.solver.compilation.jit import compiled
from gapbeam.solver.contact.laws.damper import BREAKS_AWAY, NOTHING
from gapbeam.solver.contact.laws.law_tables import ENDPOINT
from gapbeam.solver.contact.solve.friction_equations import Rubbing, coefficient_at
from gapbeam.solver.march.compiled.point_motions import (
    AroundPoints,
    add_rows,
    fill,
    inner_product,
    set_products,
    turns,
)
from gapbeam.solver.system.operators import Array, Indices


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
def moved_in(friction: Rubbing, row: int, x: Array) -> float:
    """Return a motion of a listed point along modal coordinates, (n,)."""
    total = 0.0
    for term in range(friction.table.terms):
        if friction.share[row, term] != 0.0:
            total += friction.share[row, term] * inner_product(friction.rows[friction.parts[row, term]], x)
    return total


@compiled
def opened_by(friction: Rubbing, around: AroundPoints | None, point: int) -> float:
    """Return by how much the forces open the gap of a point, over s."""
    opened = 0.0
    if around is None:
        opened += friction.moved[point]
    else:
        for a in range(2):
            opened += around.directions[point, a] * friction.moved[around.pairs[point, a]]
    return opened


@compiled
def aim(friction: Rubbing, around: AroundPoints | None, number: int) -> None:
    """Set the rows of B that the motions of a listed point are made of, along the direction of the step."""
    i, along = friction.points[number], friction.on_face.shape[1]
    row = number * (1 + along)
    for a in range(1 + along):
        for term in range(3):  # named by a tuple, arrays would lose what is written beside inlined `turns` (numba)
            friction.parts[row + a, term] = friction.table.parts[i, a, term]
            friction.share[row + a, term] = friction.table.share[i, a, term]
    if around is not None:
        for term in range(2):
            friction.share[row, term] = around.directions[i, term]
        if turns(around, i):
            _aim_station(friction, around, row, i)


@compiled
def _aim_station(friction: Rubbing, around: AroundPoints, row: int, point: int) -> None:
    """Set the rows that the slip of a station in a round hole is made of, along its direction, or up where it has none.

    Its motions begin at `row`.
    """
    index, share, own, radius = friction.parts, friction.share, friction.table.own[point], around.holes[point, 3]
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
    """Set the forces on the rows of B, and the motions that follow."""
    fill(friction.on_rows, 0.0)
    fill(friction.moved, 0.0)
    for row in range(friction.chosen[0] * (1 + friction.on_face.shape[1])):
        if friction.forces[row] != 0.0:
            for term in range(friction.table.terms):
                friction.on_rows[friction.parts[row, term]] += friction.share[row, term] * friction.forces[row]
    add_rows(friction.compliance, friction.on_rows, 1.0, friction.moved)


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
    """Store the friction of a solved step as the memory of the points, see `KernelState`.

    Args:
        friction: None: nothing rubs.
        form: Form of the law in the step.
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
            set_products(friction.rows, stage_velocity, friction.free)
            slowest = (BREAKS_AWAY * friction.slip_velocity) * (BREAKS_AWAY * friction.slip_velocity)
            for i in range(len(weights)):
                now, old, both = 0.0, 0.0, 0.0
                for a in range(along):
                    slip = 0.0
                    for term in range(friction.table.terms):
                        part = friction.table.parts[i, 1 + a, term]
                        slip += friction.table.share[i, 1 + a, term] * friction.free[part]
                    before = rubbed[i, along + a]
                    now, old, both = now + slip * slip, old + before * before, both + slip * before
                    rubbed[i, along + a] = slip
                rubbed[i, 2 * along] = 1.0 if now > slowest and old > slowest and both >= 0.0 else 0.0


@compiled
def record_friction(rubbed: Array, weights: Array, faces: Indices, levers: Array, forces: Array, joints: Array) -> None:
    """Record the friction force on each face, (faces, k), N, and add its share in the forces of joints, (r,).

    Args:
        rubbed: Memory of the points.
        weights: w, (m,), m^2.
        faces: Face of each point, (m,).
        levers: Forces of joints per unit force along each direction of each point, (m k, r).
        forces: The record, 0 before.
        joints: Forces of joints, changed in place.
    """
    along = forces.shape[1]
    for i in range(len(rubbed)):
        for a in range(along):
            force = weights[i] * rubbed[i, a]
            if force != 0.0:
                forces[faces[i], a] += force
                for k in range(len(joints)):
                    joints[k] += levers[along * i + a, k] * force
