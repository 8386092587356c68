"""The period map of a dense system in modal coordinates, x = (q, v)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from solver.analyses.transient import EffectiveOperators, March, march
from solver.contact.law import ContactLaw
from solver.integrators.midpoint import Midpoint
from solver.modal import ModalSystem
from solver.operators import Array
from solver.periodic.modal_tangent import monodromy
from solver.system import VALUE, State, Step, imaged


@dataclass(frozen=True)
class ModalMap:
    """A period in whole midpoint steps.

    Attributes:
        modal: The system; its loads are those of the steady state.
        law: Contact law.
        scheme: Midpoint rule.
        dt: Step, s.
        steps: Steps in the period.
    """

    modal: ModalSystem
    law: ContactLaw
    scheme: Midpoint
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

    def with_steps(self, steps: int) -> ModalMap:
        """Return the map of the same period in other steps."""
        return replace(self, dt=self.period / steps, steps=steps)

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

    def steps_from(self, x: Array, periods: int = 1) -> Iterator[Step]:
        """Yield the steps of some periods."""
        plan = March(self.modal.system, self.law, self.scheme, self._operators, self.dt, periods * self.steps)
        return march(plan, self.state(x))

    def after(self, x: Array) -> Array:
        """Return P(x), (2n,)."""
        return self.coordinates(list(self.steps_from(x))[-1].new)

    def with_tangent(self, x: Array) -> tuple[Array, Array]:
        """Return P(x), (2n,), and P'(x), (2n, 2n)."""
        steps = list(self.steps_from(x))
        depths = np.array([steps[0].old.depth, *(step.new.depth for step in steps)])
        tangent = monodromy(self.modal, self.law, self.scheme.implicit, self.dt, depths)
        return self.coordinates(steps[-1].new), tangent

    def history(self, x: Array) -> tuple[Array, Array]:
        """Return the DOFs at the ends of all steps, (steps + 1, n), and point forces in them, (steps, m), N."""
        steps = list(self.steps_from(x))
        weights = self.modal.system.contact.weights
        places = np.array([steps[0].old.u[VALUE], *(step.new.u[VALUE] for step in steps)])
        return places, np.array([weights * step.stage.pressure for step in steps])

    @cached_property
    def _operators(self) -> EffectiveOperators:
        return EffectiveOperators(self.modal.system, self.scheme)
