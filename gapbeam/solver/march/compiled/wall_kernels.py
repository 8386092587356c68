"""Moving walls in the steps of a block: opening of the gaps, and work on the walls."""

from __future__ import annotations

from gapbeam.solver.jit import compiled
from gapbeam.solver.march.compiled.around_points import AroundPoints
from gapbeam.solver.march.compiled.kernel_tables import Room, WallRows
from gapbeam.solver.march.compiled.scheme_kernels import force_at
from gapbeam.solver.march.compiled.turning_points import END, START


@compiled
def move_walls(walls: WallRows, step: int, room: Room, around: AroundPoints | None) -> None:
    """Set by how much walls open the gaps in a step of a block, and where round holes are at its start and its end."""
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
    if around is not None:
        for station in range(len(walls.holes)):
            point = around.turning[station]
            for axis in range(3):
                start, end = walls.holes[station, axis], walls.holes[station, axis]
                for motion in range(len(walls.loads)):
                    shift = walls.shifts[motion, station, axis]
                    start += walls.places[step, motion] * shift
                    end += walls.places[step + 1, motion] * shift
                around.holes[point, START + axis], around.holes[point, END + axis] = start, end


@compiled
def wall_work(walls: WallRows, step: int, motion: int, room: Room, around: AroundPoints | None) -> float:
    """Return the work of a motion of walls in a solved step, J."""
    pressed = 0.0
    for i in range(len(room.grown)):
        pressed += walls.growths[motion, i] * force_at(room, i)
    if around is not None:
        for station in range(len(walls.holes)):
            point = around.turning[station]
            growth = walls.shifts[motion, station, 2]
            for axis in range(2):
                growth -= around.directions[point, axis] * walls.shifts[motion, station, axis]
            pressed += growth * force_at(room, point)
    work: float = -pressed * (walls.places[step + 1, motion] - walls.places[step, motion])
    return work
