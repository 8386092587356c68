"""The static seat: contact equilibrium under the static loads, the start of every run.

    K u = f + G^T (w p),    p = law(d),    d = -(g0 + G u)

A beam with play is held by contact alone, so K by itself is (nearly) singular. The proximal point iteration

    (K + s G^T w G) (u' - u) = f + G^T (w p(u')) - K u

solves a strictly convex contact problem in each iteration and converges to an equilibrium for every s > 0, from
any start and for any clearance; its residual is formed with K, so s leaves no trace in the answer. The springs s
on both faces hold just the motions that the weak restraint leaves free; s well below the contact stiffness makes
the iteration contract fast, and not much smaller keeps the first free motion moderate.

A rigid motion that only the weak restraint holds has hardly any energy: a beam that tips over the edge of a support
would pass the test of the energy norm while the springs s let it turn by the same angle in each iteration. Therefore
the gaps have to be at rest, too.

Nothing slides at rest, so the regularized friction bears nothing: the seat is found without it.

Source: Rockafellar (1976) for the proximal point algorithm.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.contact.solve.contact_solve import solve_contact
from gapbeam.solver.contact.solve.matrix_free_condensation import Condensed, condensed_operator
from gapbeam.solver.errors import NotConverged
from gapbeam.solver.system.operators import Array, Operators, Springs
from gapbeam.solver.system.semi_discrete import (
    STIFFNESS,
    VALUE,
    ContactOperator,
    Imaged,
    SemiDiscreteSystem,
    State,
    imaged,
)

MAX_ITERATIONS = 400
TOLERANCE = 1.0e-12  # of the energy norm
INNER_TOLERANCE = 1.0e-6  # of iterative solves: each iteration mends what the one before has left
STALLED = 1.0e-6
NOISE_SAFETY = 10.0
NOISY = 3  # updates that have stopped to contract
ROLLED = 1.0e-9  # of the clearance of a round hole: an update at rest
STILL = 1.0e-7, 1.0e-3  # of the largest gap and of the penetration: changes of gaps at rest


@dataclass(frozen=True, repr=False)
class Seat:
    """The seated state at t = 0, the size of the last update (energy norm, relative), and the iterations."""

    state: State
    last_update: float
    iterations: int

    def __repr__(self) -> str:
        return f"<Seat in {self.iterations} iterations, last update {self.last_update:.1e}: {self.state!r}>"


def find_seat(system: SemiDiscreteSystem, law: ContactLaw, springs: float, carries_acceleration: bool = False) -> Seat:
    """Find the contact equilibrium under the static loads.

    Args:
        system: The system; loads with `static` act with their factor at t = 0.
        law: The contact law; its damping plays no part.
        springs: s, Pa/m; well below the stiffness of the contact and of the body.
        carries_acceleration: Whether the state needs a (zero) acceleration.

    Returns:
        The seat, at rest.

    Raises:
        NotConverged: No equilibrium found: nothing holds the beam against the static loads.

    Collective.
    """
    system = replace(system, contact=replace(system.contact, tangents=None))
    contact, operators = system.contact, system.operators
    held, condensed = contact.springs(springs), None
    force = system.combine_loads(np.array([load.factor(0.0) if load.static else 0.0 for load in system.loads]))
    u: Imaged = np.zeros((3, operators.size))
    depth = contact.depth(np.zeros(contact.interface.size))
    point_forces: Array = np.zeros(contact.size)
    updates, moves = list[float](), list[float]()
    for iteration in range(1, MAX_ITERATIONS + 1):
        if condensed is None or contact.turning is not None:
            contact, condensed = _held(system, held, u[VALUE], point_forces)
        unbalanced = force - u[STIFFNESS]
        contact.interface.add(unbalanced, contact.resultant(point_forces))
        free = condensed.solve_free(unbalanced)
        held_depth = depth - contact.gap_matrix @ contact.interface.trace(free, operators)
        try:
            solution = solve_contact(
                condensed, 1.0, held_depth, contact.weights, law.static, point_forces, augmented=law.augmented
            )
        except NotConverged as error:
            worst = int(np.argmax(depth)) if error.worst_point is None else error.worst_point
            why = _unsettled(contact, worst, point_forces, depth)
            raise NotConverged(f"no static seat was found: {error}; {why}", error.residuals, worst) from error
        moved, u = -u, imaged(operators, u[VALUE] + condensed.correct(free, solution.change, None, solution.response))
        moved += u
        point_forces = solution.forces
        before, depth = depth, contact.depth(contact.interface.trace(u[VALUE], operators))
        energy, change = system.dots([(u[VALUE], u[STIFFNESS]), (moved[VALUE], moved[STIFFNESS])])
        potential = 2.0 * float(contact.weights @ law.potential(depth))
        updates.append(float(np.sqrt(abs(change) / (abs(energy) + potential))) if change != 0.0 else 0.0)
        settled = updates[-1] <= TOLERANCE
        if not settled and _is_noise(updates):
            noise = _noise(system, condensed, u[VALUE]) / (abs(energy) + potential)
            settled = updates[-1] <= max(STALLED, NOISE_SAFETY * float(np.sqrt(noise)))
        moves.append(float(np.max(np.abs(depth - before))))
        limit = STILL[0] * float(np.max(np.abs(depth))) + STILL[1] * max(float(np.max(depth)), 0.0)
        if settled and moves[-1] > limit:
            settled = False
            if _creeps(moves):
                raise NotConverged(f"no static seat was found: {_tips(contact, depth - before)}", tuple(updates))
        if settled and _stand_still(contact, moved[VALUE], operators):
            pressure = point_forces / contact.weights
            return Seat(_at_rest(u, depth, pressure, carries_acceleration), updates[-1], iteration)
    worst, tips = int(np.argmax(np.abs(depth - before))), _creeps(moves) and bool(np.any(point_forces))
    raise NotConverged(
        f"no static seat was found in {MAX_ITERATIONS} iterations (last relative update {updates[-1]:.2e}): "
        f"{_tips(contact, depth - before) if tips else _unsettled(contact, worst, point_forces, depth)}",
        tuple(updates),
        worst,
    )


def _held(system: SemiDiscreteSystem, held: Springs, u: Array, forces: Array) -> tuple[ContactOperator, Condensed]:
    """Return the contact with the directions of a pose, and an operator with springs that holds these directions.

    The penetration along them is a lower bound of the penetration itself, which the next iteration sees.
    """
    if system.contact.turning is not None:
        values = system.contact.interface.trace(u, system.operators)
        held = replace(held, matrix=held.matrix + system.contact.holding(forces, values))
        system = replace(system, contact=system.contact.at(values))
    condensed = condensed_operator(system, 0.0, 1.0, springs=held, seldom=True)
    condensed.loosen(INNER_TOLERANCE)
    return system.contact, condensed


def _stand_still(contact: ContactOperator, moved: Array, operators: Operators) -> bool:
    """Return whether stations in round holes no longer roll along their walls, which takes no energy. Collective."""
    if (circles := contact.turning) is None:
        return True
    rolled = np.abs(circles.plane @ contact.interface.trace(moved, operators))
    return bool(np.max(rolled) <= ROLLED * np.max(circles.clearances))


def _unsettled(contact: ContactOperator, worst: int, point_forces: Array, depth: Array) -> str:
    """Return what does not settle, where, and what to try."""
    face = contact.face_names[int(contact.faces[worst])]
    place = f"{face} at x = {contact.positions[worst, 0]:.4g} m"
    pressed = int(np.count_nonzero(point_forces))
    if pressed == 0:
        either = ", ".join(contact.face_names) + " nor restraint"
        return (
            f"the static loads push the beam where neither {either} holds it; the gap of {place} is "
            f"{-depth[worst]:.3g} m and still changes; check the direction of gravity and [restraint]"
        )
    return (
        f"{pressed} of {contact.size} contact points press, and the {place} still opens and closes most; a transient "
        'with analysis.start = "undeformed" needs no seat: the beam falls to it'
    )


def _creeps(moves: list[float]) -> bool:
    """Return whether the gaps go on changing by about the same."""
    return len(moves) > NOISY and min(moves[-NOISY:]) >= 0.5 * max(moves[-NOISY:])


def _tips(contact: ContactOperator, moved: Array) -> str:
    """Return which way the beam goes on moving as a rigid body, and what to try."""
    farthest = int(np.argmax(np.abs(moved)))
    face = contact.face_names[int(contact.faces[farthest])]
    way = "into" if moved[farthest] > 0.0 else "off"
    return (
        f"the static loads move the beam on as a rigid body, {way} {face} at "
        f"x = {contact.positions[farthest, 0]:.4g} m, and nothing but the weak restraint holds the beam; it tips over "
        "where its center of mass lies beyond the last plane below; check the places of supports and the direction of "
        'loads; a transient with analysis.start = "undeformed" needs no seat'
    )


def _is_noise(updates: list[float]) -> bool:
    """Return whether the updates no longer contract: the last ones are not half of the one before them."""
    return len(updates) > NOISY and min(updates[-NOISY:]) >= 0.5 * updates[-NOISY - 1]


def _noise(system: SemiDiscreteSystem, condensed: Condensed, u: Array) -> float:
    """Return twice the energy of an update that round-off in K u alone makes. Collective."""
    signs = np.random.default_rng(0).choice([-1.0, 1.0], len(u))
    moved = condensed.solve_free(signs * system.operators.stiffness_round_off(u))
    return abs(float(system.dots([(moved, system.operators.apply_stiffness(moved))])[0]))


def _at_rest(u: Imaged, depth: Array, pressure: Array, carries_acceleration: bool) -> State:
    rest = np.zeros_like(u)
    return State(
        time=0.0,
        u=u,
        v=rest,
        depth=depth,
        pressure=pressure,
        a=rest.copy() if carries_acceleration else None,
    )
