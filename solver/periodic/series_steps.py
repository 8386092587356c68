"""A harmonic solution as steps, so that what consumes the steps of a march can consume it.

States are those of the series at the ends of a step, the balance is that of the series in its middle. The energy ledger
is then its quadrature by the midpoint rule, and its residual the power of what the harmonics leave of the balance.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from solver.contact.law import ContactLaw
from solver.modal import ModalSystem
from solver.operators import Array
from solver.periodic.harmonic_balance import HarmonicSolution
from solver.system import MASS, STIFFNESS, Stage, State, Step, imaged


def series_steps(
    modal: ModalSystem, law: ContactLaw, solution: HarmonicSolution, dt: float, steps: int
) -> tuple[State, Iterator[Step]]:
    """Return the state at t = 0 and the steps that follow.

    Args:
        modal: The system.
        law: Its contact law.
        solution: The harmonics.
        dt: Step, s.
        steps: Number of steps.
    """
    places, speeds, rates = solution.motion(np.asarray(0.5 * dt * np.arange(2 * steps + 1), dtype=float))

    def state(number: int) -> State:
        u, v = (imaged(modal.system.operators, modal.dofs(part[number])) for part in (places, speeds))
        depth, pressure, _ = _contact(modal, law, places[number], speeds[number])
        return State(0.5 * dt * number, u, v, depth, pressure)

    def step(old: State, number: int) -> Step:
        middle = 2 * number + 1
        _, pressure, elastic = _contact(modal, law, places[middle], speeds[middle])
        images = (imaged(modal.system.operators, modal.dofs(part[middle])) for part in (places, speeds, rates))
        u, v, a = images
        factors = modal.system.load_factors(0.5 * dt * middle)
        stage = Stage(factors, a[MASS] + u[STIFFNESS], v, pressure, elastic)
        return Step(old, state(middle + 1), stage, 0, timings={"back_substitution": 0.0})

    def walk() -> Iterator[Step]:
        old = state(0)
        for number in range(steps):
            made = step(old, number)
            yield made
            old = made.new

    return state(0), walk()


def _contact(modal: ModalSystem, law: ContactLaw, q: Array, rate: Array) -> tuple[Array, Array, Array]:
    """Return penetration, pressure and its elastic part at the contact points, (m,) each."""
    depth = np.asarray(-(modal.system.contact.initial_gap + modal.gaps @ q))
    found = law.instant(depth, -(modal.gaps @ rate))
    return depth, found.pressure, found.elastic
