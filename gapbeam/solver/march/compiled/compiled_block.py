"""Results of some steps of a compiled loop."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gapbeam.solver.march.compiled.carried_state import STATE, Carried
from gapbeam.solver.march.compiled.kernel_tables import KernelState, Records
from gapbeam.solver.march.compiled.plan_arrays import state_of
from gapbeam.solver.march.python.march import March
from gapbeam.solver.system.modal_coordinates import ModalSystem
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import Snapshots, State


@dataclass(frozen=True)
class CompiledBlock:
    """Some steps and what was recorded of them.

    Attributes:
        plan: The march.
        modal: Its system in modal coordinates.
        origin: Time at its start, in steps.
        first: Number of the first step since the start of the march.
        steps: Number of steps.
        records: Records, one row each.
        carried: State from which the loop continues.
    """

    plan: March
    modal: ModalSystem
    origin: int
    first: int
    steps: int
    records: Records
    carried: Carried

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
        return state_of(self.plan, self.modal, self.motion, self.end_time)

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
