"""The static seat: contact equilibrium under the static loads, the start of every run.

    K u = f + G^T (w p),    p = law(d),    d = -(g0 + G u)

A beam with play is held by contact alone, so K by itself is (nearly) singular. The proximal point iteration

    (K + sigma M) (u' - u) = f + G^T (w p(u')) - K u

solves a strictly convex contact problem in each iteration and converges to an equilibrium for every sigma > 0,
from any start and for any clearance; its residual is formed with K, so sigma leaves no trace in the answer.

Source: Rockafellar (1976) for the proximal point algorithm.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solver.condensation import CondensedOperator
from solver.contact.kelvin_voigt import KelvinVoigt
from solver.contact.solve import solve_contact
from solver.errors import NotConverged
from solver.system import Array, SemiDiscreteSystem, State, imaged

MAX_ITERATIONS = 400
TOLERANCE = 1.0e-13
STALLED = 1.0e-8


@dataclass(frozen=True)
class Seat:
    """The seated state at t = 0, the relative size of the last update, and the number of iterations."""

    state: State
    last_update: float
    iterations: int


def find_seat(
    system: SemiDiscreteSystem, law: KelvinVoigt, shift: float, carries_acceleration: bool = False
) -> Seat:
    """Find the contact equilibrium under the static loads.

    Args:
        system: The system; loads with `static` act with their factor at t = 0.
        law: The contact law; its damping plays no part.
        shift: sigma, 1/s^2; well below the squared angular frequency of the seated beam.
        carries_acceleration: Whether the state needs a (zero) acceleration.

    Returns:
        The seat, at rest.

    Raises:
        NotConverged: No equilibrium found: nothing holds the beam against the static loads.

    Collective.
    """
    contact, operators = system.contact, system.operators
    condensed = CondensedOperator(system, shift, 1.0)
    force = system.combine_loads(
        np.array([load.factor(0.0) if load.static else 0.0 for load in system.loads])
    )
    u = np.zeros(operators.size)
    depth, point_forces = contact.depth(np.zeros(contact.interface.size)), np.zeros(contact.size)
    updates: list[float] = []
    for iteration in range(1, MAX_ITERATIONS + 1):
        free = condensed.solve_free(force - operators.apply_stiffness(u))
        free_depth = depth - contact.gap_matrix @ contact.interface.trace(free, operators)
        solution = solve_contact(
            condensed, 1.0, free_depth, contact.weights, law.static, law.stiffness, point_forces
        )
        update = condensed.correct(free, solution.forces)
        u = u + update
        point_forces = solution.forces
        depth = contact.depth(contact.interface.trace(u, operators))
        size, change = (float(np.sqrt(x)) for x in system.dots([(u, u), (update, update)]))
        updates.append(change / size if size > 0.0 else 0.0)
        if updates[-1] <= TOLERANCE or (updates[-1] < STALLED and updates[-1] >= 0.5 * updates[-2]):
            return Seat(_at_rest(system, law, u, depth, carries_acceleration), updates[-1], iteration)
    raise NotConverged(
        f"no static seat was found in {MAX_ITERATIONS} iterations (last relative update {updates[-1]:.2e}): "
        "the static loads push the beam where neither base, gland nor restraint holds it; "
        "check the direction of gravity and [restraint]",
        tuple(updates),
    )


def _at_rest(
    system: SemiDiscreteSystem, law: KelvinVoigt, u: Array, depth: Array, carries_acceleration: bool
) -> State:
    rest = np.zeros((3, len(u)))
    return State(
        time=0.0,
        u=imaged(system.operators, u),
        v=rest,
        depth=depth,
        pressure=law.static(depth).pressure,
        a=rest.copy() if carries_acceleration else None,
    )
