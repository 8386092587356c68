"""Tangents of periodic responses: derivatives of their figures by parameters of the scene.

A step is linear except for the contact forces F, which a touch gives for the places y at both ends of the step:

    x1 = S x0 + R F + G f + ...,     y = B q + b,     F = touch(y0, y1; p).

With the slopes J0, J1 of the touch, and the explicit parts r, f of a parameter at the same motion and forces,

    (1 - J1 B R) dF = (J0 B + J1 B S) dx0 + f,     dx1 = S dx0 + R dF + r,

one small linear solve a step. Over a period this is dP = M dx + P_p, so that an orbit x = P(x, p) moves by

    dx/dp = (1 - M)^-1 P_p.

Slopes of touches, loads and matrices are one-sided differences of order 4 from both sides; where these differ at any
shift, the contact opens or closes within round-off of the end of a step, and there is no derivative. Each tangent is
then compared with differences of marches along it, which correct it where they are surer.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.scene.argument_checks import checked, finite
from gapbeam.solver.scene.limit_cycle import (
    bared,
    change_of_orbit,
    check_period,
    free_motions,
    multipliers_of,
    state_of,
)
from gapbeam.solver.scene.linear_scheme import MIDPOINT, LinearScheme, rest
from gapbeam.solver.scene.marcher import Marcher
from gapbeam.solver.scene.orbit_figures import OrbitFigure, figure_of
from gapbeam.solver.scene.printed_values import result_words
from gapbeam.solver.scene.scene import Scene, SceneState
from gapbeam.solver.scene.touch_kernel import WIDTH
from gapbeam.solver.system.operators import Array

CONVERGED, NEAR = 1e-12, 1e-6
"""Change over a period, over the range of the motion: of an orbit, and of a start that is near one."""
SMOOTH, CONFIRMED, UNSURE = 1e-7, 1e-6, 1e-4
"""Relative: largest difference of two one-sided slopes, and of a tangent from differences of marches; where a kink is
near, shifts below its distance leave more round-off in these, but no more than the last."""
FIRST, LEVELS = 2.0**-8, 9
SIDE = (4.0, -3.0, 4.0 / 3.0, -0.25)


@dataclass(frozen=True, eq=False)
class OrbitTangents:
    """Figures of a periodic response and their derivatives.

    Attributes:
        values: Figures by name.
        slopes: Derivatives by name of the figure, then by path of the parameter.
        periods: Derivative of the period by path: not 0 where the loads' period follows a parameter, s.
        state: State at the start of a period.
        moved: Derivative of coordinates, velocities and states there by path.
        multipliers: Multipliers of small disturbances over a period, complex.
        residual: Change over a period, over the range of the motion.
    """

    __repr__ = result_words

    values: dict[str, float]
    slopes: dict[str, dict[str, float]]
    periods: dict[str, float]
    state: SceneState
    moved: dict[str, Array]
    multipliers: Any
    residual: float


@checked
def tangents(
    scene: Scene | Callable[[dict[str, float]], Scene], figures: Sequence[str], over: Mapping[str, float], *,
    period: float, steps: int, start: SceneState, scheme: LinearScheme = MIDPOINT,
) -> OrbitTangents:  # fmt: skip
    """Return figures of a periodic response and their derivatives by parameters.

    Figures are those of the steps, as of `ensemble`: "tip.peak" (largest displacement), "tip.rms", "tip.harmonic_2"
    (amplitude of the second harmonic of the period) of points, "stop.peak_force", "stop.impulse" and "stop.work" (lost
    over a period) of contacts; sizes where there are two motions. Where a parameter changes the period of the loads,
    such as their frequency, the period of the response follows in as many steps.

    Args:
        scene: The scene, or a function that makes it from the parameters and keeps its modes.
        figures: Their names.
        over: Values of parameters by path, as of `scene.with_`.
        period: s.
        steps: Steps in a period.
        start: Start on the orbit, as of `periodic`.
        scheme: Scheme of the time integration; without accelerations as states.

    Raises:
        UserError: The start is on no orbit, the orbit does not converge to 1e-12 of its range or has a multiplier near
            1, a figure has no derivative there, or a name is unknown.

    Source: Parker and Chua (1989), Practical Numerical Algorithms for Chaotic Systems, sec. 5.3 and app. D.
    """
    values = {path: float(finite(value, f"tangents: {path}")) for path, value in over.items()}
    make: Callable[[dict[str, float]], Scene] = scene.with_ if isinstance(scene, Scene) else scene
    if not figures or not values:
        raise UserError(
            f"tangents: found {len(figures)} figures and {len(values)} parameters; expected one or more of each"
        )
    whole = make(values)
    _refuse(whole, start, scheme)
    check_period(whole, start.t, period, steps)
    base = _Problem(whole, period / steps, steps, start.t, scheme)
    asked = [figure_of(whole, name) for name in figures]
    orbit = _converged(base, start.x[:, 0])
    M = orbit.carried(np.eye(len(orbit.x)))[0][-1]
    gap = float(np.abs(1.0 - np.linalg.eigvals(M)).min())
    if not max(orbit.residual, np.finfo(float).eps) <= 1e-8 * gap**2:
        raise UserError(
            f"tangents: a multiplier lies {gap:.2g} from 1: near a fold or a branch point, where the response has no "
            "derivative; move a parameter away from it"
        )
    slopes: dict[str, dict[str, float]] = {name: {} for name in figures}
    periods, moved = dict[str, float](), dict[str, Array]()
    for path, value in values.items():
        size = abs(value) or float(np.abs(orbit.Y).max(initial=0.0)) or 1.0

        def shifted(s: float, path: str = path, value: float = value, size: float = size) -> Scene:
            try:
                return make(values | {path: value + s * size})
            except UserError as fault:
                raise UserError(f"tangents: {path} = {value:g} lies at the end of its range: {fault}") from None

        found, turn, along = _along(orbit, M, shifted, asked, path)
        for name, one in zip(figures, found, strict=True):
            slopes[name][path] = float(one) / size
        periods[path], moved[path] = turn / size, along / size
    state = state_of(whole, orbit.x[:, None].copy(), start.t)
    numbers = dict(zip(figures, map(float, orbit.values(asked)), strict=True))
    multipliers = multipliers_of(whole, M, base.h, steps)
    return OrbitTangents(numbers, slopes, periods, state, moved, multipliers, orbit.residual)


def _along(
    orbit: _Orbit, M: Array, shifted: Callable[[float], Scene], asked: list[OrbitFigure], path: str
) -> tuple[Array, float, Any]:  # fmt: skip
    """Return the derivatives of figures, period and start by the shift of a parameter, compared with marches.

    Raises:
        UserError: A figure has no derivatives there.
    """
    base = orbit.problem
    turn = _following(shifted, base, path)

    def problem(s: float) -> _Problem:
        return _Problem(shifted(s), base.h + turn * s / base.steps, base.steps, base.t, base.scheme)

    r, f, moves, U = orbit.explicit(problem, path)
    along: Any = np.linalg.solve(np.eye(len(M)) - M, orbit.carried(np.zeros((len(M), 1)), r, f)[0][-1])
    X, F = (one[..., 0] for one in orbit.carried(along, r, f))
    U, felt = U + X[1:, : base.scene.size] @ base.linear.watch.T, np.hstack([F, moves + np.diff(X @ base.B.T, axis=0)])

    def slopes() -> Array:
        every = [one.slope(orbit.series(one), felt if one.forces else U, base.h, turn / base.steps) for one in asked]
        return np.array(every)

    found = slopes()
    tangent = np.array([*found, *np.zeros(len(M))])  # the orbit stays closed

    def changed(s: float) -> Array:
        other = _Orbit(problem(s), orbit.x + s * along[:, 0])
        return np.concatenate([other.values(asked), other.miss])

    most = max(np.abs(along).max(), 1e-4 * np.abs(orbit.x).max())
    scales = [one.scale(orbit.series(one), base.h) for one in asked]
    sizes = np.maximum(np.abs(tangent), [*scales, *np.full(len(M), most)])
    measured, unsure = slope(changed, FIRST / 64.0, 0.1 * CONFIRMED * sizes)
    wrong = np.flatnonzero(~(np.abs(measured - tangent) <= CONFIRMED * sizes + np.minimum(unsure, UNSURE * sizes)))
    if len(wrong):
        i = int(wrong[0])
        raise UserError(
            f"tangents: by {path}, times its size, {asked[i].name if i < len(asked) else 'an open orbit'} has "
            f"{tangent[i]:.9g}, but differences of marches give {measured[i]:.9g}: the motion is not smooth enough "
            "here; change a parameter or the steps a little"
        )
    off = np.where(np.abs(measured - tangent) > unsure, measured - tangent, 0.0)
    if off.any():  # marches know it better than the sums of small slopes
        missed: Any = np.linalg.solve(np.eye(len(M)) - M, off[len(asked) :, None])
        X, F = (one[..., 0] for one in orbit.carried(missed))
        U, felt = (
            U + X[1:, : base.scene.size] @ base.linear.watch.T,
            felt + np.hstack([F, np.diff(X @ base.B.T, axis=0)]),
        )
        found, along = slopes() + off[: len(asked)], along + missed
    return found, turn, along[:, 0]


def _refuse(scene: Scene, start: SceneState, scheme: LinearScheme) -> None:
    """Refuse scenes whose steps have no tangents here."""
    scene.refuse_memory("tangents")
    if scene.is_large:
        raise UserError("tangents: a structure is too large; reduce it: gapbeam.reduced_at_points")
    if scheme.is_accelerated:
        raise UserError("tangents: the scheme has accelerations as states; take the midpoint rule or theta")
    if start.q.shape != (scene.size, 1):
        raise UserError(f"tangents: found a start of shape {start.q.shape}, expected ({scene.size}, 1)")
    for one in scene.contacts:
        if one.is_rough and one.sticks:
            raise UserError(
                f"tangents: friction of contact {one.name or '?'} sticks, and its force has no slope where it begins "
                "to slide; give it a speed: sliding=..."
            )


def slope(
    function: Callable[[float], Array], first: float = FIRST, enough: Array | None = None
) -> tuple[Array, Array]:  # fmt: skip
    """Return the derivative of a function at 0, and how far its one-sided differences are apart, element by element.

    Shifts fall by factors of 4; each element takes the shift at which both sides and the central difference, each of
    order 4, agree best, and of these the mean that is of order 6. Sides that do not agree belong to a kink at 0, or
    nearer than the last shift. Shifts end where all are no farther apart than `enough`.
    """
    at = np.asarray(function(0.0), dtype=float)
    best, miss = np.zeros_like(at), np.full_like(at, np.inf)
    for level in range(LEVELS):
        e = first * 4.0**-level
        near = np.array([function(k * e) - at for k in (-4, -3, -2, -1, 1, 2, 3, 4)]) / e
        back, front = -np.tensordot(SIDE, near[3::-1], 1), np.tensordot(SIDE, near[4:], 1)
        middle = (8.0 * (near[4] - near[3]) - (near[5] - near[2])) / 12.0
        apart = np.maximum(np.abs(front - middle), np.abs(back - middle))
        better = apart < miss
        best = np.where(better, (front + back + 12.0 * middle) / 14.0, best)
        miss = np.where(better, apart, miss)
        if np.all(miss <= (1e-5 * SMOOTH * np.abs(best).max(initial=0.0) if enough is None else enough)):
            break
    return best, miss


class _Problem:
    """A scene with its step: the march, and the linear part of a step.

    Attributes:
        S, R, G: Matrices of x1 = S x0 + R F + G f with the loads f, without free motions.
        B, b: Matrix and vector of the places y_k = B q_k + b_k.
        loads: f of each step, (steps, loads).
    """

    def __init__(self, scene: Scene, h: float, steps: int, t: float, scheme: LinearScheme) -> None:
        self.scene, self.h, self.steps, self.t, self.scheme = scene, h, steps, t, scheme
        self.linear, self.free = A, _ = scene.condensed(h, scheme), free_motions(scene)
        n, m, states, count = scene.size, scene.motions, scene.states, len(A.patterns)
        every = np.eye(2 * n + states + m + count)
        q, v, z, F, load = np.split(every, np.cumsum([n, n, states, m]))
        w = -A.scheme[0, 1] / h * A.root[:, None] * v - A.squares[:, None] * q + A.patterns.T @ load
        w = A.inverse @ w if A.inverse.size else A.weight[:, None] * w
        law, kept, sensed, pushed = A.feed.matrices(n)
        ports, read = np.vstack([A.ports, sensed]), A.feed.port[: len(A.feed.port) - len(pushed)]
        at, u = ports[read] @ q, np.vstack([ports, np.zeros_like(pushed)]) @ w
        u += A.feed.acted.T[: len(u)] @ (law @ np.vstack([z, at, u[read]]))
        u[m:] += A.carry.T @ F
        w += np.vstack([A.answers, pushed]).T @ np.vstack([F, u[len(ports) :]])
        after = A.scheme[2, 0] * A.root[:, None] * w + A.scheme[2, 1] * v
        whole = bared(np.vstack([q + h * w, after, kept @ np.vstack([z, at, u[read]])]), self.free)
        self.S, self.R, self.G = np.split(whole, np.cumsum([2 * n + states, m]), axis=1)
        self.B = np.hstack([scene.contact_rows, np.zeros((m, n + states))])
        times = t + h * np.arange(steps + 1)
        self.b: Array = scene.offsets.T - scene.walls(times)[..., 0]
        self.loads = np.zeros((steps, count))
        for j, one in enumerate(scene.loads):
            self.loads[:, j] = one.over_steps(times, level=scheme.level)[:, 0]

    @cached_property
    def slabs(self) -> Any:
        """Touches of the contacts, for as many steps side by side as there are lanes."""
        return self.scene.slabs(WIDTH, self.h, self.linear.delassus, self.scheme.law)

    def touched(self, y0: Array, y1: Array) -> Array:
        """Return the contact forces of steps from places y0 to y1, (steps, motions)."""
        F = np.zeros_like(y0)
        for k in range(0, len(y0), WIDTH):
            index = np.minimum(np.arange(k, k + WIDTH), len(y0) - 1)
            F[k : k + WIDTH] = rest(self.slabs, y0[index].T, self.h, y1[index].T)[0].T[: len(y0) - k]
        return F


class _Orbit:
    """A period of a march from x: forces F, displacements U of all points, and the change over the period.

    Raises:
        NotConverged: The contact forces of a step failed.
    """

    def __init__(self, problem: _Problem, x: Array) -> None:
        self.problem, x = problem, bared(x, problem.free)
        start = state_of(problem.scene, x[:, None].copy(), problem.t)
        marcher = Marcher(problem.scene, problem.h, start, 1, problem.scheme, problem.linear)
        seen, felt, *_ = marcher.advance(problem.steps, record=True)
        self.U, self.F = seen[..., 0], felt[..., 0]
        self.x, self.miss = x, bared(marcher.state.x[:, 0], problem.free) - x

    def values(self, figures: list[OrbitFigure]) -> Array:
        """Return figures."""
        return np.array([one.value(self.series(one), self.problem.h)[0] for one in figures])

    def series(self, figure: OrbitFigure) -> Array:
        """Return the series of a figure: forces and moves of the contacts, or displacements."""
        return np.hstack([self.F, np.diff(self.Y, axis=0)]) if figure.forces else self.U

    @cached_property
    def X(self) -> Array:  # noqa: N802 - as in the equations
        """States, (steps + 1, states)."""
        one = self.problem
        X = np.vstack([self.x, self.F @ one.R.T + one.loads @ one.G.T])
        for k in range(one.steps):
            X[k + 1] += one.S @ X[k]
        return X

    @cached_property
    def Y(self) -> Array:  # noqa: N802
        """Places of the contacts, (steps + 1, motions)."""
        return self.X @ self.problem.B.T + self.problem.b

    @cached_property
    def residual(self) -> float:
        """Change over the period, over the ranges of displacements, velocities and states."""
        n = self.problem.scene.size
        parts = zip(*(np.split(one, [n, 2 * n], axis=-1) for one in (self.miss, self.X)), strict=True)
        sizes = [(np.abs(miss).max(initial=0.0), np.ptp(X, axis=0).max(initial=0.0)) for miss, X in parts]
        return float(max(miss / size if size > 0.0 else miss for miss, size in sizes))

    @cached_property
    def slopes(self) -> tuple[Array, Array]:
        """J0 and J1: slopes of the forces by the places before and after each step, (steps, motions, motions).

        Raises:
            UserError: A contact opens or closes within round-off of the end of a step.
        """
        scene, m = self.problem.scene, self.problem.scene.motions
        before, after = self.Y[:-1], self.Y[1:]
        reach = np.abs(after - before).max(axis=0, initial=0.0)
        reach[reach == 0.0] = reach.max(initial=0.0) or 1.0
        found, misses = np.zeros((2, self.problem.steps, m, m)), np.zeros((2, self.problem.steps, m, m))
        for direction in range(max((one.motions for one in scene.contacts), default=0)):
            moved = np.zeros(m)
            own = {
                int(at): one.motions
                for one, at in zip(scene.contacts, scene.first, strict=False)
                if one.motions > direction
            }
            for at in own:
                moved[at + direction] = reach[at + direction]
            for end, function in enumerate(
                (
                    lambda s, moved=moved: self.problem.touched(before + s * moved, after),
                    lambda s, moved=moved: self.problem.touched(before, after + s * moved),
                )
            ):
                J, miss = slope(function)
                for at, count in own.items():
                    rows = slice(at, at + count)
                    found[end, :, rows, at + direction] = J[:, rows] / reach[at + direction]
                    misses[end, :, rows, at + direction] = miss[:, rows] / reach[at + direction]
        self._refuse_kinks(
            misses.max(axis=(0, 3), initial=0.0), np.abs(found).max(axis=(0, 1, 3), initial=0.0), "motion"
        )
        return found[0], found[1]

    def _refuse_kinks(self, miss: Array, size: Array, what: str) -> None:
        """Refuse one-sided slopes of contact forces that differ, (steps, motions), over their sizes (motions,)."""
        wrong = ~(miss <= SMOOTH * size)
        if wrong.any():
            k, o = np.argwhere(wrong)[0]
            contact = self.problem.scene.contacts[int(np.searchsorted(self.problem.scene.first, o, "right")) - 1]
            t = self.problem.t + (k + 1) * self.problem.h
            raise UserError(
                f"tangents: contact {contact.name or '?'} opens, closes or grazes within round-off of the step that "
                f"ends at t = {t:.9g} s: its force has two slopes by {what}; change a parameter or the steps a little"
            )

    def explicit(self, problem: Callable[[float], _Problem], path: str) -> tuple[Array, Array, Array, Array]:
        """Return derivatives at the same motion and forces: of states and forces after each step, of moves, of points.

        Raises:
            UserError: States, forces or motions do not depend smoothly on the parameter.
        """
        n, m, nx = self.problem.scene.size, self.problem.scene.motions, len(self.X[0])

        def parts(s: float) -> Array:
            one = problem(s)
            if one.S.shape != self.problem.S.shape:
                raise UserError(f"tangents: {path} changes the number of states; the feedback needs a fixed number")
            after, y = self.X[:-1] @ one.S.T + self.F @ one.R.T + one.loads @ one.G.T, self.X @ one.B.T + one.b
            U = self.X[1:, :n] @ one.linear.watch.T
            return np.hstack([after, one.touched(y[:-1], y[1:]), np.diff(y, axis=0), U])

        found, miss = slope(parts)
        self._refuse_kinks(miss[:, nx : nx + m], np.abs(found[:, nx : nx + m]).max(axis=0, initial=0.0), path)
        r = found[:, :nx]
        allowed = SMOOTH * (np.abs(r).max(axis=0) + 1e-3 * np.abs(self.X).max(axis=0))
        if not np.all(miss[:, :nx].max(axis=0) <= allowed):
            raise UserError(
                f"tangents: a load or a matrix has two slopes by {path}, so that no figure has a derivative"
            )
        f = found[:, nx : nx + m] + np.einsum("kij,kj->ki", self.slopes[1], r @ self.problem.B.T)
        return r, f, found[:, nx + m : nx + 2 * m], found[:, nx + 2 * m :]

    def carried(self, x: Array, r: Array | None = None, f: Array | None = None) -> tuple[Array, Array]:
        """Return changes of states and forces over the period from changes x (states, columns) of the start."""
        problem, (J0, J1) = self.problem, self.slopes
        BS, BR, m = problem.B @ problem.S, problem.B @ problem.R, problem.scene.motions
        X, F = np.zeros((problem.steps + 1, *x.shape)), np.zeros((problem.steps, m, x.shape[1]))
        X[0] = x
        for k in range(problem.steps):
            right = (J0[k] @ problem.B + J1[k] @ BS) @ X[k]
            X[k + 1] = problem.S @ X[k]
            if r is not None and f is not None:
                right += f[k][:, None]
                X[k + 1] += r[k][:, None]
            if right.any():
                F[k] = np.linalg.solve(np.eye(m) - J1[k] @ BR, right)
                X[k + 1] += problem.R @ F[k]
        return X, F


def _converged(problem: _Problem, x: Array) -> _Orbit:
    """Return the orbit through a state near it, by Newton's method down to round-off.

    Raises:
        UserError: The state is not near it, or the orbit does not converge.
    """
    orbit = _Orbit(problem, x)
    if not orbit.residual <= NEAR:
        raise UserError(
            f"tangents: a period changes the start by {orbit.residual:.2g} of the range of the motion; start from the "
            "state of `gapbeam.periodic` with the same period, steps and scheme"
        )
    for _ in range(4):
        M = orbit.carried(np.eye(len(x)))[0][-1]
        other = _Orbit(problem, orbit.x + change_of_orbit(M, orbit.miss))
        if not other.residual < orbit.residual:
            break
        orbit = other
    if not orbit.residual <= CONVERGED:
        raise UserError(
            f"tangents: the orbit converged to {orbit.residual:.2g} of its range only, expected {CONVERGED:g}; where "
            "contacts multiply round-off, take more steps or a softer contact"
        )
    return orbit


def _following(shifted: Callable[[float], Scene], base: _Problem, path: str) -> float:
    """Return the derivative of the period by a parameter's shift: that after which loads and walls still repeat.

    Raises:
        UserError: The loads and walls repeat after no period.
    """
    T = base.h * base.steps
    times = base.t + base.h * (np.arange(base.steps) + 0.5)

    def forces(scene: Scene, ahead: float) -> Array:
        """Return loads and walls at these times, (times, loads + motions)."""
        tables = [one.table(times + ahead) for one in scene.loads]
        return np.hstack([*tables, scene.walls(times + ahead)[..., 0]])

    size = np.abs(forces(base.scene, 0.0)).max(axis=0, initial=0.0)
    size[size == 0.0] = 1.0
    grown = slope(lambda s: forces(shifted(s), T) / size - forces(shifted(s), 0.0) / size)[0]
    if np.abs(grown).max(initial=0.0) <= SMOOTH:
        return 0.0
    rate = slope(lambda s: forces(base.scene, T + s * base.h) / size)[0] / base.h
    turn = -float((rate * grown).sum() / (rate**2).sum())
    if not np.abs(grown + rate * turn).max() <= CONFIRMED * np.abs(grown).max():
        raise UserError(f"tangents: where {path} changes, the loads together repeat after no period near {T:.6g} s")
    return turn
