"""Contact with friction in one step, by the equations of `friction_equations` for forces along and across the faces.

Newton's iteration mostly converges from the friction forces before. Where it does not, the contact without friction
is a start, and the step is solved with a large v0 first, which then falls to what was given.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy

from gapbeam.solver.contact.laws.contact_law import ContactLaw, StagePressure
from gapbeam.solver.contact.laws.damper import CoulombFriction
from gapbeam.solver.contact.solve.condensation import Condensed, CondensedOperator
from gapbeam.solver.contact.solve.contact_solve import (
    ROUND_OFF,
    ContactSolution,
    largest,
    settled_solution,
    solve_contact,
    with_multipliers,
)
from gapbeam.solver.contact.solve.friction_equations import (
    EASY,
    HARDER,
    MOST_UPDATES,
    Missed,
    PressedPoints,
    Rubbing,
    RubbingTable,
    room_for_friction,
    rows_of_their_own,
    set_linear_laws,
)
from gapbeam.solver.messages.errors import NotConverged
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import ContactOperator, State


@dataclass(frozen=True)
class Sliding:
    """The slip velocity of a step, v = v_free + c T A^-1 (H^T (f - f_held) + T^T h).

    Attributes:
        law: The law of friction.
        scale: c > 0, what a unit of T A^-1 (H^T f + T^T h) adds to the slip velocity.
        free_slip: v_free, (m, k), m/s.
        start: Friction forces to start from, (m, k), N.
    """

    law: CoulombFriction
    scale: float
    free_slip: Array
    start: Array

    @classmethod
    def of(
        cls, law: ContactLaw, contact: ContactOperator, scale: float, free_velocity: Array, old: State
    ) -> Sliding | None:
        """Return the slip of a step whose velocity is free_velocity + c A^-1 (...), or None without friction.

        Args:
            law: The contact law.
            contact: The contact operator.
            scale: c.
            free_velocity: Interface values of the velocity that slip is measured in, (interface.size,), m/s.
            old: State at the start of the step.
        """
        if law.friction is None:
            return None
        free_slip = contact.slip(free_velocity)
        start = np.zeros_like(free_slip) if old.traction is None else contact.weights[:, None] * old.traction
        return cls(law.friction.of_points(old.slides), scale, free_slip, start)

    def room(self) -> Rubbing:
        """Return the friction of all points, without forces yet."""
        points, along = self.free_slip.shape
        first = points + along * np.arange(points)
        parts, share = rows_of_their_own(first, along)
        nothing = np.zeros((points * (1 + along), 0))  # the compliance is in the condensed operator
        room = room_for_friction(RubbingTable(1, parts, share, first), np.zeros((0, 0)), nothing, self.law, 1)
        room.points[:], room.chosen[0] = np.arange(points), points
        room.parts[:], room.share[:] = parts.reshape(-1, 3), share.reshape(-1, 3)
        room.free[points:] = self.free_slip.reshape(-1)
        return room


def solve_contact_and_friction(
    sliding: Sliding | None,
    condensed: Condensed,
    scale: float,
    held_depth: Array,
    weights: Array,
    law: Callable[[Array], StagePressure],
    held: Array,
    max_iterations: int = 60,
    augmented: float | None = None,
) -> ContactSolution:
    """Solve the contact problem of a step, with friction where there is some.

    Args:
        sliding: Slip before it is solved; None: without friction, this is `solve_contact`.
        condensed: Holds the Delassus operators.
        scale: s > 0, as in `solve_contact`; the other arguments as well.
        held_depth: d_held, under the contact forces that acted last and without friction, (m,), m.
        weights: w, (m,), m^2.
        law: P with its slope, at m penetrations.
        held: f_held, which the penetration and the slip contain, and to start from, (m,), N.
        max_iterations: Limit of each solution.
        augmented: Relative penetration to reach by multipliers, or None.

    Returns:
        The solution; its forces satisfy both laws to 1e-11 of the largest, or as well as round-off allows.

    Raises:
        NotConverged: The iterations did not converge; the error has the history of the residual, N.
    """
    if sliding is None:
        return solve_contact(condensed, scale, held_depth, weights, law, held, max_iterations, augmented)
    assert isinstance(condensed, CondensedOperator)  # friction is solved for with a factor
    room, stuck = sliding.room(), np.zeros((len(held), 1))
    forces = room.forces.reshape(len(held), -1)  # f - f_held and h of each point
    forces[:, 1:] = sliding.start
    stiffness, pull = np.zeros((*forces.shape, forces.shape[1])), np.zeros_like(sliding.start)

    def iterate(shift: Array | float, ease: float, most: int) -> ContactSolution:
        missed, history = Missed(np.inf, np.inf), list[float]()
        for iteration in range(most + 1):
            opened, moved = condensed.respond_all(forces[:, 0], forces[:, 1:])
            depth = held_depth + shift - scale * opened
            stage = law(depth)
            wrong = held + forces[:, 0] - weights * stage.pressure
            if not np.isfinite(wrong).all():
                break
            room.moved[: len(held)], room.moved[len(held) :] = opened, moved.reshape(-1)
            room.missed.reshape(forces.shape)[:, 0] = wrong
            floor = ROUND_OFF * largest(weights * stage.slope) * largest(held_depth)
            count, missed = set_linear_laws(
                room, PressedPoints(held, weights, stage.slope), scale, stuck, sliding.scale, ease * room.slip_velocity,
                largest(wrong), largest(held + forces[:, 0]), floor, missed, stiffness, pull,
            )  # fmt: skip
            history.append(max(missed))
            if count < 0:
                found = settled_solution(held, forces[:, 0].copy(), depth, stage, iteration, held_depth)
                return replace(found, friction=forces[:, 1:].copy())
            try:
                forces[:] += solve_laws(condensed, scale, -room.missed.reshape(forces.shape), stiffness, pull)
            except np.linalg.LinAlgError:
                break
        raise NotConverged(
            f"contact and friction did not converge in {most} iterations: the laws are missed by "
            f"{history[-1] if history else np.nan:.3e} N; a larger contact.friction.slip_velocity makes it easier",
            tuple(history),
            int(np.argmax(np.max(np.abs(room.missed.reshape(forces.shape)), axis=1))),
        )

    def solve(shift: Array | float) -> ContactSolution:
        try:
            return iterate(shift, 1.0, min(max_iterations, MOST_UPDATES))
        except NotConverged:
            ease, iterations = EASY, MOST_UPDATES
        apart = solve_contact(condensed, scale, held_depth + shift, weights, law, held, max_iterations)
        forces[:, 0], forces[:, 1:] = apart.change, 0.0
        while ease >= 1.0:
            solution = iterate(shift, ease, max_iterations)
            ease, iterations = ease * HARDER, iterations + solution.iterations
        return replace(solution, iterations=iterations)

    return with_multipliers(solve, held_depth, augmented)


def solve_laws(condensed: CondensedOperator, scale: float, known: Array, stiffness: Array, pull: Array) -> Array:
    """Solve L x = x0 - E z, z = s S A^-1 S^T x for the forces of points that rub, with S = [G; T].

    Of the forces and the interface DOFs that E acts on, the fewer are solved for; with y = S^T x

        (1 + s S^T L^-1 E S A^-1) y = S^T L^-1 x0.

    Args:
        condensed: Holds A^-1 and S.
        scale: s.
        known: x0 of each point, across the face and along, (m, 1 + k), N.
        stiffness: E of each point, (m, 1 + k, 1 + k), N/m.
        pull: L - 1 of each point, by which forces across pull along, (m, k).

    Returns:
        x, (m, 1 + k), N.

    Raises:
        LinAlgError: The equations are singular.
    """
    points, each = known.shape
    places = np.column_stack([np.arange(points), points + np.arange(points * (each - 1)).reshape(points, each - 1)])
    active = np.flatnonzero(stiffness.any(axis=(1, 2)))
    rows, laws, found = places[active].reshape(-1), stiffness[active], known.copy()
    motions = None if condensed.block is None else condensed.motions[rows]
    touched = rows if motions is None else np.unique(motions.indices)
    if motions is not None and condensed.block is not None and len(touched) < len(rows):
        motions = motions[:, touched]
        along = laws.copy()
        along[:, 1:] -= pull[active][:, :, None] * laws[:, :1]
        shared = scipy.sparse.csr_matrix(motions.T @ (_of_points(along) @ motions))
        matrix = np.asarray(shared @ (scale * condensed.block[np.ix_(touched, touched)]))
        at_once = known[:, 1:] - pull * known[:, :1]
        loads = condensed.motions.T @ np.concatenate([known[:, 0], at_once.reshape(-1)])
        loads[touched] -= _solved(matrix, shared @ (scale * condensed.moved(loads)[touched]))
        found[active] -= (_of_points(laws) @ (motions @ (scale * condensed.moved(loads)[touched]))).reshape(-1, each)
        found[:, 1:] -= pull * found[:, :1]
        return found
    found[active] = 0.0
    found[:, 1:] -= pull * found[:, :1]
    if len(active) > 0:
        moved = np.concatenate([part.reshape(-1) for part in condensed.respond_all(found[:, 0], found[:, 1:])])
        right = known[active].reshape(-1) - _of_points(laws) @ (scale * moved[rows])
        compliance = condensed.compliance[np.ix_(rows, rows)] if motions is None else condensed.compliance_of(motions)
        matrix = np.asarray(_of_points(laws) @ (scale * compliance))
        first = each * np.arange(len(active))
        for a in range(1, each):
            matrix[first + a, first] += pull[active, a - 1]
        found[active] = _solved(matrix, right).reshape(-1, each)
    return found


def _of_points(blocks: Array) -> scipy.sparse.bsr_matrix:
    """Return the matrix with so many square blocks on its diagonal."""
    return scipy.sparse.bsr_matrix((blocks, np.arange(len(blocks)), np.arange(len(blocks) + 1)))


def _solved(matrix: Array, right: Array) -> Array:
    """Return the solution of (1 + A) x = b; A is overwritten."""
    matrix.flat[:: len(matrix) + 1] += 1.0
    return np.asarray(np.linalg.solve(matrix, right))
