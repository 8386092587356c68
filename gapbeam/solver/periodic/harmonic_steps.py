"""A harmonic solution as steps, so that what consumes the steps of a march can consume it.

States are those of the series at the ends of a step, the balance is that of the series in its middle. The energy ledger
is then its quadrature by the midpoint rule, and its residual the power of what the harmonics leave of the balance.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.contact.solve.contact_solve import UNRESOLVED
from gapbeam.solver.periodic.harmonic_balance import HarmonicSolution
from gapbeam.solver.system.accepted_step import Stage, Step
from gapbeam.solver.system.modal_coordinates import ModalSystem
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import MASS, STIFFNESS, State, imaged


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
    operators, weights = modal.system.operators, modal.system.contact.weights
    depths = -(modal.system.contact.initial_gap + places[::2] @ modal.gaps.T)
    before = law.discrete_gradient(depths[-2], depths[-1], dt).pressure

    def state(number: int, pressure: Array) -> State:
        u, v = (imaged(operators, modal.dofs(part[2 * number])) for part in (places, speeds))
        return State(dt * number, u, v, depths[number], pressure)

    def walk(old: State) -> Iterator[Step]:
        for number in range(steps):
            middle = 2 * number + 1
            u, v, a = (imaged(operators, modal.dofs(part[middle])) for part in (places, speeds, rates))
            law_there = law.discrete_gradient(depths[number], depths[number + 1], dt)
            factors = modal.system.load_factors(0.5 * dt * middle)
            unresolved = UNRESOLVED * float(np.max(np.abs(depths[number]))) * float(weights @ law_there.pressure)
            stage = Stage(
                factors, a[MASS] + u[STIFFNESS], v, law_there.pressure, law_there.elastic, unresolved=unresolved
            )
            new = state(number + 1, law_there.pressure)
            yield Step(old, new, stage, 0, timings={"back_substitution": 0.0})
            old = new

    start = state(0, before)
    return start, walk(start)
