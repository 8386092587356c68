"""One step of each compiled scheme up to the state at its end, which is left in `Room`, and walls that move."""

from __future__ import annotations

from gapbeam.solver.compilation.jit import compiled
from gapbeam.solver.contact.laws.point_law import LawTable, StepNumbers
from gapbeam.solver.contact.solve.friction_equations import Rubbing
from gapbeam.solver.march.compiled.contact_kernel import Balance, StepPoints
from gapbeam.solver.march.compiled.kernel_tables import KernelState, Modal, Room, Scheme, WallRows
from gapbeam.solver.march.compiled.point_motions import (
    AroundPoints,
    add_all_rows,
    add_forces,
    add_rows,
    copy_into,
    count_in_play,
    in_play,
    inner_product,
    turns,
)
from gapbeam.solver.march.compiled.point_solve import (
    Slip,
    Touch,
    accept_points,
    end_points,
    guess_depths,
    hold_forces,
    open_gaps,
    solve_points,
)
from gapbeam.solver.march.compiled.rubbing_points import keep_friction
from gapbeam.solver.march.compiled.turning_points import END, START
from gapbeam.solver.system.operators import Array


@compiled
def midpoint_step(
    modal: Modal, scheme: Scheme, law: LawTable, motion: KernelState, room: Room, factors: Array, most: int
) -> int:
    """Advance by the midpoint rule, `gapbeam.solver.integrators.midpoint`."""
    dt, q, v = scheme.dt, motion.q, motion.v
    n, rate = len(q), 1.0 / dt
    right, free = room.right, room.free
    for j in range(n):
        right[j] = (2.0 * rate) * v[j] - modal.squares[j] * q[j]
    _add_loads_and_held(modal, motion, room, factors)
    _solve(modal, right, free)
    hold_forces(modal.gaps, modal.around, free, dt, motion.depth, room.held_depth)
    open_gaps(modal.around, room.grown, room.held_depth)
    balance = Balance(dt, modal.delassus, modal.around, modal.largest, modal.weights, room.held_depth, room.held)
    numbers = StepNumbers(scheme.form, dt, 0.0, 0.0)
    step = StepPoints(numbers, motion.depth, motion.pressure, room.guess_depth, room.guess_rate)
    touch = Touch(v, motion.touch_speed)
    slip = Slip(motion.rubbed, free, 1.0)
    iterations = solve_points(
        modal.around, modal.friction, modal.initial_gap, balance, step, law, touch, slip, room.solution, most
    )
    if iterations < 0:
        return -1
    _add_changes(modal.friction, modal, room.solution.change, right)
    _solve(modal, right, free)
    for j in range(n):
        middle = free[j]
        new_q, new_v = q[j] + dt * middle, 2.0 * middle - v[j]
        room.inner[j] = rate * (new_v - v[j]) + 0.5 * modal.squares[j] * (new_q + q[j])
        room.stage_velocity[j], room.new_q[j], room.new_v[j] = middle, new_q, new_v
    end_points(modal.around, modal.initial_gap, room)
    return iterations


