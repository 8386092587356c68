"""Walls that move in the steps of a block: by how much they open the gaps, and what they work."""

from __future__ import annotations

from gapbeam.solver.jit import compiled
from gapbeam.solver.march.compiled.kernel_tables import Room, WallRows
from gapbeam.solver.march.compiled.scheme_kernels import force_at


@compiled
def move_walls(walls: WallRows, step: int, room: Room) -> None:
    """Set by how much walls open the gaps in a step of a block."""
    for motion in range(len(walls.loads)):
        new, speed = walls.places[step + 1, motion], walls.speeds[step + 1, motion]
        change = new - walls.places[step, motion]
        for i in range(len(room.grown)):
            growth = walls.growths[motion, i]
            if motion == 0:
                room.opened[i], room.grown[i], room.opening_speed[i] = 0.0, 0.0, 0.0
            room.opened[i] += new * growth
            room.grown[i] += change * growth
            room.opening_speed[i] += speed * growth


@compiled
def wall_work(walls: WallRows, step: int, motion: int, room: Room) -> float:
    """Return the work of a motion of walls in a solved step, J."""
    pressed = 0.0
    for i in range(len(room.grown)):
        pressed += walls.growths[motion, i] * force_at(room, i)
    work: float = -pressed * (walls.places[step + 1, motion] - walls.places[step, motion])
    return work
