"""Arrays of kernels from plans and states, and back."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from gapbeam.solver.contact.laws.law_tables import ENDPOINT, IMPLICIT, MEAN
from gapbeam.solver.contact.solve.friction_equations import Rubbing, room_for_friction
from gapbeam.solver.diagnostics.energy_ledger import Energies
from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.integrators.time_scheme import kernel_of
from gapbeam.solver.march.compiled.contact_kernel import room_for_solution
from gapbeam.solver.march.compiled.kernel_tables import (
    KernelState,
    Modal,
    Records,
    Room,
    Scheme,
    SlidingArrays,
    SnapshotRoom,
    WallRows,
    widened,
)
from gapbeam.solver.march.compiled.ledger_kernel import OF_IMPACT, RECORDED
from gapbeam.solver.march.compiled.point_motions import AroundPoints, around_points
from gapbeam.solver.march.compiled.rubbing_table import rubbing_table
from gapbeam.solver.march.stepwise_march import March
from gapbeam.solver.system.modal_coordinates import ModalSystem
from gapbeam.solver.system.operators import Array, RankOnes
from gapbeam.solver.system.rank_one_update import inner_inverse
from gapbeam.solver.system.semi_discrete import VALUE, ContactOperator, Imaged, State, imaged


def modal_table(plan: March, modal: ModalSystem) -> Modal:
    """Return the system of a plan with its effective and Delassus operators, D = Phi A^-1 Phi^T."""
    system, contact = plan.system, plan.system.contact
    mass, stiffness, dashpots = plan.scheme.coefficients(system, plan.dt)
    inverse: Array = np.asarray(1.0 / (mass + stiffness * modal.squares + dashpots * modal.modal_damping))
    updates, update_factors = inverse_updates(inverse, modal.dashpots.times(dashpots))
    rubs = plan.law.friction is not None
    gaps, around = around_points(modal.gaps, contact, modal.planes)

    def condensed(rows: Array) -> Array:
        updated = rows @ updates.T
        found = (rows * inverse) @ rows.T - (updated * update_factors) @ updated.T
        return _packed(0.5 * (found + found.T))

    delassus = condensed(gaps)
    return Modal(
        squares=widened(modal.squares),
        damping=widened(modal.damping),
        dashpots=widened(modal.dashpots.patterns),
        dashpot_factors=_packed(modal.dashpots.coefficients),
        inverse=widened(inverse),
        updates=widened(updates),
        update_factors=update_factors,
        gaps=widened(gaps),
        initial_gap=_packed(contact.initial_gap),
        weights=_packed(contact.weights),
        faces=np.ascontiguousarray(contact.faces, dtype=np.int64),
        arms=_packed(contact.positions[:, 0]),
        across=np.array(contact.across, order="C"),
        loads=widened(modal.loads),
        driven=np.array([0.0 if load.static else 1.0 for load in system.loads]),
        delassus=delassus,
        largest=_largest(delassus, around),
        around=None if around is None else around._replace(rows=widened(around.rows)),
        friction=_friction(plan, modal, gaps, around, condensed) if rubs else None,
    )


def _friction(
    plan: March, modal: ModalSystem, gaps: Array, around: AroundPoints | None, condensed: Callable[[Array], Array]
) -> Rubbing:
    """Return the friction of a plan.

    Args:
        plan: The plan.
        modal: Its system.
        gaps: G or R, the first rows of B.
        around: The points around sections; None: others.
        condensed: Returns B A^-1 B^T.
    """
    law, contact = plan.law.friction, plan.system.contact
    assert law is not None
    table, rows = rubbing_table(modal, gaps, around)
    return room_for_friction(table, widened(rows), condensed(rows), law, len(contact.face_names))


def _largest(delassus: Array, around: AroundPoints | None) -> float:
    """Return the largest entry of the diagonal of D, m/N."""
    if around is None:
        return float(np.max(np.diagonal(delassus), initial=0.0))
    blocks = delassus[around.pairs[:, :, None], around.pairs[:, None, :]]
    return float(np.max(np.einsum("ma,mab,mb->m", around.directions, blocks, around.directions)))


def inverse_updates(inverse: Array, added: RankOnes) -> tuple[Array, Array]:
    """Return omega, (k, n), and rho, (k,), with (D + B^T diag(a) B)^-1 = D^-1 - sum_j rho_j omega_j omega_j^T.

    Args:
        inverse: The diagonal of D^-1, (n,).
        added: B and a.
    """
    responses = added.patterns * inverse
    scales, inner = inner_inverse(responses @ added.patterns.T, added.coefficients)
    factors, turn = np.linalg.eigh(inner)
    return np.ascontiguousarray(turn.T @ (scales[:, None] * responses)), factors


def scheme_table(plan: March) -> Scheme:
    """Return the scheme of a plan as numbers."""
    numbers = kernel_of(plan.scheme)
    if numbers is None:
        raise ValueError(f"no kernel marches the scheme {plan.scheme.type}")
    if numbers.form not in (MEAN, IMPLICIT, ENDPOINT):
        raise ValueError(f"no kernel takes the law in the form {numbers.form} of the scheme {plan.scheme.type}")
    return Scheme(plan.dt, *numbers)


def factor_rows(plan: March, first: int, steps: int) -> Array:
    """Return the load factors in the balance of each of some steps, (steps, loads)."""
    system, scheme = plan.system, scheme_table(plan)
    times = _times(plan, first, steps)
    if scheme.form != ENDPOINT:
        return system.middle_factors(times[:-1], plan.dt)
    rows, shift = system.load_factor_rows(times), scheme.alpha_f
    return np.ascontiguousarray((1.0 - shift) * rows[1:] + shift * rows[:-1])


def wall_rows(plan: March, first: int, steps: int) -> WallRows:
    """Return the motion of walls in some steps."""
    times = _times(plan, first, steps)
    walls, points, circles = plan.system.contact.walls, plan.system.contact.size, plan.system.contact.circles
    growths = np.array(np.broadcast_to(walls.growths, (len(walls.motions), points)))
    holes: Array = np.zeros((0, 3))
    shifts: Array = np.zeros((len(walls.motions), 0, 3))
    if circles and walls.motions:
        growths[:, circles.points] = 0.0
        holes, shifts = np.column_stack([circles.middles, circles.clearances]), circles.shifts
    return WallRows(
        loads=np.array([motion.load for motion in walls.motions], dtype=np.int64),
        growths=_packed(growths),
        places=_packed(walls.places(times)),
        speeds=_packed(walls.speeds(times)),
        holes=_packed(holes),
        shifts=_packed(shifts),
    )


def room_for(table: Modal) -> Room:
    """Return the room of a step."""
    n, m, faces = len(table.squares), len(table.weights), _faces(table)
    vectors = [*np.zeros((8, n)), *np.zeros((7, m)), *np.zeros((5, faces)), np.zeros(len(table.loads))]
    return Room._make([*vectors, room_for_solution(m)])


def sliding_rows(modal: ModalSystem) -> tuple[Array, Array]:
    """Return the motions of points along faces, and of surfaces at stations, in whole lanes; see `SlidingArrays`."""
    contact = modal.system.contact
    if not contact.measures_sliding:
        return np.zeros((0, 0, 0)), np.zeros((0, 4, 0))
    return widened(modal.tangents), widened(modal.surfaces)


def room_for_records(
    modal: ModalSystem,
    accounts: Accounts,
    slides: tuple[Array, Array],
    steps: int,
    every: int,
    between_snapshots: int = 0,
) -> Records:
    """Return room for records and snapshots of some steps, for impacts that may end in them, and the work of sliding.

    One impact in two steps may end at each face. The work of sliding so far comes from the accounts and
    accumulates in place.
    """
    contact, reactions = modal.system.contact, modal.system.reactions
    rows, n, faces = steps // every + 2, len(modal.squares), int(contact.faces.max()) + 1
    levers = np.zeros((contact.size, 0)) if reactions is None else reactions.pressure.T
    rubbing = np.zeros((0, levers.shape[1])) if reactions is None else reactions.friction.T
    along = 0 if accounts.law.friction is None else modal.tangents.shape[1]
    return Records(
        steps=np.zeros(rows, dtype=np.int64),
        q=np.zeros((rows, n)),
        v=np.zeros((rows, n)),
        force=np.zeros((rows, faces)),
        moment=np.zeros((rows, faces)),
        resultant=np.zeros((rows, faces, 2)),
        friction=np.zeros((rows, faces, along)),
        joint_contact=np.zeros((rows, levers.shape[1])),
        levers=_packed(levers),
        turning_levers=_turning_levers(modal),
        friction_levers=_packed(rubbing),
        area=np.zeros((rows, faces)),
        active=np.zeros((rows, faces)),
        penetration=np.zeros((rows, faces)),
        over_time=np.zeros((rows, RECORDED, faces)),
        impacts=np.empty((faces * (steps // 2 + 1), OF_IMPACT)),
        listed=np.zeros(1, dtype=np.int64),
        energies=np.zeros((rows, len(Energies._fields))),
        load_work=np.zeros((rows, len(modal.loads))),
        residual=np.zeros(rows),
        iterations=np.zeros(rows, dtype=np.int64),
        snapshots=_room_for_snapshots(n, contact.size, steps, between_snapshots),
        sliding=_sliding(modal, accounts, slides, rows),
    )


def _room_for_snapshots(size: int, points: int, steps: int, every: int) -> SnapshotRoom:
    rows = steps // every + 2 if every else 0
    whole = np.zeros(rows, dtype=np.int64)
    places = (np.zeros((rows, columns)) for columns in (size, size, points))
    return SnapshotRoom(np.array([every]), np.zeros(1, dtype=np.int64), whole, *places)


def _turning_levers(modal: ModalSystem) -> Array:
    """Return the effect of the forces at stations in round holes on the forces of joints, (t, 6, r)."""
    reactions = modal.system.reactions
    if reactions is None or reactions.stations is None:
        return np.zeros((0, 6, 0))
    return np.ascontiguousarray(reactions.stations.T.reshape(len(modal.system.contact.circles), 6, -1))


def _sliding(modal: ModalSystem, accounts: Accounts, slides: tuple[Array, Array], rows: int) -> SlidingArrays:
    contact, so_far = modal.system.contact, accounts.sliding
    faces, parts = (len(contact.face_names) if contact.measures_sliding else 0), len(so_far.parts)
    return SlidingArrays(
        tangents=slides[0],
        surface=slides[1],
        work=so_far.work,
        parts=so_far.parts,
        pressed_for=so_far.pressed_for,
        modes=contact.slip_modes,
        rows=np.zeros((rows, faces)),
        part_rows=np.zeros((rows, faces, parts)),
        point_rows=np.zeros((rows, contact.size if contact.maps_sliding else 0)),
    )


def arrays_of_state(modal: ModalSystem, state: State) -> KernelState:
    """Return a state, as a march carries it along, in modal coordinates, in whole lanes; penetrations are of these."""
    nothing, contact = np.zeros_like(modal.squares), modal.system.contact
    q = modal.coordinates(state.u[VALUE])
    return KernelState(
        widened(q),
        widened(modal.coordinates(state.v[VALUE])),
        widened(nothing if state.a is None else modal.coordinates(state.a[VALUE])),
        contact.depth(contact.interface.trace(modal.dofs(q), modal.system.operators), state.time),
        np.array(state.pressure),
        np.zeros_like(state.depth) if state.touch_speed is None else np.array(state.touch_speed),
        _rubbed(contact, state),
    )


def memory_of_friction(contact: ContactOperator) -> int:
    """Return the columns of `KernelState.rubbed`."""
    return 0 if contact.rubbed is None else 2 * (contact.rubbed.shape[0] // contact.size) + 1


def _rubbed(contact: ContactOperator, state: State) -> Array:
    """Return the memory of friction in a state, as in `KernelState`."""
    found: Array = np.zeros((contact.size, memory_of_friction(contact)))
    along = found.shape[1] // 2
    for part, first in ((state.traction, 0), (state.slip, along)):
        if part is not None:
            found[:, first : first + along] = part
    if state.slides is not None:
        found[:, -1] = state.slides
    return found


def state_of(plan: March, modal: ModalSystem, motion: KernelState, time: float, plastic_set: Array) -> State:
    """Return the state that arrays hold, in whole lanes or without, with its images."""

    def full(x: Array) -> Imaged:
        return imaged(plan.system.operators, modal.dofs(x[: len(modal.squares)]))

    state = State(time, full(motion.q), full(motion.v), motion.depth.copy(), motion.pressure.copy())
    if plan.scheme.carries_acceleration:
        state = replace(state, a=full(motion.a))
    if plan.law.touch_product is not None:
        state = replace(state, touch_speed=motion.touch_speed.copy())
    if plan.law.keeps_set:
        state = replace(state, plastic_set=plastic_set)
    if plan.law.friction is not None:
        along, memory = motion.rubbed.shape[1] // 2, motion.rubbed.copy()
        state = replace(state, traction=memory[:, :along])
        if plan.law.friction.static_coefficient is not None:
            state = replace(state, slip=memory[:, along : 2 * along], slides=memory[:, -1])
    return state


def _times(plan: March, first: int, steps: int) -> Array:
    """Return the start of the first step and the end of each, (steps + 1,), s."""
    return np.asarray((first + np.arange(steps + 1)) * plan.dt, dtype=float)


def _faces(table: Modal) -> int:
    return int(table.faces.max()) + 1


def _packed(x: Array) -> Array:
    return np.ascontiguousarray(x, dtype=float)
