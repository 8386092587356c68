"""The seat of a scene: its static equilibrium in contact, or a rigid motion that nothing opposes.

Large structures rest in coordinates of rigid motions and of static responses to all that may act on them.

At rest q = R a + K^+ (f + B^T F), whatever the contact forces F are. The basis of R, K^+ f and K^+ B^T therefore holds
the equilibrium of all DOFs exactly; K^+ g answers g less what accelerates the structure as a whole (inertia relief),

    P g = g - M R (R^T M R)^-1 R^T g,     K^+ = (1 - R (R^T M R)^-1 R^T M) K_s^-1 P,

with the shifted K_s = K + s M factored once and the shift taken out by iteration. A held structure has no R, and s = 0.

Where loads pull along a rigid motion that contacts oppose by friction alone, the scene rests without that pull first.
Long steps of implicit Euler, each from rest, then add pull and friction: they end where nothing moves,

    M (q1 - q0) / h^2 + K q1 = f + B^T F(q1, q1 - q0),     q1 = q0.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import scipy.linalg as sl

from gapbeam.solver.contact.solve.unopposed_motion import unopposed_motion
from gapbeam.solver.messages.errors import NotConverged, UserError
from gapbeam.solver.models.reduction.modal_basis import modal_basis
from gapbeam.solver.scene.argument_checks import checked
from gapbeam.solver.scene.feedback import side_by_side
from gapbeam.solver.scene.linear_scheme import Slabs, euler, rest
from gapbeam.solver.scene.scene import Scene, SceneState
from gapbeam.solver.scene.scene_march import marcher_of
from gapbeam.solver.scene.shipped_laws import KelvinVoigt
from gapbeam.solver.scene.structure import FIRST_GUESS, LARGE, MOST_RIGID, Structure
from gapbeam.solver.system.dense_operators import SparseOperators
from gapbeam.solver.system.operators import Array

RIGID = 1e-13  # of the largest ratio of stiffness to mass: squares below belong to rigid motions
SHIFT = 1e-3  # of the first elastic square
STATIC_BASIS_ROUND_OFF = 1e-13
PASSES = 30
MOST_PASSES = 200
"""Passes in which contacts of impulses lose their penetration."""
TOUCHING = 1e-10
"""Penetration that the largest force of impulses keeps, over the places: a march sees that its contact is closed."""


class Statics(NamedTuple):
    """A scene in the coordinates of its seat: q = columns @ y.

    Attributes:
        columns: (n, m), M-orthonormal; None: the coordinates of the scene themselves, its modes.
        squares: K in these coordinates, diagonal, (m,).
    """

    columns: Array | None
    squares: Array

    def rows(self, rows: Array) -> Array:
        """Return rows of the scene's coordinates, or patterns of forces in them, (k, n), in those of the seat."""
        return rows if self.columns is None else rows @ self.columns

    def whole(self, y: Array) -> Array:
        """Return the scene's coordinates, (n,)."""
        return y if self.columns is None else self.columns @ y


def statics_of(scene: Scene) -> Statics:
    """Return the coordinates in which a scene rests.

    Raises:
        RunError: The first modes of a large structure did not converge.
    """
    if not scene.is_large:
        return Statics(None, scene.squares)
    places = [place for one in scene.feedbacks for place in (one.sense, one.act)]
    acting = np.vstack([scene.contact_rows, scene.rows(places), scene.load_columns.T])
    parts = []
    for one, i, j in zip(scene.structures, scene.start, scene.start[1:], strict=False):
        own = acting[:, i:j]
        parts.append(_of_structure(one, own[np.abs(own).max(axis=1) > 0.0].T))
    columns = sl.block_diag(*(columns for columns, _ in parts))
    return Statics(columns, np.concatenate([squares for _, squares in parts]))


def _of_structure(structure: Structure, forces: Array) -> tuple[Array, Array]:
    """Return an M-orthonormal basis of rigid motions and static responses, and the squares of its frequencies."""
    if structure.size <= LARGE:
        return structure.modes[2], structure.modes[0]
    operators = SparseOperators(structure.M, structure.K)
    ratios = operators.stiffness.diagonal() / operators.mass.diagonal()
    near = FIRST_GUESS * float(ratios.mean())
    squares, shapes = operators.lowest_modes(near, MOST_RIGID + 1, operators.factor(near, 1.0))
    still = squares <= RIGID * float(ratios.max())
    R = shapes[:, still] if structure.rigid is None else structure.rigid
    first = float(squares[~still].min()) if not still.all() else near
    shift = SHIFT * first if R.shape[1] else 0.0
    factor = operators.factor(shift, 1.0)
    MR = operators.apply_mass(R)
    gram = np.linalg.inv(R.T @ MR) if R.shape[1] else np.zeros((0, 0))
    right = forces - MR @ (gram @ (R.T @ forces))
    answers, rest, size = np.zeros_like(right), right, np.abs(right).max(axis=0, initial=0.0)
    for _ in range(PASSES):
        answers += factor.solve(rest)
        answers -= R @ (gram @ (MR.T @ answers))
        before, rest = np.abs(rest).max(initial=0.0), right - operators.apply_stiffness(answers)
        rest -= MR @ (gram @ (R.T @ rest))
        left = np.abs(rest).max(axis=0, initial=0.0)
        if np.all(left <= STATIC_BASIS_ROUND_OFF * size) or np.abs(rest).max(initial=0.0) > 0.5 * before:
            break
    basis = modal_basis(operators, np.column_stack([R, answers]), SHIFT * first)
    squares = basis.squares.copy()
    squares[: R.shape[1]] = 0.0  # of the rigid motions, but for round-off
    return basis.columns, squares


