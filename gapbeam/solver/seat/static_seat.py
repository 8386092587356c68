"""The static seat: contact equilibrium under the static loads, the start of every run.

    K u = f + G^T (w p),    p = law(d),    d = -(g0 + G u)

A beam with play is held by contact alone, so K by itself is (nearly) singular. The proximal point iteration

    (K + G^T w S G) (u' - u) = f + G^T (w p(u')) - K u

solves a strictly convex contact problem in each iteration and converges to an equilibrium for all springs S > 0, from
any start and for any clearance; its residual is formed with K, so S leaves no trace in the answer. The springs S = s
on both faces hold just the motions that the weak restraint leaves free; s well below the contact stiffness makes
the iteration contract fast, and not much smaller keeps the first free motion moderate.

Where a long face peels, the part that is lifted is softer than these springs, and the iteration creeps. A Newton stage
(below) then finds the active set, and the iteration continues from there. Springs of points that do not
press become softer while it creeps, down to nothing: it converges faster than linearly, and each of its problems is
convex still. An iteration whose contact problem is too hard to solve is tried again with stiffer springs.

Contact in round holes is linear along directions that turn with the beam. Its potential is convex, too, and an exact
line search along each update keeps it falling.

A rigid motion that only the weak restraint holds has hardly any energy: a beam that tips over the edge of a support
would pass the test of the energy norm while the springs s let it turn by the same angle in each iteration, and a rigid
beam has no other energy. Therefore the gaps have to be at rest, too. That there is no seat is said where a linear
program (`seat.escape`) finds the rigid motion by which the beam leaves.

Nothing slides at rest, so the regularized friction bears nothing: the seat is found without it.

Source: Rockafellar (1976) for the proximal point algorithm, and its convergence as the springs soften.

The Newton stage finds active sets with the true tangent and an exact line search on the potential energy.

    E(u) = u^T K u / 2 - f^T u + sum w psi(d(u)),    d = -(g0 + G u),  |r(u)| - c in round holes

is convex, as all laws rise. Each iteration solves

    (K + G^T (w kappa) G + N + r G0^T w G0) du = f + G^T (w p) - K u

with the slopes kappa of the law where it presses, N what contact in round holes adds as it turns, and springs r that
fade from iteration to iteration: they hold what no contact holds yet. A line search along du finds the least energy, so
that the energy falls in each iteration, from any start. Softer laws lead to the law itself: their active sets are found
in a few iterations each.

Pressures of a nearly rigid law are lost in the round-off of depths. Such a law is followed as far as depths resolve the
mean pressure; the proximal iteration of `seat.static_seat`, which knows forces, takes over from there.

Source: Christensen (2002) and Qi and Sun (1993) for semi-smooth Newton methods with a line search.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gapbeam.solver.contact.formulations.contact_points import ResultantOperator
from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.contact.solve.condensation import Condensed, condensed_operator
from gapbeam.solver.contact.solve.contact_solve import ContactSolution, solve_contact
from gapbeam.solver.contact.solve.step_length import root_of_slope
from gapbeam.solver.messages.errors import NotConverged
from gapbeam.solver.seat.escape import RigidMotions, find_escape
from gapbeam.solver.system.dense_operators import DenseOperators
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

SOFTENED = (1.0e-6, 1.0e-4, 1.0e-2, 1.0)  # shares of the law on the way to it
MOST = 40  # iterations with each
FADES = 0.1  # springs over those of the iteration before
FAINTEST = 1.0e-12  # springs over those of the first iteration
FIRMER = 1.0e4  # springs over those that round-off in the operator hid
RESOLVED = 1.0e-4  # of the mean pressure: what round-off of depths may hide
DONE, ROUGH = 1.0e-16, 1.0e-8  # of the energy: work that an iteration can still do, and that with softer laws
NEWTON_STAGE_STALLED = 1.0e-10  # likewise, where it no longer falls
WHOLE = 0.1  # slope of the energy at the end of a step over that at its start: the whole step is taken


def takes_newton(system: SemiDiscreteSystem) -> bool:
    """Return whether the tangent of a system can be made: contact has a potential, and K has room for its entries."""
    contact = system.contact
    gathered = isinstance(contact, ResultantOperator)
    return contact.symmetric and (isinstance(system.operators, DenseOperators) or not gathered)


def newton_stage(
    system: SemiDiscreteSystem, law: ContactLaw, springs: float, force: Array, u: Array, forces: Array
) -> tuple[Array, Array]:
    """Return the displacement of the least energy, (n,), m, and the contact forces there, (m,), N, or close to them.

    Args:
        system: The system, without tangents.
        law: The contact law; its damping plays no part.
        springs: r of the first iteration, Pa/m.
        force: The static loads f, (n,), N.
        u: Displacement to start from, (n,), m.
        forces: About the contact forces there, (m,), N.

    Collective.
    """
    operators, contact = system.operators, system.contact
    hardest = _resolved_share(system, law, float(np.sum(forces)), u)
    for share in SOFTENED:
        softened = law.softened(hardest * share) if hardest * share < 1.0 else law
        fading, last = springs, np.inf
        for _ in range(MOST):
            values = contact.interface.trace(u, operators)
            here, depth = contact.at(values), contact.depth(values)
            stage = softened.static(depth)
            forces = contact.weights * stage.pressure
            unbalanced = force - operators.apply_stiffness(u)
            contact.interface.add(unbalanced, here.resultant(forces))
            gaps = here.gap_matrix
            matrix = gaps.T @ gaps.multiply((contact.weights * stage.slope)[:, None]) + here.holding(forces, values)
            try:
                held = Springs(contact.interface, (matrix + contact.springs(fading).matrix).tocsr())
                update = operators.factor(0.0, 1.0, held).solve(unbalanced)
            except NotConverged:
                if fading >= springs:
                    return u, forces
                fading = min(FIRMER * fading, springs)
                continue
            first, second, energy, done = system.dots(
                [
                    (update, unbalanced),
                    (update, operators.apply_stiffness(update)),
                    (u, operators.apply_stiffness(u)),
                    (u, force),
                ]
            )
            potential = float(contact.weights @ softened.potential(depth))
            scale = abs(energy) + 2.0 * potential + abs(done)
            if first <= (DONE if share == 1.0 else ROUGH) * scale or (
                first >= 0.5 * last and first <= NEWTON_STAGE_STALLED * scale
            ):
                break
            last = first
            u = u + _length(system, softened, force, u, update, float(second)) * update
            fading = max(FADES * fading, FAINTEST * springs)
    return u, forces


def _length(system: SemiDiscreteSystem, law: ContactLaw, force: Array, u: Array, update: Array, second: float) -> float:
    """Return the length in (0, 1] of an update that minimizes the energy. Collective."""
    contact, operators = system.contact, system.operators
    [first] = system.dots([(update, operators.apply_stiffness(u) - force)])
    values, change = (contact.interface.trace(x, operators) for x in (u, update))

    def slope(length: float) -> float:
        there = values + length * change
        forces = contact.weights * law.static(contact.depth(there)).pressure
        return float(first + length * second - forces @ (contact.at(there).gap_matrix @ change))

    if slope(1.0) <= -WHOLE * slope(0.0):
        return 1.0
    return root_of_slope(slope) if slope(0.0) < 0.0 else 1.0


def _resolved_share(system: SemiDiscreteSystem, law: ContactLaw, total: float, u: Array) -> float:
    """Return the share of a law whose mean pressure is not hidden by round-off of depths. Collective."""
    contact, operators = system.contact, system.operators
    if law.spring.exponent != 1.0 or total <= 0.0:
        return 1.0
    depth = contact.depth(contact.interface.trace(u, operators))
    hidden = law.stiffness * np.finfo(float).eps * float(np.max(np.abs(depth)))
    return min(1.0, RESOLVED * total / contact.area / hidden) if hidden > 0.0 else 1.0


MAX_ITERATIONS = 400
TOLERANCE = 1.0e-12  # of the energy norm
INNER_TOLERANCE = 1.0e-6  # of iterative solves: each iteration mends what the one before has left
STALLED = 1.0e-6
NOISE_SAFETY = 10.0
NOISY = 3  # updates that have stopped to contract
ROLLED = 1.0e-9  # of the clearance of a round hole: an update at rest
UNCERTAIN = 1.0e-6  # of that clearance: what round-off may hide of an update
STILL = 1.0e-7  # of the largest gap: a change of gaps at rest
SETTLED, ROUGHLY = 1.0e-6, 1.0e-3  # of the penetration, likewise; where round-off keeps changes from contracting
PATIENCE = 8  # iterations with springs that do not change
SLOW = 0.1  # of the update two iterations before: the iteration creeps
HARD = 2  # iterations whose contact problem took softer laws
SOFTER, SOFTEST = 0.1, 1.0e-12  # springs of open points over those before, and over s
LEFT = 1.0e-2  # of the length from the first to the last contact point: a change of gaps
AFTER_NEWTON = 1.0e-6  # springs of open points over s
STIFFER, STIFFEST = 100.0, 1.0e6  # likewise, where a contact problem is not solved
MAX_RETRIES = 20
TRIED = 20  # iterations of a contact problem, before softer laws lead to its solution
ALIKE = 0.1  # difference of the factors of two updates over what they lack of 1: a geometric series
OVERSHOT = 0.5  # slope of the potential at the end of an update over that at its start


@dataclass(frozen=True, repr=False)
class Seat:
    """The seated state at t = 0, the size of the last update (energy norm, relative), and the iterations."""

    state: State
    last_update: float
    iterations: int

    def __repr__(self) -> str:
        return f"<Seat in {self.iterations} iterations, last update {self.last_update:.1e}: {self.state!r}>"


def find_seat(
    system: SemiDiscreteSystem,
    law: ContactLaw,
    springs: float,
    carries_acceleration: bool = False,
    rigid: Callable[[], RigidMotions] | None = None,
) -> Seat:
    """Find the contact equilibrium under the static loads.

    Args:
        system: The system; loads with `static` act with their factor at t = 0.
        law: The contact law; its damping plays no part.
        springs: s, Pa/m; well below the stiffness of the contact and of the body.
        carries_acceleration: Whether the state needs a (zero) acceleration.
        rigid: Returns the rigid motions of the system, by which the beam may leave; None: they are not known.

    Returns:
        The seat, at rest.

    Raises:
        NotConverged: No equilibrium was found: a rigid motion that nothing opposes leads away, or the iteration failed.

    Collective.
    """
    return _Search(replace(system, contact=replace(system.contact, tangents=None)), law, springs, rigid).seat(
        carries_acceleration
    )


class _Search:
    """Iteration for a seat: present state and counts."""

    def __init__(
        self, system: SemiDiscreteSystem, law: ContactLaw, springs: float, rigid: Callable[[], RigidMotions] | None
    ) -> None:
        self._system, self._law, self._springs, self._rigid = system, law, springs, rigid
        self._contact, self._operators = system.contact, system.operators
        self._force = system.combine_loads(np.array([one.factor(0.0) if one.static else 0.0 for one in system.loads]))
        self._u: Imaged = np.zeros((3, self._operators.size))
        self._depth = self._contact.depth(np.zeros(self._contact.interface.size))
        self._before = self._depth
        self._forces: Array = np.zeros(self._contact.size)
        self._condensed: Condensed | None = None
        self._share, self._least, self._patience, self._failed = 1.0, SOFTEST, PATIENCE, 0
        self._held: NDArray[np.bool_] = np.zeros(0, dtype=bool)
        self._updates, self._moves, self._hard = list[float](), list[float](), 0

    def seat(self, carries_acceleration: bool) -> Seat:
        """Iterate until the seat is found; errors as in `find_seat`. Collective."""
        system, contact, law = self._system, self._contact, self._law
        updates, looked, retries = self._updates, False, 0
        while len(updates) < MAX_ITERATIONS:
            try:
                moved = self._iterate()
            except NotConverged as error:
                self._refuse_escape(looked)
                looked, retries = True, retries + 1
                if retries > MAX_RETRIES or self._share >= STIFFEST:
                    worst = int(np.argmax(self._depth)) if error.worst_point is None else error.worst_point
                    raise NotConverged(
                        f"no static seat was found: {error}; {self._unsettled(worst)}", error.residuals, worst
                    ) from error
                self._share, self._condensed = min(STIFFER * self._share, STIFFEST), None
                self._least, self._failed = min(self._share, 1.0), len(updates)
                continue
            energy, change = system.dots([(self._u[VALUE], self._u[STIFFNESS]), (moved[VALUE], moved[STIFFNESS])])
            potential = 2.0 * float(contact.weights @ law.potential(self._depth))
            updates.append(float(np.sqrt(abs(change) / (abs(energy) + potential))) if change != 0.0 else 0.0)
            noise = self._round_off() if updates[-1] > TOLERANCE and _is_noise(updates) else None
            settled = updates[-1] <= TOLERANCE
            if noise is not None:
                hidden = float(system.dots([(noise, self._operators.apply_stiffness(noise))])[0])
                settled = updates[-1] <= max(
                    STALLED, NOISE_SAFETY * float(np.sqrt(abs(hidden) / (abs(energy) + potential)))
                )
            self._moves.append(float(np.max(np.abs(self._depth - self._before))))
            still = self._moves[-1] <= self._limit(noise is not None)
            settled = settled and still
            if settled and _stand_still(contact, self._forces, moved[VALUE], noise, self._operators):
                self._refuse_escape(looked or not self._has_left())
                pressure = self._forces / contact.weights
                return Seat(_at_rest(self._u, self._depth, pressure, carries_acceleration), updates[-1], len(updates))
            rates = updates if updates[-1] > 0.0 else self._moves  # a rigid motion about a joint takes no strain energy
            slow = len(rates) >= PATIENCE and not rates[-1] <= SLOW * rates[-3]
            creeps = slow and not (still and updates[-1] <= STALLED)  # softer springs would let it drift by round-off
            if creeps or (self._hard >= HARD and not looked):
                self._refuse_escape(looked)
                if not looked and takes_newton(system):
                    self._take_newton()
                looked = True
                if len(updates) - self._failed >= self._patience:  # another pose may take softer springs
                    self._least, self._patience = SOFTEST, 2 * self._patience
                if self._share == self._least:
                    self._leap(moved)
                else:
                    self._share, self._condensed = max(SOFTER * self._share, self._least), None
        self._refuse_escape(looked)
        worst = int(np.argmax(np.abs(self._depth - self._before)))
        raise NotConverged(
            f"no static seat was found in {MAX_ITERATIONS} iterations (last relative update {updates[-1]:.2e}): "
            f"{self._unsettled(worst)}",
            tuple(updates),
            worst,
        )

    def _limit(self, noisy: bool) -> float:
        """Return the change of gaps that counts as none, m; energy alone does not tell where a beam hardly bends."""
        pressed = ROUGHLY if noisy or _is_noise(self._moves) else SETTLED
        return STILL * float(np.max(np.abs(self._depth))) + pressed * max(float(np.max(self._depth)), 0.0)

    def _take_newton(self) -> None:
        """Go where the Newton stage leads, and on from there with soft springs. Collective."""
        start = self._u[VALUE]
        found, self._forces = newton_stage(self._system, self._law, self._springs, self._force, start, self._forces)
        self._u = imaged(self._operators, found)
        self._depth = self._contact.depth(self._contact.interface.trace(found, self._operators))
        self._share = AFTER_NEWTON

    def _iterate(self) -> Imaged:
        """Take an iteration, and return by how much the beam moved."""
        pressed = self._forces > 0.0
        turns = len(self._contact.circles) > 0
        if self._condensed is None or turns or (self._share != 1.0 and not np.array_equal(pressed, self._held)):
            stiffness: float | Array = self._springs
            if self._share != 1.0:
                stiffness = self._springs * np.where(pressed, max(self._share, 1.0), self._share)
            self._condensed, self._held = self._condense(self._contact.springs(stiffness)), pressed
        contact, condensed = self._directed, self._condensed
        unbalanced = self._force - self._u[STIFFNESS]
        contact.interface.add(unbalanced, contact.resultant(self._forces))
        free = condensed.solve_free(unbalanced)
        held_depth = self._depth - contact.gap_matrix @ contact.interface.trace(free, self._operators)
        solution = self._solved(condensed, held_depth)
        self._hard += solution.iterations > TRIED
        update = condensed.correct(free, solution.change, None, solution.response)
        length = self._length(update) if turns else 1.0
        moved, self._u = -self._u, imaged(self._operators, self._u[VALUE] + length * update)
        moved += self._u
        values = contact.interface.trace(self._u[VALUE], self._operators)
        self._before, self._depth = self._depth, self._contact.depth(values)
        self._forces = solution.forces
        if length < 1.0:
            self._forces = self._contact.weights * self._law.static(self._depth).pressure
        return moved

    def _leap(self, moved: Imaged) -> None:
        """Go where updates that shrink by the same factor lead: the springs cannot be softer. Collective."""
        before, last, now = self._updates[-3:]
        rate = now / last
        if rate < 1.0 and abs(last / before - rate) <= ALIKE * (1.0 - rate):
            self._u = self._u + rate / (1.0 - rate) * moved
            values = self._contact.interface.trace(self._u[VALUE], self._operators)
            self._depth = self._contact.depth(values)

    def _solved(self, condensed: Condensed, held_depth: Array) -> ContactSolution:
        """Return the solution of the contact problem of an iteration."""
        law, weights = self._law, self._contact.weights
        return solve_contact(
            condensed, 1.0, held_depth, weights, law.static, self._forces, augmented=law.augmented, patience=TRIED
        )

    def _condense(self, held: Springs) -> Condensed:
        """Return an operator with springs, for contact with the directions of the pose.

        The penetration along them is a lower bound of the penetration itself, which the next iteration sees.
        """
        system, contact = self._system, self._contact
        if contact.circles:
            values = contact.interface.trace(self._u[VALUE], self._operators)
            held = replace(held, matrix=held.matrix + contact.holding(self._forces, values))
            system = replace(system, contact=contact.at(values))
        self._directed = system.contact
        condensed = condensed_operator(system, 0.0, 1.0, springs=held, seldom=True)
        condensed.loosen(INNER_TOLERANCE)
        return condensed

    def _length(self, update: Array) -> float:
        """Return the length in (0, 1] of an update that minimizes the potential, where the whole one overshoots."""
        contact, operators = self._contact, self._operators
        first, second = self._system.dots(
            [(update, self._u[STIFFNESS] - self._force), (update, operators.apply_stiffness(update))]
        )
        values = contact.interface.trace(self._u[VALUE], operators)
        change = contact.interface.trace(update, operators)

        def slope(length: float) -> float:
            there = values + length * change
            forces = contact.weights * self._law.static(contact.depth(there)).pressure
            return float(first + length * second - forces @ (contact.at(there).gap_matrix @ change))

        return root_of_slope(slope) if slope(1.0) > -OVERSHOT * slope(0.0) > 0.0 else 1.0

    def _round_off(self) -> Array:
        """Return an update that round-off in K u alone makes, (n,), m. Collective."""
        assert self._condensed is not None
        u = self._u[VALUE]
        signs = np.random.default_rng(0).choice([-1.0, 1.0], len(u))
        return self._condensed.solve_free(signs * self._operators.stiffness_round_off(u))

    def _has_left(self) -> bool:
        """Return whether gaps have changed by so much that the beam may rest on the weak restraint alone."""
        first = self._contact.depth(np.zeros(self._contact.interface.size))
        return bool(np.max(np.abs(self._depth - first)) > LEFT * np.ptp(self._contact.positions[:, 0]))

    def _refuse_escape(self, looked: bool) -> None:
        """Raise where the static loads drive a rigid motion that nothing opposes. Collective."""
        if looked or self._rigid is None:
            return
        escape = find_escape(self._system, self._force, self._rigid())
        if escape is not None:
            raise NotConverged(
                f"no static seat was found, and there is none: a rigid motion that no contact opposes {escape.words}, "
                "and the static loads do work along this motion; only the weak restraint resists it. Check the places "
                "of supports and the direction of loads, or hold the motion by a [[joint]] or a further support; a "
                'transient with analysis.start = "undeformed" needs no seat',
                tuple(self._updates),
            )

    def _unsettled(self, worst: int) -> str:
        """Return the parts that do not settle, their place, and advice."""
        contact, depth = self._contact, self._depth
        face = contact.face_names[int(contact.faces[worst])]
        place = f"{face} at x = {contact.positions[worst, 0]:.4g} m"
        pressed = int(np.count_nonzero(self._forces))
        if pressed == 0:
            either = ", ".join(contact.face_names) + " nor restraint"
            return (
                f"the static loads push the beam where neither {either} holds it; the gap of {place} is "
                f"{-depth[worst]:.3g} m and still changes; check the direction of gravity and [restraint]"
            )
        return (
            f"{pressed} of {contact.size} contact points press, and the {place} still opens and closes most; no rigid "
            "motion leads away, so that a softer contact or smaller cells may find the seat; a transient "
            'with analysis.start = "undeformed" needs no seat: the beam falls to it'
        )


def _stand_still(
    contact: ContactOperator, forces: Array, moved: Array, noise: Array | None, operators: Operators
) -> bool:
    """Return whether stations in round holes no longer roll along their walls, which takes no energy. Collective.

    Stations that do not press roll nowhere: round-off moves what only the weak restraint holds aside.

    Args:
        contact: The contact.
        forces: Forces of the contact points, (m,), N.
        moved: Displacement of the beam, (n,), m.
        noise: Displacement of the beam by round-off, where that is known, (n,), m.
        operators: Operators of the system.
    """
    circles = contact.circles
    pressed = np.repeat(forces[circles.points] > 0.0, 2)

    def rolled(motion: Array) -> float:
        aside = np.abs(circles.plane @ contact.interface.trace(motion, operators))
        return float(np.max(aside, initial=0.0, where=pressed))

    largest = float(np.max(np.abs(circles.clearances), initial=0.0))
    hidden = 0.0 if noise is None else min(NOISE_SAFETY * rolled(noise), UNCERTAIN * largest)
    return rolled(moved) <= max(ROLLED * largest, hidden)


def _is_noise(updates: list[float]) -> bool:
    """Return whether the updates no longer contract: the last ones are not half of the one before them."""
    return len(updates) > NOISY and min(updates[-NOISY:]) >= 0.5 * updates[-NOISY - 1]


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
