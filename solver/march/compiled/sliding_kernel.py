"""The work of sliding in compiled steps, as `gapbeam.solver.diagnostics.sliding_work` defines it."""

from __future__ import annotations

from math import sqrt

from gapbeam.solver.jit import compiled
from gapbeam.solver.march.compiled.kernel_tables import KernelState, Modal, Room, SlidingArrays
from gapbeam.solver.march.compiled.point_motions import in_play
from gapbeam.solver.march.compiled.scheme_kernels import force_at
from gapbeam.solver.system.operators import Array, Indices


@compiled
def enter_sliding(modal: Modal, motion: KernelState, room: Room, sliding: SlidingArrays) -> None:
    """Enter the work of sliding of a solved step whose end is not the state yet."""
    for i in in_play(modal.around, len(motion.depth)):
        force = force_at(room, i)
        if force > 0.0:
            square = 0.0
            for along in range(sliding.tangents.shape[1]):
                moved = 0.0
                for j in range(len(motion.q)):
                    moved += sliding.tangents[i, along, j] * (room.new_q[j] - motion.q[j])
                square += moved * moved
            sliding.work[i] += force * sqrt(square)


@compiled
def record_sliding(sliding: SlidingArrays, faces: Indices, row: Array) -> None:
    """Record the work of each face, (faces,), J; `row` is 0 before."""
    for i in range(len(sliding.work)):
        row[faces[i]] += sliding.work[i]
