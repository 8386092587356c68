"""Snapshots that a compiled march keeps of its state."""

from __future__ import annotations

from gapbeam.solver.jit import shared
from gapbeam.solver.march.compiled.kernel_tables import KernelState, SnapshotRoom


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
