"""The work of sliding in compiled steps, as `gapbeam.solver.diagnostics.point_contact` defines it."""

from __future__ import annotations

from math import sqrt

import numpy as np

from gapbeam.solver.jit import compiled
from gapbeam.solver.march.compiled.around_points import AroundPoints
from gapbeam.solver.march.compiled.array_loops import fill
from gapbeam.solver.march.compiled.kernel_tables import KernelState, Modal, Room, SlidingArrays
from gapbeam.solver.march.compiled.point_motions import count_in_play, in_play, turns
from gapbeam.solver.march.compiled.scheme_kernels import force_at
from gapbeam.solver.system.operators import Array, Indices
from gapbeam.solver.system.slip_modes import by_mode, impact_share, pressed_after, pressed_span


@compiled
def enter_sliding(modal: Modal, motion: KernelState, room: Room, sliding: SlidingArrays, dt: float) -> None:
    """Enter the work of sliding of a solved step of the size dt, s, whose end is not the state yet."""
    pressed, span = room.pressed, room.closed  # of the faces; room until the step is entered
    fill(pressed, 0.0)
    _set_spans(modal, motion, room, sliding, dt)
    for number in range(count_in_play(modal.around, len(motion.depth))):
        i = in_play(modal.around, number)
        force = force_at(room, i)
        if force > 0.0:
            face = modal.faces[i]
            if turns(modal.around, i):
                way = way_of_station(modal.around, motion.q, room.new_q, sliding, i)
            else:
                square = 0.0
                for along in range(sliding.tangents.shape[1]):
                    moved = 0.0
                    for j in range(len(motion.q)):
                        moved += sliding.tangents[i, along, j] * (room.new_q[j] - motion.q[j])
                    square += moved * moved
                way = sqrt(square)
            pressed[face] = 1.0
            sliding.work[i] += force * way
            share = impact_share(sliding.pressed_for[face], span[face], sliding.modes)
            struck, slid, stuck = by_mode(force * way, way / dt, share, sliding.modes)
            sliding.parts[0, i] += struck
            sliding.parts[1, i] += slid
            sliding.parts[2, i] += stuck
    for face in range(len(pressed)):
        sliding.pressed_for[face] = pressed_after(sliding.pressed_for[face], span[face], pressed[face] > 0.0)


@compiled
def _set_spans(modal: Modal, motion: KernelState, room: Room, sliding: SlidingArrays, dt: float) -> None:
    """Set the time that each face is pressed in a step, if a force acts on it, s, where the step has room for faces."""
    span, before, deepest = room.closed, room.force, room.deepest
    fill(deepest, -np.inf)
    for number in range(count_in_play(modal.around, len(motion.depth))):
        i = in_play(modal.around, number)
        face, depth = modal.faces[i], room.solution.depth[i]
        if depth > deepest[face]:
            deepest[face], before[face] = depth, motion.depth[i]
    for face in range(len(span)):
        span[face] = pressed_span(sliding.pressed_for[face], before[face], deepest[face], dt)


@compiled
def way_of_station(around: AroundPoints | None, q: Array, new_q: Array, sliding: SlidingArrays, point: int) -> float:
    """Return the slip of the surface of a section along its round hole in a solved step, m; 0 of other points."""
    square = 0.0
    if around is not None:
        station = 0
        while around.turning[station] != point:
            station += 1
        y, z, radius = around.directions[point, 0], around.directions[point, 1], around.holes[point, 3]
        length = sqrt(y * y + z * z)
        if length > 0.0:
            y, z = y / length, z / length
            along, turned = 0.0, 0.0
            for j in range(len(q)):
                moved = new_q[j] - q[j]
                along += moved * sliding.surface[station, 0, j]
                along -= moved * radius * (y * sliding.surface[station, 1, j] + z * sliding.surface[station, 2, j])
                turned -= moved * radius * sliding.surface[station, 3, j]
            first, second = around.pairs[point, 0], around.pairs[point, 1]
            turned += y * (around.after[second] - around.place[second])
            turned -= z * (around.after[first] - around.place[first])
            square += along * along + turned * turned
    return sqrt(square)


@compiled
def record_sliding(sliding: SlidingArrays, faces: Indices, row: int) -> None:
    """Record the work of each face, its parts, and the work of each point where that is asked for."""
    work, parts, points = sliding.rows[row], sliding.part_rows[row], sliding.point_rows[row]
    for i in range(len(sliding.work)):
        work[faces[i]] += sliding.work[i]
        for mode in range(parts.shape[1]):
            parts[faces[i], mode] += sliding.parts[mode, i]
    for i in range(len(points)):
        points[i] = sliding.work[i]
