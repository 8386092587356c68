"""Many steps of a system in modal coordinates, compiled: schemes, contact, energy ledger and records.

    q'' + C q' + s q = sum_k s_k(t) L_k + Phi^T f,    d = -(g0 + Phi q),    f = w P(d, d')

The effective operator is diagonal, so that a step is a few products per DOF, one product with Phi for the gaps, and the
contact problem on the active points, whose rows of Phi put the forces back.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from gapbeam.solver.compilation.jit import compiled, compiled_apart, entry, long_entry, twin
from gapbeam.solver.contact.laws.law_tables import ENDPOINT
from gapbeam.solver.contact.laws.point_law import (
    LawTable,
    elastic_potential,
    elastic_pressure,
    numbers_at,
    resting_point,
    set_after,
)
from gapbeam.solver.contact.solve.contact_solve import UNRESOLVED
from gapbeam.solver.diagnostics.energy_ledger import StepEnergies, total_energy
from gapbeam.solver.march.compiled import ledger_kernel as accounts
from gapbeam.solver.march.compiled.kernel_tables import (
    KernelState,
    Modal,
    Records,
    Room,
    Scheme,
    SlidingArrays,
    WallRows,
    is_due,
    take_snapshot,
)
from gapbeam.solver.march.compiled.ledger_kernel import LedgerArrays, Limits
from gapbeam.solver.march.compiled.point_motions import (
    AroundPoints,
    copy_into,
    count_in_play,
    fill,
    in_play,
    inner_product,
    set_products,
    turns,
)
from gapbeam.solver.march.compiled.point_solve import added_up, begin_points, complete_points, form_gaps_anew, touch_all
from gapbeam.solver.march.compiled.rubbing_points import enter_friction, record_friction
from gapbeam.solver.march.compiled.scheme_kernels import (
    accept,
    alpha_step,
    force_at,
    midpoint_step,
    move_walls,
    wall_work,
)
from gapbeam.solver.march.compiled.turning_points import point_outward, raise_closest, record_turning, stay_holes
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
        while around.stations[station] != point:
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


DONE, FAILED, NOT_FINITE, CREATED = 0, 1, 2, 3  # why a kernel came back
FRESH_GAPS = 50  # steps, after which gaps are formed anew from the DOFs
advance = midpoint_step  # in `march_alpha` the step of its scheme


@long_entry
def march_steps(
    modal: Modal, scheme: Scheme, law: LawTable, motion: KernelState, room: Room, ledgers: LedgerArrays, limits: Limits,
    records: Records, factors: Array, walls: WallRows, first: int, every: int, last: int, most: int,
) -> tuple[int, int, int]:  # fmt: skip
    """March as many steps as there are rows of load factors, or until one fails or creates energy, by midpoint rules.

    Args:
        modal: The system.
        scheme: The scheme.
        law: The contact law; coefficients that follow from touch speeds, and plastic sets, are changed in place.
        motion: The state, changed in place.
        room: Room.
        ledgers: Ledger arrays, changed in place.
        limits: The gates.
        records: Room for the records of these steps.
        factors: s_k in the balance of each step, (steps, loads).
        walls: Walls that move in these steps.
        first: Number of the first step; records and fresh gaps fall on multiples.
        every: Steps between records.
        last: Number of the step after the last of the march, which is recorded.
        most: Limit of the iterations of a contact solve.

    Returns:
        DONE, FAILED (that step is not taken), NOT_FINITE or CREATED (it is), the steps taken and the records made.
    """
    recorded, listed, impacts = 0, 0, records.impacts
    begin_points(modal, motion, room)
    for step in range(len(factors)):
        move_walls(walls, step, room, modal.around)
        iterations = advance(modal, scheme, law, motion, room, factors[step], most)
        if iterations < 0:
            stay_holes(modal.around)
            complete_points(modal, modal.around, law, motion, room)
            move_walls(walls, step, room, modal.around)
            return FAILED, step, recorded
        if len(records.sliding.tangents) > 0:
            enter_sliding(modal, motion, room, records.sliding, scheme.dt)
        _enter(modal, scheme, law, motion, room, ledgers, factors[step], walls, step)
        number = first + step + 1
        if number % FRESH_GAPS == 0 or number == last:
            _measure_anew(modal, law, motion, room, ledgers)
        ledgers.solves[0] += iterations
        ledgers.solves[1] += iterations
        ledgers.solves[2] = max(ledgers.solves[2], iterations)
        if not np.isfinite(total_energy(accounts.energies_in(ledgers))):
            complete_points(modal, modal.around, law, motion, room)
            return NOT_FINITE, step + 1, recorded
        listed = accounts.enter_touches(ledgers, room.deepest, scheme.dt, number * scheme.dt, impacts, listed)
        records.listed[0] = listed
        accounts.watch_impacts(ledgers, room.closed, limits)
        if accounts.growth(ledgers) > limits.total_growth:
            complete_points(modal, modal.around, law, motion, room)
            return CREATED, step + 1, recorded
        if law.by_touch and modal.around is None:
            touch_all(modal, law, motion, room)
        if number % every == 0 or number == last:
            complete_points(modal, modal.around, law, motion, room)
            record(modal, motion, ledgers, records, recorded, number)
            recorded += 1
        if is_due(records.snapshots, number, last):
            complete_points(modal, modal.around, law, motion, room)
            take_snapshot(records.snapshots, number, motion)
    complete_points(modal, modal.around, law, motion, room)
    return DONE, len(factors), recorded


@compiled
def _enter(
    modal: Modal, scheme: Scheme, law: LawTable, motion: KernelState, room: Room, ledgers: LedgerArrays,
    factors: Array, walls: WallRows, step: int,
) -> None:  # fmt: skip
    """Enter a solved step into the ledgers and make its end the state."""
    found = room.solution
    old_share = scheme.alpha_f
    fill(room.force, 0.0)
    fill(room.pressed, 0.0)
    fill(room.closed, 0.0)
    fill(room.deepest, -np.inf)
    contact, elastic_work, contact_loss, forces, largest = 0.0, 0.0, 0.0, 0.0, 0.0
    for number in range(count_in_play(modal.around, len(found.depth))):
        i = in_play(modal.around, number)
        face, depth, weight, before = modal.faces[i], found.depth[i], modal.weights[i], motion.depth[i]
        force = force_at(room, i)
        pressure = force / weight
        largest = max(largest, abs(room.held_depth[i]))
        room.deepest[face] = max(room.deepest[face], depth)
        if pressure > 0.0:
            room.pressed[face] = 1.0
        if depth > 0.0 or before > 0.0 or force != 0.0:
            elastic, numbers, point = found.elastic[i], numbers_at(law, i), resting_point(law, i)
            if scheme.form == ENDPOINT:
                elastic *= 1.0 - old_share
                elastic += old_share * elastic_pressure(numbers, point, before)[0]
            room.force[face] += force
            forces += abs(force)
            contact += weight * elastic_potential(numbers, point, depth)
            if numbers.softer > 0.0:
                law.yielding[i, 0] = set_after(numbers, point, depth)
            elastic_work += weight * elastic * (depth - before)
            contact_loss += weight * (pressure - elastic) * (depth - before)
    raise_closest(modal.around, modal.initial_gap, room.deepest, ledgers.deepest)
    kinetic, strain, structural, inner = 0.0, 0.0, 0.0, 0.0
    for j in range(len(motion.q)):
        moved = room.new_q[j] - motion.q[j]
        kinetic += room.new_v[j] * room.new_v[j]
        strain += modal.squares[j] * room.new_q[j] * room.new_q[j]
        structural += moved * modal.damping[j] * room.stage_velocity[j]
        inner += moved * room.inner[j]
    for k in range(len(modal.dashpot_factors)):
        pull = modal.dashpot_factors[k] * inner_product(modal.dashpots[k], room.stage_velocity)
        for j in range(len(motion.q)):
            structural += pull * modal.dashpots[k, j] * (room.new_q[j] - motion.q[j])
    moves = room.right  # room until the next step
    for j in range(len(motion.q)):
        moves[j] = room.new_q[j] - motion.q[j]
    rubbed_away = enter_friction(modal.friction, modal.faces, moves, room.friction)
    set_products(modal.loads, moves, room.works)
    driven = 0.0
    for load in range(len(factors)):
        room.works[load] *= factors[load]
        driven += modal.driven[load] * room.works[load]
    for wall in range(len(walls.loads)):
        work = wall_work(walls, step, wall, room, modal.around)
        room.works[walls.loads[wall]] += work
        driven += work
    accept(modal, scheme, motion, room)
    for number in range(count_in_play(modal.around, len(motion.pressure))):
        i = in_play(modal.around, number)
        if motion.pressure[i] > 0.0:
            room.closed[modal.faces[i]] = 1.0
    unresolved = UNRESOLVED * largest * forces
    measured = StepEnergies(
        0.5 * kinetic,
        0.5 * strain,
        contact,
        structural,
        inner,
        elastic_work,
        contact_loss,
        rubbed_away,
        driven,
        unresolved,
    )
    accounts.enter_step(ledgers, measured, room.works)
    accounts.enter_forces(ledgers, room.force, room.friction, room.pressed, room.deepest, scheme.dt)


@compiled_apart
def _measure_anew(modal: Modal, law: LawTable, motion: KernelState, room: Room, ledgers: LedgerArrays) -> None:
    """Form the gaps anew, and measure again all that depends on them."""
    form_gaps_anew(modal, motion, room)
    contact, hidden = 0.0, 0.0
    for i in range(len(motion.depth)):
        if motion.depth[i] > 0.0:
            contact += modal.weights[i] * elastic_potential(numbers_at(law, i), resting_point(law, i), motion.depth[i])
        if motion.pressure[i] != 0.0:
            terms = added_up(modal.gaps, modal.around, modal.initial_gap, motion.q, i)
            unknown = modal.weights[i] * motion.pressure[i] * accounts.EPS * terms
            hidden += unknown * unknown
    accounts.enter_energies(ledgers, contact, hidden, modal.squares, motion.q)


@compiled_apart
def record(modal: Modal, motion: KernelState, ledgers: LedgerArrays, records: Records, row: int, number: int) -> None:
    """Record the state after a step."""
    records.steps[row] = number
    copy_into(records.q[row], motion.q)
    copy_into(records.v[row], motion.v)
    point_outward(modal.around, motion.q, modal.across)
    fill(records.penetration[row], -np.inf)
    for i in range(len(motion.depth)):
        face, pressure = modal.faces[i], motion.pressure[i]
        records.penetration[row, face] = max(records.penetration[row, face], motion.depth[i])
        if pressure != 0.0:
            force = modal.weights[i] * pressure
            records.force[row, face] += force
            records.moment[row, face] += force * modal.arms[i]
            records.resultant[row, face, 0] += force * modal.across[i, 0]
            records.resultant[row, face, 1] += force * modal.across[i, 1]
        if pressure > 0.0:
            records.area[row, face] += modal.weights[i]
            records.active[row, face] += 1.0
    _record_levers(records.levers, modal.weights, motion.pressure, records.joint_contact[row])
    record_turning(
        modal.around, records.turning_levers, modal.across, modal.weights, motion.pressure, motion.rubbed,
        records.joint_contact[row],
    )  # fmt: skip
    record_friction(
        motion.rubbed, modal.weights, modal.faces, records.friction_levers, records.friction[row],
        records.joint_contact[row],
    )  # fmt: skip
    record_sliding(records.sliding, modal.faces, row)
    for kind in range(accounts.RECORDED):
        copy_into(records.over_time[row, kind], ledgers.over_time[kind])
    copy_into(records.energies[row], ledgers.energies)
    copy_into(records.load_work[row], ledgers.load_work)
    records.residual[row] = accounts.residual(ledgers)
    records.iterations[row] = ledgers.solves[0]
    ledgers.solves[0] = 0


@compiled
def _record_levers(levers: Array, weights: Array, pressure: Array, joints: Array) -> None:
    """Add the contribution of the contact forces to the forces of joints, (r,)."""
    if len(joints) > 0:
        for i in range(len(pressure)):
            if pressure[i] != 0.0:
                for k in range(len(joints)):
                    joints[k] += weights[i] * pressure[i] * levers[i, k]


@entry
def record_now(
    modal: Modal, motion: KernelState, ledgers: LedgerArrays, records: Records, row: int, number: int
) -> None:
    """Record the state after a step that was taken apart."""
    record(modal, motion, ledgers, records, row, number)


march_alpha = twin(march_steps, "march_alpha", advance=alpha_step)
"""March as `march_steps` does, by generalized-alpha: what a run does not march by it does not compile."""
march_around = twin(march_steps, "march_around")
"""March as `march_steps` does, with points around rigid sections: machine code of its own, kept apart."""
march_alpha_around = twin(march_steps, "march_alpha_around", advance=alpha_step)
"""Both."""
march_rubbing = twin(march_steps, "march_rubbing")
"""March as `march_steps` does, with friction."""
march_alpha_rubbing = twin(march_steps, "march_alpha_rubbing", advance=alpha_step)
"""March as `march_alpha` does, with friction."""
march_around_rubbing = twin(march_steps, "march_around_rubbing")
"""March as `march_around` does, with friction."""
march_alpha_around_rubbing = twin(march_steps, "march_alpha_around_rubbing", advance=alpha_step)
"""Both."""
