"""The period map of any system that is marched by the midpoint rule, and its derivative in a direction.

A disturbance (u, v) of a periodic response is marched by the linearized steps: each is a back-substitution and a small
linear problem on the points that touch,

    A vm = (2/dt) M v0 - K u0 + H^T f,   d1 = d0 - dt G vm,   f = w (P_0 d0 + P_1 d1),
    u1 = u0 + dt vm,   v1 = 2 vm - v0,

with P_0 and P_1 the slopes of the contact pressure of that step.

Systems that are too large for their monodromy matrix are solved by Newton's method with GMRES. Each product with the
derivative of the period map is a march of a disturbance by linearized steps. Damping makes the map forget all but the
lowest modes, so that few are needed.

A dense system is mapped in modal coordinates, x = (q, v).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from gapbeam.solver.contact.laws.contact_law import ContactLaw, step_slopes
from gapbeam.solver.contact.solve.condensation import CondensedOperator
from gapbeam.solver.integrators.effective_operator import image_of_solution
from gapbeam.solver.integrators.time_scheme import TimeScheme
from gapbeam.solver.march.compiled.compiled_march import CompiledLoop
from gapbeam.solver.march.compiled.tangent_kernel import monodromy_along
from gapbeam.solver.march.stepwise_march import REFRESH_INTERVAL, EffectiveOperators, March, march
from gapbeam.solver.periodic.floquet import Stability, leading_multipliers, ordered, solve_identity_minus
from gapbeam.solver.periodic.shooting import SLACK, Iterated, no_orbit
from gapbeam.solver.system.modal_coordinates import ModalSystem
from gapbeam.solver.system.operators import Array, Indices
from gapbeam.solver.system.semi_discrete import MASS, STIFFNESS, VALUE, SemiDiscreteSystem, State, Step, imaged
from gapbeam.solver.system.unresolved_modes import resolved_multipliers, unresolved_decay

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


FORCING = 0.01  # of the residual: how well Newton's equations are solved
MOST_PRODUCTS = 60
MULTIPLIER_ERROR = 1.0e-3
SHORTEST_UPDATE = 2.0**-5
FLOOR = 1.0e-30


@dataclass(frozen=True)
class MarchedOrbit(Iterated):
    """A periodic response.

    Attributes:
        state: State at the start of a period, t = 0.
        stability: Leading multipliers.
        multiplier_error: Error of the largest.
        residuals: |P(x) - x| / |x| of every iteration, norms of energy.
        products: Marches of disturbances.
    """

    state: State
    stability: Stability
    multiplier_error: float
    residuals: tuple[float, ...]
    products: int


def shoot_marched(
    period_map: MarchedMap,
    start: State,
    tolerance: float = 1.0e-8,
    max_iterations: int = 20,
    report: Callable[[int, float], None] | None = None,
    pause: Callable[[], None] | None = None,
) -> MarchedOrbit:
    """Find a periodic response near a state, and its leading multipliers.

    Args:
        period_map: The map.
        start: State to start from: the end of a march, or the response of a smaller model.
        tolerance: Largest |P(x) - x| / |x|.
        max_iterations: Limit of Newton iterations.
        report: Called with the number and residual of every iteration.
        pause: Called before every march of a disturbance, of which an iteration has dozens; may raise. Collective.

    Raises:
        NotConverged: The iterations did not converge; the error has the residual of every one.

    Collective.
    """
    state, residuals, products = start, list[float](), 0
    kept: tuple[State, Array] | None = None
    length = 1.0
    for _ in range(max_iterations + 1):
        end, tangents = period_map.linearized(state)
        change = np.stack([end.u - state.u, end.v - state.v])
        here = np.stack([state.u, state.v])
        squares = period_map.products([(change, change), (here, here)])
        residual = float(np.sqrt(max(squares[0], 0.0) / max(squares[1], FLOOR)))
        if kept is not None and length > SHORTEST_UPDATE and not residual <= SLACK * residuals[-1]:
            length *= 0.5
            state = period_map.moved(kept[0], length * kept[1])
            continue
        residuals.append(residual)
        if report is not None:
            report(len(residuals) - 1, residual)
        if not np.isfinite(residual):
            break
        counted = _Counted(period_map, tangents, pause)
        if residual <= tolerance:
            probe = change if squares[0] > 0.0 else here
            stability, off = leading_multipliers(
                counted, period_map.products, _mixed(probe, here), MULTIPLIER_ERROR, MOST_PRODUCTS
            )
            return MarchedOrbit(state, stability, off, tuple(residuals), products + counted.count)
        update, _ = solve_identity_minus(counted, period_map.products, change, FORCING, MOST_PRODUCTS)
        products += counted.count
        kept, length = (state, update), 1.0
        state = period_map.moved(state, update)
    raise no_orbit(max_iterations, residuals, tolerance)


def _mixed(one: Array, other: Array) -> Array:
    """Return a vector with a share of both, however small one is."""
    return np.asarray(one / max(float(np.max(np.abs(one))), FLOOR) + other / max(float(np.max(np.abs(other))), FLOOR))


@dataclass
class _Counted:
    """The derivative of the period map, with the number of its products."""

    period_map: MarchedMap
    tangents: list[ContactTangent]
    pause: Callable[[], None] | None = None
    count: int = 0

    def __call__(self, disturbance: Array) -> Array:
        if self.pause is not None:
            self.pause()
        self.count += 1
        return self.period_map.disturbed(self.tangents, disturbance)


@dataclass(frozen=True)
class ModalMap:
    """A period in whole midpoint steps.

    Attributes:
        modal: The system; its loads are those of the steady state.
        law: Contact law.
        scheme: A scheme with a period map.
        dt: Step, s.
        steps: Steps in the period.
    """

    modal: ModalSystem
    law: ContactLaw
    scheme: TimeScheme
    dt: float
    steps: int

    @property
    def period(self) -> float:
        """Length of the period, s."""
        return self.dt * self.steps

    @cached_property
    def scale(self) -> Array:
        """sqrt(s + (2 pi / period)^2) for q and 1 for v, (2n,), 1/s and 1: the norm is one of energy."""
        rates = np.sqrt(self.modal.squares + (2.0 * np.pi / self.period) ** 2)
        return np.concatenate([rates, np.ones_like(rates)])

    @property
    def plan(self) -> March:
        """The march over a period."""
        system = self.modal.system
        return March(system, self.law, self.scheme, EffectiveOperators(system, self.scheme), self.dt, self.steps)

    def over(self, periods: int) -> ModalMap:
        """Return the map over several of these periods, or of p of p times as many forcing periods."""
        return replace(self, steps=periods * self.steps)

    def state(self, x: Array) -> State:
        """Return x, (2n,), as a state at t = 0."""
        system, n = self.modal.system, len(self.modal.squares)
        u, v = self.modal.dofs(x[:n]), self.modal.dofs(x[n:])
        depth = system.contact.depth(system.contact.interface.trace(u, system.operators))
        still = np.zeros(system.contact.size)
        return State(0.0, imaged(system.operators, u), imaged(system.operators, v), depth, still)

    def begun(self, x: Array) -> State:
        """Return x, (2n,), of a periodic response as a state at t = 0, with the pressure at the end of the period."""
        start = self.state(x)
        for block in self._loop.blocks(start, self.steps):
            last = block.end.pressure
        return replace(start, pressure=last)

    def coordinates(self, state: State) -> Array:
        """Return a state as x, (2n,)."""
        return np.concatenate([self.modal.coordinates(part[VALUE]) for part in (state.u, state.v)])

    def after(self, x: Array) -> Array:
        """Return P(x), (2n,)."""
        for block in self._loop.blocks(self.state(x), self.steps):
            end = block.motion
        return np.concatenate([end.q, end.v])

    def with_tangent(self, x: Array) -> tuple[Array, Array]:
        """Return P(x), (2n,), and P'(x), (2n, 2n)."""
        end, tangent = self._loop.tangent(self.state(x))
        return self.coordinates(end), tangent

    def stability(self, tangent: Array) -> Stability:
        """Return the multipliers of P'(x), (2n, 2n), by the damping of modes that the step does not resolve."""
        decay = unresolved_decay(self.modal.squares, self.modal.damping, self.dt, self.period)
        return ordered(resolved_multipliers(tangent, decay, self.dt))

    def reach(self, x: Array) -> Array:
        """Return the largest depth of each face over the period, (faces,), m; negative where it stays open."""
        system = self.modal.system
        contact, operators = system.contact, system.operators
        deepest = np.full(contact.size, -np.inf)
        for number, u in enumerate(self.history(x)[0]):
            np.maximum(deepest, contact.depth(contact.interface.trace(u, operators), number * self.dt), out=deepest)
        found = np.full(len(contact.face_names), -np.inf)
        np.maximum.at(found, contact.faces, deepest)
        return found

    def part(self, count: int) -> ModalMap | None:
        """Return the flow over the first of `count` equal parts of the period; None where these have no whole steps."""
        return replace(self, steps=self.steps // count) if self.steps % count == 0 else None

    def tangent_along(self, places: Array) -> Array:
        """Return the derivative of the state by that a period before, (2n, 2n), along q at the ends of all steps."""
        return monodromy_along(self.modal, self.law, self.scheme.implicit, self.dt, places)

    def history(self, x: Array) -> tuple[Array, Array]:
        """Return the DOFs at the start and the ends of all steps, (steps + 1, n), and face forces at the ends, N."""
        records = [block.records for block in self._loop.blocks(self.state(x))]
        places = np.concatenate([x[None, : len(self.modal.squares)], *(part.q for part in records)])
        return self.modal.dofs(places), np.concatenate([part.force for part in records])

    @cached_property
    def _loop(self) -> CompiledLoop:
        return CompiledLoop(self.plan)