ROUND_OFF = 10.0 * float(np.finfo(float).eps)
TINY = 1e-9  # of the largest force, or entry of K: less is round-off
FREE = 1e-12  # squared frequencies below this part of the highest belong to motions that no spring holds
TOLERANCE = 1e-12
BALANCED, ACCEPTED = 1e-9, 1e-6  # forces that remain, of the loads: where the search ends, and at most
LONG = 10.0
"""Step in which friction is found, over the time in which the slowest elastic motion turns by 1 rad."""


@dataclass
class EscapeMotion:
    """A rigid motion along which the loads do work, and that contacts do not hold.

    Attributes:
        motion: DOFs of each structure.
        power: Work of the loads per unit of the motion, J.
    """

    motion: dict[Structure, Array]
    power: float


class NoSeat(UserError):  # noqa: N818 - the field's word
    """A scene without equilibrium; `escape` is the certificate.

    Attributes:
        escape: The rigid motion.
    """

    def __init__(self, escape: EscapeMotion, why: str = "no contact opposes") -> None:
        largest = max(float(np.abs(u).max()) for u in escape.motion.values())
        names = [one.name or "?" for one, u in escape.motion.items() if np.abs(u).max() > TINY * largest]
        super().__init__(
            f"no equilibrium: the loads do work along a rigid motion of {', '.join(names)} that {why}; hold the "
            "structure, or march without a seat"
        )
        self.escape = escape


