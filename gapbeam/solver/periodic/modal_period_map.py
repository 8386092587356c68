"""Period map of a dense system in modal coordinates, x = (q, v); laws that kernels lack are marched step by step."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.errors import NotConverged
from gapbeam.solver.integrators.time_scheme import TimeScheme
from gapbeam.solver.march.compiled.compiled_march import CompiledLoop
from gapbeam.solver.march.compiled.turning_tangent import monodromy_along
from gapbeam.solver.march.python.march import EffectiveOperators, March, march
from gapbeam.solver.periodic.floquet import Stability, stability_of
from gapbeam.solver.system.modal_coordinates import ModalSystem
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import VALUE, State, imaged


class PassedPeriod(NamedTuple):
    """A period.

    Attributes:
        end: Its end.
        places: DOFs at the start and the ends of all steps, (steps + 1, n), m.
        forces: Contact force of each face at these ends, (steps, faces), N.
        halved: Steps that converged only in parts.
    """

    end: State
    places: Array
    forces: Array
    halved: int


def passed_period(plan: March, start: State) -> PassedPeriod:
    """March all steps of a plan in Python.

    Raises:
        NotConverged: A step did not converge at the smallest size.
    """
    contact, end, halved = plan.system.contact, start, 0
    places, forces = [start.u[VALUE]], list[Array]()
    for step in march(plan, start):
        halved += step.failures
        end = step.refreshed or step.new
        if step.completes:
            places.append(end.u[VALUE])
            point_forces = contact.weights * step.new.pressure
            found = np.bincount(contact.faces, point_forces, minlength=len(contact.face_names))
            forces.append(found.astype(float))
    return PassedPeriod(end, np.array(places), np.array(forces), halved)


def refuse_parts(passed: PassedPeriod, dt: float) -> None:
    """Refuse a period along which no derivative is taken.

    Raises:
        NotConverged: Steps converged only in parts.
    """
    if passed.halved:
        raise NotConverged(
            f"{passed.halved} steps of {dt:.3g} s up to t = {passed.end.time:.6g} s converged only in parts, along "
            "which no derivative is taken; take more steps or a softer contact"
        )


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

    def coordinates(self, state: State) -> Array:
        """Return a state as x, (2n,)."""
        return np.concatenate([self.modal.coordinates(part[VALUE]) for part in (state.u, state.v)])

    def after(self, x: Array) -> Array:
        """Return P(x), (2n,)."""
        if self.law.why_not_compiled is not None:
            return self.coordinates(passed_period(self.plan, self.state(x)).end)
        for block in self._loop.blocks(self.state(x), self.steps):
            end = block.motion
        return np.concatenate([end.q, end.v])

    def with_tangent(self, x: Array) -> tuple[Array, Array]:
        """Return P(x), (2n,), and P'(x), (2n, 2n)."""
        if self.law.why_not_compiled is not None:
            passed = passed_period(self.plan, self.state(x))
            refuse_parts(passed, self.dt)
            places = np.array([self.modal.coordinates(place) for place in passed.places])
            return self.coordinates(passed.end), self.tangent_along(places)
        end, tangent = self._loop.tangent(self.state(x))
        return self.coordinates(end), tangent

    def stability(self, tangent: Array) -> Stability:
        """Return the multipliers of P'(x), (2n, 2n)."""
        return stability_of(tangent)

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
        if self.law.why_not_compiled is not None:
            passed = passed_period(self.plan, self.state(x))
            return passed.places, passed.forces
        records = [block.records for block in self._loop.blocks(self.state(x))]
        places = np.concatenate([x[None, : len(self.modal.squares)], *(part.q for part in records)])
        return self.modal.dofs(places), np.concatenate([part.force for part in records])

    @cached_property
    def _loop(self) -> CompiledLoop:
        return CompiledLoop(self.plan)
