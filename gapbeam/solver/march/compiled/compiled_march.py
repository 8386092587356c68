"""The compiled march of a dense system: blocks of many steps without Python.

A compiled loop carries plain arrays from step to step: the state in modal coordinates, and the factor of the active
block. The rows of this factor stand in an order that follows from the contacts before, and the order of a sum decides
its last bits.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gapbeam.solver.compilation.jit import compile_in_another_process, is_kept, is_pending
from gapbeam.solver.contact.laws.law_tables import ENDPOINT, IMPLICIT
from gapbeam.solver.contact.laws.point_law import LawTable
from gapbeam.solver.diagnostics.energy_ledger import Energies
from gapbeam.solver.diagnostics.history_rows import Instants
from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.integrators.time_scheme import kernel_of
from gapbeam.solver.march.compiled import march_kernel as of
from gapbeam.solver.march.compiled.kernel_tables import KernelState, Records, is_due, take_snapshot, widened
from gapbeam.solver.march.compiled.ledger_kernel import (
    APPROACH,
    CLOSINGS,
    CONTACT_TIME,
    IMPULSE,
    SQUARE,
    enter_arrays,
    ledger_arrays_of,
    limits_of,
    measure_in_modes,
)
from gapbeam.solver.march.compiled.march_kernel import DONE, FAILED, NOT_FINITE, record_now
from gapbeam.solver.march.compiled.ordered_cholesky import OrderedFactor
from gapbeam.solver.march.compiled.plan_arrays import (
    arrays_of_state,
    factor_rows,
    modal_table,
    room_for,
    room_for_records,
    scheme_table,
    sliding_rows,
    state_of,
    wall_rows,
)
from gapbeam.solver.march.compiled.tangent_kernel import monodromy_along
from gapbeam.solver.march.stepwise_march import March, Paused, begun, whole_step
from gapbeam.solver.messages.errors import NotConverged, RunError
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.modal_coordinates import ModalSystem, modal_system
from gapbeam.solver.system.operators import Array, row_product
from gapbeam.solver.system.semi_discrete import VALUE, Snapshots, State


def why_not_compiled(plan: March) -> str | None:
    """Return the reason against the compiled loop for a plan, in words; None where it can march.

    It marches dense systems, whose gaps and forces are the same shapes, by schemes that have a kernel, with springs and
    dampers, in steps of one size.
    """
    system, law = plan.system, plan.law
    if not isinstance(system.operators, DenseOperators):
        return "the model is not dense: finite elements on a mesh are marched step by step"
    if system.operators.massless.any():
        return "some degrees of freedom have no mass"
    if not system.contact.symmetric:
        return "Nitsche's method: gaps and forces are not the same shapes"
    if kernel_of(plan.scheme) is None:
        return f"no kernel marches the scheme {plan.scheme.type}"
    if law.augmented is not None:
        return "augmented Lagrangian: multipliers in every step"
    if not law.stores_energy:
        return "impulses instead of a contact stiffness"
    circles, walls = system.contact.circles, system.contact.walls
    if circles and law.touch_product is not None:
        return "damping that follows from touch speeds, at holes that are met as circles"
    if circles and walls.motions and np.any(np.delete(walls.growths, circles.points, axis=1)):
        return "supports that move beside holes that are met as circles"
    if plan.resolution is not None:
        return "adaptive steps"
    return None


Carried = tuple[Array, ...]
STATE = len(KernelState._fields)
IN_LANES = 3  # of them, the first: q, v and a


def carried(motion: KernelState, factor: OrderedFactor, size: int) -> Carried:
    """Return copies of the fields of `KernelState`, and of the factor: order, c and L.

    Args:
        motion: The state, in whole lanes.
        factor: The factor.
        size: n, how many of these are modal coordinates.
    """
    filled = int(factor.filled[0])
    order = factor.order[:filled].astype(float)
    held = (order, factor.compliance[:filled].copy(), factor.rows[:filled, :filled].copy())
    coordinates = (array[:size].copy() for array in motion[:IN_LANES])
    return (*coordinates, *(array.copy() for array in motion[IN_LANES:]), *held)


def taken_up(arrays: Carried, factor: OrderedFactor) -> KernelState:
    """Return the state that was carried along, and restore the factor."""
    order, compliance, rows = arrays[STATE:]
    filled = len(order)
    factor.order[:filled] = order
    factor.compliance[:filled] = compliance
    factor.rows[:filled, :filled] = rows
    factor.filled[0] = filled
    lanes = (widened(array) for array in arrays[:IN_LANES])
    return KernelState._make([*lanes, *(array.copy() for array in arrays[IN_LANES:STATE])])


def misfit(arrays: Carried, size: int, points: int, memory: int) -> str:
    """Return the fault of arrays of n = `size` DOFs and m = `points` points, in words; empty where there is none.

    `memory`: columns of what friction remembers.
    """
    if len(arrays) != STATE + 3:
        return f"{len(arrays)} arrays of a compiled loop, expected {STATE + 3}"
    filled = len(np.atleast_1d(arrays[STATE]))
    shapes = [(size,)] * 3 + [(points,)] * 3 + [(points, memory)] + [(filled,)] * 2 + [(filled, filled)]
    if filled > points or [array.shape for array in arrays] != shapes:
        return f"arrays of a compiled loop of shapes {[array.shape for array in arrays]}, expected {shapes}"
    order = arrays[STATE]
    if np.any(order != np.floor(order)) or np.any(order < 0) or len(set(order) - set(range(points))):
        return "an order of contact points that are not there"
    return ""


@dataclass(frozen=True)
class CompiledBlock:
    """Some steps and their records.

    Attributes:
        plan: The march.
        modal: Its system in modal coordinates.
        origin: Time at its start, in steps.
        first: Number of the first step since the start of the march.
        steps: Number of steps.
        records: Records, one row each.
        carried: State from which the loop continues.
        plastic_set: Plastic sets at the end, (m,), m.
    """

    plan: March
    modal: ModalSystem
    origin: int
    first: int
    steps: int
    records: Records
    carried: Carried
    plastic_set: Array

    @property
    def motion(self) -> KernelState:
        """The state at the end, in modal coordinates."""
        return KernelState._make(self.carried[:STATE])

    @property
    def end_time(self) -> float:
        """Its time, s."""
        return (self.origin + self.first + self.steps) * self.plan.dt

    @property
    def times(self) -> Array:
        """Times of the records, (records,), s."""
        return np.asarray((self.origin + self.records.steps) * self.plan.dt, dtype=float)

    @cached_property
    def end(self) -> State:
        """State at the end, from which any march can continue."""
        return state_of(self.plan, self.modal, self.motion, self.end_time, self.plastic_set)

    @cached_property
    def u(self) -> Array:
        """DOFs of the dense system at the records, (records, n)."""
        return self.modal.dofs(self.records.q)

    @cached_property
    def v(self) -> Array:
        """Their velocities, (records, n)."""
        return self.modal.dofs(self.records.v)

    @cached_property
    def snapshots(self) -> Snapshots | None:
        """Snapshots that fell due; None: none did."""
        room = self.records.snapshots
        count = int(room.filled[0])
        if not count:
            return None
        times = np.asarray((self.origin + room.steps[:count]) * self.plan.dt, dtype=float)
        return Snapshots(times, self.modal.dofs(room.q[:count]), self.modal.dofs(room.v[:count]), room.pressure[:count])


LOG = logging.getLogger("gapbeam")
COMPILES = "the time loop is compiled, which takes up to a minute, once"
CADENCE = 0.2  # s of wall time between blocks
FIRST_STEPS = 64  # of the first block, before it is known what a step costs
MOST_RECORDS = 2048  # of a block


class CompiledLoop:
    """The march of a plan, compiled.

    Attributes:
        plan: The plan.
        modal: Its system in modal coordinates.

    Args:
        plan: A plan that `why_not_compiled` has nothing against.
    """

    def __init__(self, plan: March) -> None:
        reason, modal = why_not_compiled(plan), modal_system(plan.system)
        if reason is not None or modal is None:
            raise ValueError(f"this march cannot be compiled: {reason}")
        self.plan, self.modal = plan, modal
        self._table = modal_table(plan, modal)
        self._scheme = scheme_table(plan)
        self._room, self._slides = room_for(self._table), sliding_rows(modal)
        kernels = (of.march_steps, of.march_around, of.march_rubbing, of.march_around_rubbing)
        if self._scheme.form == ENDPOINT:
            kernels = (of.march_alpha, of.march_alpha_around, of.march_alpha_rubbing, of.march_alpha_around_rubbing)
        self._march_steps = kernels[2 * (plan.law.friction is not None) + (self._table.around is not None)]

    @classmethod
    def compile_ahead(cls, plan: March, start: State | Paused, look: Callable[[], None]) -> None:
        """Load the machine code of the loop; have it compiled in another process where it is not in the cache.

        This process hears signals meanwhile.

        Args:
            plan: As of the class.
            start: A state of the march.
            look: Called meanwhile; an error that it raises ends the compilation.
        """
        loop, paused = cls(plan), start if isinstance(start, Paused) else Paused(start, 0)
        if is_pending(loop._march_steps):
            LOG.info(COMPILES)
            compile_in_another_process(lambda: loop._march_no_step(paused), look)
        loop._march_no_step(paused)

    def _march_no_step(self, paused: Paused) -> None:
        plan = self.plan
        accounts = Accounts.opened(plan.system, plan.law, paused.state, plan.dt)
        self._march_steps(
            self._table, self._scheme, self._law(paused.state), self._motion(paused), self._room,
            ledger_arrays_of(accounts), limits_of(accounts), room_for_records(self.modal, accounts, self._slides, 0, 1),
            factor_rows(plan, 0, 0), wall_rows(plan, 0, 0), 0, 1, 0, plan.max_iterations,
        )  # fmt: skip

    def blocks(
        self,
        start: State | Paused,
        every: int = 1,
        accounts: Accounts | None = None,
        steps: int | None = None,
        stops: int | None = None,
        agreed: Callable[[int], int] = int,
        also: frozenset[int] = frozenset(),
        between_snapshots: int = 0,
    ) -> Iterator[CompiledBlock]:
        """March, and yield block after block, each about `CADENCE` seconds of wall time at most.

        A step whose contact solve does not converge is taken by the generic march, which softens and halves.

        Args:
            start: State to start from, or the march that was left.
            every: Steps between records, counted from the start; the last step is recorded as well.
            accounts: Brought up to date before each block is yielded; None: new ones without gates.
            steps: Number of steps, those before `start` included; None: those of the plan.
            stops: Steps after whose multiples, counted from the start, a block ends; None: it does not matter.
            agreed: Makes all ranks agree on the number of steps of a block.
            also: Further steps, counted from the start, after which a block ends.
            between_snapshots: Steps between snapshots, counted from the start; the last step has one as well. 0: none.

        Raises:
            NotConverged: A step did not converge at the smallest size. What came before it was yielded.
            NotFinite: The energy is not a number; as above.
            EnergyCreated: More energy was created than the gates of `accounts` allow; as above.
        """
        plan, count = self.plan, self.plan.steps if steps is None else steps
        paused = start if isinstance(start, Paused) else Paused(begun(plan, start), 0)
        state = paused.state
        accounts = accounts or Accounts.opened(plan.system, plan.law, state, plan.dt)
        motion, law = self._motion(paused), self._law(state)
        if paused.modal is None:
            measure_in_modes(accounts, self._table.squares, motion, state.plastic_set)
        origin, done, size = round(state.time / plan.dt) - paused.done, paused.done, FIRST_STEPS
        if not is_kept(self._march_steps):
            LOG.info(COMPILES)
        while done < count:
            ends = [count, *(step for step in also if step > done)]
            if stops is not None:
                ends.append(done + stops - done % stops)
            rows = MOST_RECORDS * min(every, between_snapshots or every)
            wanted = agreed(min(size, min(ends) - done, rows))
            started = time.perf_counter()
            ledgers = ledger_arrays_of(accounts)
            records = room_for_records(self.modal, accounts, self._slides, wanted, every, between_snapshots)
            status, taken, recorded = self._march_steps(
                self._table, self._scheme, law, motion, self._room, ledgers, limits_of(accounts), records,
                factor_rows(plan, origin + done, wanted), wall_rows(plan, origin + done, wanted),
                done, every, count, plan.max_iterations,
            )  # fmt: skip
            seconds = time.perf_counter() - started
            enter_arrays(ledgers, accounts, taken, seconds, records, origin * plan.dt)
            accounts.time = (origin + done + taken) * plan.dt
            failure: RunError | None = None
            first, done = done, done + taken
            if status == FAILED:
                try:
                    state = self._step_apart(motion, law, origin + done, accounts)
                except RunError as error:
                    failure = error  # raised below, after what came before it
                else:
                    done += 1
                    motion, law = arrays_of_state(self.modal, state), self._law(state)
                    measure_in_modes(accounts, self._table.squares, motion, state.plastic_set)
                    if done % every == 0 or done == count:
                        record_now(self._table, motion, ledger_arrays_of(accounts), records, recorded, done)
                        accounts.peaks.iterations, recorded = 0, recorded + 1
                    if is_due(records.snapshots, done, count):
                        take_snapshot(records.snapshots, done, motion)
            elif status != DONE:
                try:
                    accounts.gates.let_pass((origin + done) * plan.dt, status != NOT_FINITE, accounts.ledger)
                except RunError as error:
                    failure = error
            elif taken == wanted:
                size = max(1, min(4 * size, round(wanted * CADENCE / max(seconds, 1.0e-9))))
            left = carried(motion, self._room.solution.factor, len(self.modal.squares))
            kept, sets = records.first(recorded), law.yielding[:, 0].copy()
            yield CompiledBlock(plan, self.modal, origin, first, done - first, kept, left, sets)
            if failure is not None:
                raise failure

    def tangent(self, start: State, steps: int | None = None) -> tuple[State, Array]:
        """March some steps with the derivative of the end by the start; midpoint rules only.

        Args:
            start: State to start from.
            steps: Number of steps; None: those of the plan.

        Returns:
            The end, and d(q, v) there by (q, v) at the start in modal coordinates, (2n, 2n). On one side of the kink
            where a point touches or leaves just at the end of a step.

        Raises:
            ValueError: A scheme that carries accelerations, damping that follows from touch speeds, friction, walls
                that move.
            NotConverged: A step did not converge, or only in parts.
        """
        plan, count = self.plan, self.plan.steps if steps is None else steps
        contact = plan.system.contact
        by_state = plan.law.touch_product is None and plan.law.friction is None
        if self._scheme.form == ENDPOINT or not by_state or contact.walls.motions:
            raise ValueError(
                "the state is not (q, v) alone: take a midpoint rule, given damping, still walls, no friction"
            )
        accounts = Accounts.opened(plan.system, plan.law, start, plan.dt)
        blocks = list(self.blocks(start, accounts=accounts, steps=count))
        if accounts.tally.halved:
            raise NotConverged(
                f"{accounts.tally.failures} steps of {plan.dt:.3g} s up to t = {accounts.time:.6g} s converged only in "
                "parts, along which no derivative is taken; take more steps or a softer contact"
            )
        places = np.concatenate([self.modal.coordinates(start.u[VALUE])[None], *(block.records.q for block in blocks)])
        implicit = self._scheme.form == IMPLICIT
        return blocks[-1].end, monodromy_along(self.modal, plan.law, implicit, plan.dt, places)

    def _motion(self, paused: Paused) -> KernelState:
        factor = self._room.solution.factor
        if paused.modal is None:
            factor.filled[0] = 0
            return arrays_of_state(self.modal, paused.state)
        return taken_up(paused.modal, factor)

    def _law(self, state: State) -> LawTable:
        plan = self.plan
        return plan.law.touched_at(state.touch_speed).yielded_by(state.plastic_set).table(plan.system.contact.size)

    def _step_apart(self, motion: KernelState, law: LawTable, number: int, accounts: Accounts) -> State:
        """Take a step by the generic march, which softens and halves; return its end."""
        plan = self.plan
        state = state_of(plan, self.modal, motion, number * plan.dt, law.yielding[:, 0].copy())
        for step in whole_step(plan, state, plan.dt):
            accounts.take(step)
            state = step.new
        return state


def instants_of(block: CompiledBlock, count: int) -> Instants:
    """Return the first `count` records of a block."""
    kept, modal = block.records, block.modal
    energies = kept.energies[:count]

    def energy(name: str) -> Array:
        return np.ascontiguousarray(energies[:, Energies._fields.index(name)])

    q = kept.q[:count]
    return Instants(
        times=block.times[:count],
        u=block.u[:count],
        v=block.v[:count],
        contact_force=kept.force[:count],
        contact_moment=kept.moment[:count],
        contact_resultant=kept.resultant[:count],
        contact_area=kept.area[:count],
        active_points=kept.active[:count],
        penetration=kept.penetration[:count],
        impulse=kept.over_time[:count, IMPULSE],
        contact_time=kept.over_time[:count, CONTACT_TIME],
        closings=kept.over_time[:count, CLOSINGS],
        approach=kept.over_time[:count, APPROACH],
        force_square=kept.over_time[:count, SQUARE],
        friction_force=None if block.plan.law.friction is None else kept.friction[:count],
        joint_contact=None if modal.system.reactions is None else kept.joint_contact[:count],
        sliding_work=kept.sliding.rows[:count] if modal.system.contact.measures_sliding else None,
        work_by_mode=kept.sliding.part_rows[:count] if modal.system.contact.measures_sliding else None,
        point_work=kept.sliding.point_rows[:count] if modal.system.contact.maps_sliding else None,
        kinetic=energy("kinetic"),
        strain=energy("strain"),
        restraint=0.5 * np.sum(row_product(q, modal.restraint) ** 2, axis=1),
        contact=energy("contact"),
        load_work=kept.load_work[:count],
        structural=energy("structural"),
        contact_loss=energy("contact_loss"),
        friction_loss=energy("friction_loss"),
        algorithmic=energy("algorithmic"),
        residual=kept.residual[:count],
        iterations=kept.iterations[:count].astype(float),
    )