@compiled
def alpha_step(
    modal: Modal, scheme: Scheme, law: LawTable, motion: KernelState, room: Room, factors: Array, most: int
) -> int:
    """Advance by generalized-alpha, `gapbeam.solver.integrators.generalized_alpha`."""
    dt, q, v, a = scheme.dt, motion.q, motion.v, motion.a
    n = len(q)
    old_share, new_share = scheme.alpha_f, 1.0 - scheme.alpha_f
    right, free = room.right, room.free
    scale, rate_slope = scheme.beta * dt * dt, scheme.gamma / (scheme.beta * dt)
    for j in range(n):
        u_guess = q[j] + dt * v[j] + dt * dt * (0.5 - scheme.beta) * a[j]
        v_guess = v[j] + dt * (1.0 - scheme.gamma) * a[j]
        u_stage, v_stage = new_share * u_guess + old_share * q[j], new_share * v_guess + old_share * v[j]
        right[j] = -scheme.alpha_m * a[j] - modal.damping[j] * v_stage - modal.squares[j] * u_stage
        room.u_guess[j], room.v_guess[j], room.stage_velocity[j] = u_guess, v_guess, v_stage
    for k in range(len(modal.dashpot_factors)):
        pull = modal.dashpot_factors[k] * inner_product(modal.dashpots[k], room.stage_velocity)
        for j in range(n):
            right[j] -= pull * modal.dashpots[k, j]
    _add_loads_and_held(modal, motion, room, factors)
    _solve(modal, right, free)
    guess_depths(
        modal.gaps, modal.around, modal.initial_gap, room.u_guess, room.v_guess, room.guess_depth, room.guess_rate
    )
    hold_forces(modal.gaps, modal.around, free, scale, room.guess_depth, room.held_depth)
    open_gaps(modal.around, room.opened, room.guess_depth)
    open_gaps(modal.around, room.opening_speed, room.guess_rate)
    open_gaps(modal.around, room.opened, room.held_depth)
    balance = Balance(scale, modal.delassus, modal.around, modal.largest, modal.weights, room.held_depth, room.held)
    numbers = StepNumbers(scheme.form, dt, old_share, rate_slope)
    step = StepPoints(numbers, motion.depth, motion.pressure, room.guess_depth, room.guess_rate)
    touch = Touch(v, motion.touch_speed)
    slip = Slip(motion.rubbed, room.new_v, new_share * scheme.gamma * dt)
    if modal.friction is not None:
        for j in range(n):
            room.new_v[j] = room.stage_velocity[j] + slip.weight * free[j]
    iterations = solve_points(
        modal.around, modal.friction, modal.initial_gap, balance, step, law, touch, slip, room.solution, most
    )
    if iterations < 0:
        return -1
    _add_changes(modal.friction, modal, room.solution.change, right)
    _solve(modal, right, free)
    for j in range(n):
        new_a = free[j]
        new_q, new_v = room.u_guess[j] + scale * new_a, room.v_guess[j] + scheme.gamma * dt * new_a
        elastic = modal.squares[j] * (new_share * new_q + old_share * q[j])
        room.inner[j] = (1.0 - scheme.alpha_m) * new_a + scheme.alpha_m * a[j] + elastic
        room.stage_velocity[j] = new_share * new_v + old_share * v[j]
        room.new_q[j], room.new_v[j], a[j] = new_q, new_v, new_a
    end_points(modal.around, modal.initial_gap, room)
    return iterations


@compiled
def _add_changes(friction: Rubbing | None, modal: Modal, change: Array, right: Array) -> None:
    """Add the change of the contact forces, and friction, to the right side."""
    if friction is None:
        add_forces(modal.gaps, modal.around, change, right)
    else:
        add_rows(friction.rows, friction.on_rows, 1.0, right)


@compiled
def _solve(modal: Modal, right: Array, x: Array) -> None:
    """Set x to A^-1 r."""
    for j in range(len(x)):
        x[j] = modal.inverse[j] * right[j]
    for k in range(len(modal.update_factors)):
        change = modal.update_factors[k] * inner_product(modal.updates[k], right)
        for j in range(len(x)):
            x[j] -= change * modal.updates[k, j]


@compiled
def _add_loads_and_held(modal: Modal, motion: KernelState, room: Room, factors: Array) -> None:
    """Add loads and the contact forces that acted last to the right side; set these forces, f_held."""
    add_all_rows(modal.loads, factors, room.right)
    for number in range(count_in_play(modal.around, len(room.held))):
        i = in_play(modal.around, number)
        room.held[i] = 0.0 if turns(modal.around, i) else modal.weights[i] * motion.pressure[i]
    add_forces(modal.gaps, modal.around, room.held, room.right)


@compiled
def force_at(room: Room, point: int) -> float:
    """Return the force of a solved step at a point, without the round-off that is left where the law knows none."""
    found = room.solution
    force: float = room.held[point] + found.change[point]
    return 0.0 if found.pressure[point] == 0.0 else force


@compiled
def accept(modal: Modal, scheme: Scheme, motion: KernelState, room: Room) -> None:
    """Make the end of a solved step the state."""
    found, old_share = room.solution, scheme.alpha_f
    for number in range(count_in_play(modal.around, len(motion.depth))):
        i = in_play(modal.around, number)
        lasting = old_share * motion.pressure[i]
        pressure = force_at(room, i) / modal.weights[i]
        if old_share > 0.0:
            pressure = 0.0 if found.pressure[i] == lasting else (pressure - lasting) / (1.0 - old_share)
        motion.pressure[i] = pressure
        motion.depth[i] = found.depth[i]
    copy_into(motion.q, room.new_q)
    copy_into(motion.v, room.new_v)
    keep_friction(
        modal.friction, scheme.form, modal.weights, motion.pressure, motion.v, room.stage_velocity, motion.rubbed
    )
    accept_points(modal.around)


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
            point = around.stations[station]
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
            point = around.stations[station]
            growth = walls.shifts[motion, station, 2]
            for axis in range(2):
                growth -= around.directions[point, axis] * walls.shifts[motion, station, axis]
            pressed += growth * force_at(room, point)
    work: float = -pressed * (walls.places[step + 1, motion] - walls.places[step, motion])
    return work