@checked
def seat(scene: Scene, t: float = 0.0) -> SceneState:
    """Return the static equilibrium under the loads at a time, by a proximal Newton method on the convex energy.

    Contacts act without friction, unless it alone holds what loads pull along: it sticks, up to its coefficient times
    the force, whatever its sliding speed. Contacts of impulses do not penetrate. Joints and other springs of the
    feedback act, with its states at rest; an integrator brings what it senses to 0, by any force, as a spring without
    limit does. A large structure is factored once: its rigid motions and static responses
    hold the equilibrium of all of its DOFs.

    Args:
        scene: The scene.
        t: Time at which loads and walls are taken, s.

    Raises:
        NoSeat: A linear program finds a rigid motion that nothing opposes and along which the loads work, and friction
            does not hold it.
        NotConverged: No equilibrium was found to 1e-6 of the loads.
        UserError: A feedback is no spring, or pushes farther than the structures hold; points move, and the time is
            not 0.
        RunError: The first modes of a large structure did not converge.
    """
    if scene.is_moving and t != 0.0:
        raise UserError(f"seat: found t = {t:g} s where points move, expected 0, at which their rows are known")
    values = [load.table(np.array([t]))[0, 0] for load in scene.loads] or [0.0]
    at = statics_of(scene)
    f = at.rows(scene.load_columns.T).T @ np.array(values)
    sense, act = (at.rows(scene.rows([getattr(one, key) for one in scene.feedbacks])) for key in ("sense", "act"))
    _, law_B, law_C, law_D = side_by_side(scene.feedbacks)
    resting, summing = (
        sl.block_diag(np.zeros((0, 0)), *(getattr(one, key) for one in scene.feedbacks))
        for key in ("resting", "integrals")
    )
    drift, answers = summing @ law_B[:, : len(sense)] @ sense, act.T @ law_C @ summing
    held = _sprung(-act.T @ law_C @ drift)
    free = np.eye(len(f)) - held @ held.T
    for one in (drift, answers.T):
        if not np.abs(one @ free).max(initial=0.0) <= TINY * np.abs(one).max(initial=0.0):
            raise UserError(
                "seat: a feedback has an integrator that does not bring what it reads to 0, so that its rest depends "
                "on the past; march from rest instead"
            )
    whole_K, whole_f = np.diag(at.squares) - act.T @ (law_D[:, : len(sense)] + law_C @ resting) @ sense, f
    K, f, B, whole_B = free @ whole_K @ free, free @ f, at.rows(scene.contact_rows) @ free, at.rows(scene.contact_rows)
    if scene.feedbacks:
        _sprung(K)
    K = K + (float(np.abs(K).max()) or 1.0) * held @ held.T
    pull = float(np.linalg.norm(f))
    slips, escape = slips_of(scene, at, K, f, B, pull)
    f = f - slips @ (slips.T @ f)
    if escape is not None and not (_may_stick(scene) and slips_of(scene, at, K, f, B, pull)[1] is None):
        raise NoSeat(escape)
    q: Array = np.zeros(len(K))
    offset = scene.places(np.zeros((scene.size, 1)), t)[:, 0]
    stiff = float(np.abs(K).max()) or 1.0
    K = K + stiff * slips @ slips.T
    springy, hard = _with_springs(scene, B, stiff)
    slabs = springy.slabs(rough=False)
    size = max(float(np.abs(f).max(initial=0.0)), float(np.abs(B.T @ static(slabs, offset)[0]).max(initial=0.0)))
    beyond: Array = np.zeros(len(B))
    for _ in range(MOST_PASSES):
        q, F, residual = _balanced(K, f, B, slabs, offset + beyond, stiff, size, q)
        reach = np.abs(B @ q + offset).max(initial=0.0)
        touching = reach * TOUCHING / max(float(np.abs(F[hard > 0.0]).max(initial=0.0)), 1e-300)
        before, beyond = beyond, np.where(hard > 0.0, -F / np.where(hard > 0.0, hard, 1.0) + F * touching, 0.0)
        if np.abs(beyond - before).max(initial=0.0) <= ROUND_OFF * reach:
            break
    if not np.abs(residual).max(initial=0.0) <= ACCEPTED * size:
        raise NotConverged(
            f"seat: forces of {np.abs(residual).max():.3g} remain of {size:.3g} (modal); laws that pull or soften may "
            "have several seats or none: march with damping until it rests"
        )
    sums = np.linalg.lstsq(answers, whole_K @ q - whole_f - whole_B.T @ F)[0]
    states = resting @ sense @ q + summing @ sums
    state = SceneState(t, at.whole(q)[:, None], np.zeros((scene.size, 1)), states[:, None], F[:, None])
    if escape is None:
        return state
    springs = np.linalg.eigvalsh(K - stiff * slips @ slips.T - B.T @ static(slabs, B @ q + offset)[1] @ B)
    slowest = springs[springs > FREE * springs[-1]][0]
    stuck = _held_by_friction(scene, state, np.array(values), LONG / float(np.sqrt(slowest)), ACCEPTED * pull)
    if stuck is None:
        raise NoSeat(escape, "contacts do not hold, nor does their friction")
    return stuck


def _sprung(K: Array) -> Array:
    """Return the directions in which a stiffness acts, (n, count); refuse one that is not that of a spring."""
    largest = float(np.abs(K).max(initial=0.0))
    if not np.abs(K - K.T).max(initial=0.0) <= TINY * largest:
        raise UserError("seat: a feedback is no spring (it acts elsewhere than it reads); march from rest instead")
    squares, X = np.linalg.eigh(K)
    if not squares[0] >= -ROUND_OFF * len(K) * largest:
        raise UserError(
            "seat: the feedback pushes farther than the structures hold without contact (divergence): there may be "
            "several seats or none; march from rest instead"
        )
    return np.asarray(X[:, squares > TINY * largest])


def _may_stick(scene: Scene) -> bool:
    """Return whether friction may hold a scene: steps of implicit Euler take neither impulses nor points that move."""
    return any(one.is_rough for one in scene.contacts) and not (
        scene.is_moving or any(one.is_impulsive for one in scene.contacts)
    )


def _held_by_friction(scene: Scene, state: SceneState, loads: Array, h: float, accepted: float) -> SceneState | None:
    """Return the equilibrium with friction, by steps of h from rest; None where the loads move the scene on and on."""
    contacts = [replace(one, sliding=0.0) if one.is_rough else one for one in scene.contacts]
    marcher = marcher_of(scene.with_parts(contacts, scene.loads), h, state, euler())
    left = np.inf
    for _ in range(MOST_PASSES):
        before = left
        marcher.v[:] = 0.0
        if marcher.march(1, loads[None, :, None], scene.walls(np.array([state.t]))) < 0:
            raise NotConverged("seat: friction that holds the scene did not converge; march from rest instead")
        left = float(np.sqrt(2.0 * marcher.inertia()[0][0])) / h
        if left <= accepted and left >= 0.5 * before:  # to round-off
            break
    return replace(state, q=marcher.q.copy(), F=marcher.F.copy()) if left <= accepted else None


