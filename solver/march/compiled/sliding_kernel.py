"""The work of sliding in compiled steps, as `gapbeam.solver.diagnostics.sliding_work` defines it."""

from __future__ import annotations

from math import sqrt

from gapbeam.solver.jit import compiled
from gapbeam.solver.march.compiled.array_loops import fill
from gapbeam.solver.march.compiled.kernel_tables import KernelState, Modal, Room, SlidingArrays
from gapbeam.solver.march.compiled.point_motions import in_play
from gapbeam.solver.march.compiled.scheme_kernels import force_at
from gapbeam.solver.system.operators import Indices
from gapbeam.solver.system.slip_modes import by_mode, impact_share, pressed_after


@compiled
def enter_sliding(modal: Modal, motion: KernelState, room: Room, sliding: SlidingArrays, dt: float) -> None:
    """Enter the work of sliding of a solved step of the size dt, s, whose end is not the state yet."""
    pressed = room.pressed  # of the faces; room until the step is entered
    fill(pressed, 0.0)
    for i in in_play(modal.around, len(motion.depth)):
        force = force_at(room, i)
        if force > 0.0:
            square = 0.0
            for along in range(sliding.tangents.shape[1]):
                moved = 0.0
                for j in range(len(motion.q)):
                    moved += sliding.tangents[i, along, j] * (room.new_q[j] - motion.q[j])
                square += moved * moved
            way, face = sqrt(square), modal.faces[i]
            pressed[face] = 1.0
            sliding.work[i] += force * way
            share = impact_share(sliding.pressed_for[face], dt, sliding.modes)
            struck, slid, stuck = by_mode(force * way, way / dt, share, sliding.modes)
            sliding.parts[0, i] += struck
            sliding.parts[1, i] += slid
            sliding.parts[2, i] += stuck
    for face in range(len(pressed)):
        sliding.pressed_for[face] = pressed_after(sliding.pressed_for[face], dt, pressed[face] > 0.0)


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
