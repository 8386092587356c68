"""The period map of any system that is marched by the midpoint rule, and its derivative in a direction.

A disturbance (u, v) of a periodic response is marched by the linearized steps: each is a back-substitution and a small
linear problem on the points that touch,

    A vm = (2/dt) M v0 - K u0 + H^T f,   d1 = d0 - dt G vm,   f = w (P_0 d0 + P_1 d1),
    u1 = u0 + dt vm,   v1 = 2 vm - v0,

with P_0 and P_1 the slopes of the contact pressure of that step.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gapbeam.solver.contact.laws.step_slopes import step_slopes
from gapbeam.solver.contact.solve.condensation import CondensedOperator
from gapbeam.solver.integrators.effective_operator import image_of_solution
from gapbeam.solver.march.python.march import REFRESH_INTERVAL, March, march
from gapbeam.solver.system.accepted_step import Step
from gapbeam.solver.system.operators import Array, Indices
from gapbeam.solver.system.semi_discrete import MASS, STIFFNESS, VALUE, SemiDiscreteSystem, State, imaged

Disturbance = Array
"""u and v with their images, (2, 3, n)."""


@dataclass(frozen=True)
class ContactTangent:
    """The contact of one step, linearized.

    Attributes:
        dt: Size of the step, s.
        active: Points where the pressure changes, (a,).
        before: w P_0 there, (a,), N/m.
        after: w P_1 there, (a,), N/m.
    """

    dt: float
    active: Indices
    before: Array
    after: Array


@dataclass(frozen=True)
class MarchedMap:
    """A period in whole midpoint steps.

    Attributes:
        plan: The march over a period from t = 0; its loads are those of the steady state.
    """

    plan: March

    @property
    def period(self) -> float:
        """Length of the period, s."""
        return self.plan.dt * self.plan.steps

    def linearized(self, start: State) -> tuple[State, list[ContactTangent]]:
        """March a period; return its end, at t = 0 again, and its steps linearized. Collective."""
        tangents = []
        end = start
        for step in march(self.plan, start):
            tangents.append(self._tangent(step))
            end = step.refreshed or step.new
        return replace(end, time=0.0), tangents

    def disturbed(self, tangents: list[ContactTangent], start: Disturbance) -> Disturbance:
        """Return the growth of a small disturbance over the period. Collective."""
        system, contact = self.plan.system, self.plan.system.contact
        u, v = start
        depth = -(contact.gap_matrix @ contact.interface.trace(u[VALUE], system.operators))
        for number, tangent in enumerate(tangents, start=1):
            condensed = self.plan.operators.at(tangent.dt)
            assert isinstance(condensed, CondensedOperator)  # periodic responses are searched for with a factor
            right_side = (2.0 / tangent.dt) * v[MASS] - u[STIFFNESS]
            free = condensed.solve_free(right_side)
            moved = contact.gap_matrix @ contact.interface.trace(free, system.operators)
            forces = np.zeros(contact.size)
            free_depth = depth - tangent.dt * moved
            if len(tangent.active):
                here, after = tangent.active, tangent.after
                matrix = tangent.dt * after[:, None] * condensed.among(here)
                matrix[np.diag_indices_from(matrix)] += 1.0
                forces[here] = np.linalg.solve(matrix, tangent.before * depth[here] + after * free_depth[here])
            middle = image_of_solution(system, condensed, free, right_side, forces)
            depth = free_depth - tangent.dt * condensed.respond(forces).gaps
            u, v = u + tangent.dt * middle, 2.0 * middle - v
            if number % REFRESH_INTERVAL == 0 or number == len(tangents):
                u, v = imaged(system.operators, u[VALUE]), imaged(system.operators, v[VALUE])
        return np.stack([u, v])

    def moved(self, state: State, disturbance: Disturbance) -> State:
        """Return a state with a disturbance added. Collective."""
        system = self.plan.system
        u, v = (imaged(system.operators, part[VALUE]) for part in (state.u + disturbance[0], state.v + disturbance[1]))
        depth = system.contact.depth(system.contact.interface.trace(u[VALUE], system.operators))
        return replace(state, u=u, v=v, depth=depth)

    def products(self, pairs: list[tuple[Disturbance, Disturbance]]) -> Array:
        """Return scalar products by energy, u (K + (2 pi / period)^2 M) u + v M v. Collective."""
        return energy_products(self.plan.system, 2.0 * np.pi / self.period, pairs)

    def _tangent(self, step: Step) -> ContactTangent:
        scheme = self.plan.scheme
        if not scheme.has_period_map:
            raise ValueError(f"the map over a period of the scheme {scheme.type} is not linearized")
        before, after = step_slopes(self.plan.law, scheme.implicit, step.old.depth, step.new.depth, step.size)
        active = np.flatnonzero((before != 0.0) | (after != 0.0))
        weights = self.plan.system.contact.weights[active]
        return ContactTangent(step.size, active, weights * before[active], weights * after[active])


def energy_products(system: SemiDiscreteSystem, rate: float, pairs: list[tuple[Disturbance, Disturbance]]) -> Array:
    """Return u (K + rate^2 M) u + v M v for pairs of disturbances. Collective."""
    dots = [
        (x, y)
        for one, other in pairs
        for x, y in (
            (one[0, VALUE], other[0, STIFFNESS] + rate**2 * other[0, MASS]),
            (one[1, VALUE], other[1, MASS]),
        )
    ]
    return np.asarray(system.dots(dots).reshape(-1, 2).sum(axis=1))