def _balanced(
    K: Array, f: Array, B: Array, slabs: Slabs, offset: Array, stiff: float, size: float, q: Array
) -> tuple[Array, Array, Array]:
    """Return coordinates, contact forces and the forces that remain, by proximal points from q on.

    Args:
        K: Springs of structures.
        f: Loads.
        B: Rows of the contacts.
        slabs: Their touches.
        offset: Their places at q = 0.
        stiff: Size of K.
        size: Size of forces.
        q: Coordinates to start from.
    """
    F, residual = static(slabs, B @ q + offset)[0], f
    for outer in range(200):  # each inner problem is strictly convex
        base, shift = q.copy(), stiff * 10.0 ** -(9 + min(outer, 5))
        for _ in range(100):
            F, J = static(slabs, B @ q + offset)
            residual = f - K @ q + B.T @ F - shift * (q - base)
            dq = sl.solve(K + shift * np.eye(len(q)) - B.T @ J @ B, residual, assume_a="sym")
            low, high, s = 0.0, 1.0, 1.0
            for _ in range(60):  # exact line search: the energy falls while its slope along dq is negative
                trial = q + s * dq
                pull = K @ trial + shift * (trial - base) - f - B.T @ static(slabs, B @ trial + offset)[0]
                low, high = (s, high) if dq @ pull <= 0.0 else (low, s)
                if low == 1.0:
                    break
                s = 0.5 * (low + high)
            q = q + (low or high) * dq
            if np.abs(dq).max() <= TOLERANCE * np.abs(q).max():
                break
        F = static(slabs, B @ q + offset)[0]
        residual = f - K @ q + B.T @ F
        moved = np.abs(q - base).max()
        if np.abs(residual).max(initial=0.0) <= BALANCED * size and moved <= 10 * TOLERANCE * np.abs(q).max():
            break
    return q, F, residual


def _with_springs(scene: Scene, B: Array, stiff: float) -> tuple[Scene, Array]:
    """Return the scene with springs for laws of impulses, and their stiffness by motion, 0 of other contacts.

    The next pass moves such a contact by F / k farther out, until nothing penetrates (augmented Lagrangian).
    """
    hard, contacts = np.zeros(len(B)), list(scene.contacts)
    for i, (one, at) in enumerate(zip(scene.contacts, scene.first, strict=False)):
        square = float((B[at : at + one.motions] ** 2).sum(axis=1).max())
        if one.is_impulsive and square > 0.0:
            hard[at : at + one.motions] = stiff / square
            contacts[i] = replace(one, law=KelvinVoigt(stiffness=stiff / square))
    return (scene.with_parts(contacts, scene.loads) if hard.any() else scene), hard


def static(slabs: Slabs, y: Array) -> tuple[Array, Array]:
    """Return contact forces and their slopes at rest at places y: a step of no motion has half of that slope."""
    F, J, _ = rest(slabs, y[:, None])
    return F[:, 0], 2.0 * J


def slips_of(
    scene: Scene, coordinates: Statics, K: Array, f: Array, contact_rows: Array, pull: float
) -> tuple[Array, EscapeMotion | None]:
    """Return rigid motions that move no contact along its normal, as columns, and one that lets the loads work.

    The latter closes no contact, and is found by a linear program; None: contacts oppose the loads f without friction,
    or they are round-off of `pull`.
    """
    squares, X = np.linalg.eigh(K)
    rigid = X[:, squares <= FREE * max(float(squares[-1]), 1e-300)] if squares[-1] > 0.0 else X
    if not rigid.shape[1]:
        return rigid, None
    B = contact_rows @ rigid
    rows = [
        one.region.normals[:, : one.region.motions] @ B[at : at + one.region.motions]
        for one, at in zip(scene.contacts, scene.first, strict=False)
    ]
    A = np.vstack([np.zeros((0, rigid.shape[1])), *rows])
    scale = np.abs(A).max(axis=1, keepdims=True, initial=0.0)
    A = A / np.where(scale > 0.0, scale, 1.0)
    g = np.asarray(rigid.T @ f, dtype=float)
    size = float(np.abs(g).max())
    is_loaded = size > TINY * pull
    best = unopposed_motion(g / size, -A, np.eye(len(g))) if is_loaded else None
    escape = None
    if best is not None:
        a, motion = coordinates.whole(rigid @ best), {}
        for one, i, j in zip(scene.structures, scene.start, scene.start[1:], strict=False):
            motion[one] = a[i:j] if scene.is_large else one.modes[2] @ a[i:j]
        escape = EscapeMotion(motion, float(g @ best))
    return np.asarray(rigid @ (sl.null_space(A, rcond=TINY) if len(A) else np.eye(len(g)))), escape
