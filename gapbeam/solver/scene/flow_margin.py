"""Linear stability of scenes: eigenvalues, critical velocities and idle supports, and margins in a flow.

    x' = S x,     x = (coordinates, velocities, states of the feedback).

A closed contact is a spring and damper to its place at rest in all of its motions; an idle contact does nothing.
Connors' formula, which knows no gaps, stands beside.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import comb, inf, nan, pi, sqrt
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike

from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.scene.argument_checks import checked, finite, positive, positives, shown
from gapbeam.solver.scene.feedback import Feedback, Joint, side_by_side
from gapbeam.solver.scene.flow_force import Flow, FlowSpan
from gapbeam.solver.scene.scene import Scene
from gapbeam.solver.scene.shipped_laws import KelvinVoigt
from gapbeam.solver.system.operators import Array

Closed = Iterable[str] | Mapping[str, float | tuple[float, float]]
SAME = 4.0 * float(np.finfo(float).eps)
MOST = 4096  # sets of idle supports that are tried


@checked
def eigenvalues(scene: Scene, closed: Closed = ()) -> Any:
    """Return the eigenvalues of the linear scene, 1/s, complex, the largest growth rate first.

    Args:
        scene: Its feedback acts, its loads do not.
        closed: Names of contacts that are closed, by stiffness and damping of their linear law; or a mapping of names
            to a stiffness, N/m, or to (stiffness, damping). All other contacts are idle.

    Raises:
        UserError: A name is unknown, a law is not linear, or a structure has too many DOFs.
    """
    values = np.linalg.eigvals(state_matrix(scene, closed))
    return values[np.lexsort((-values.imag, -values.real))]


def state_matrix(scene: Scene, closed: Closed = ()) -> Array:
    """Return S of x' = S x, x = (q, v, z); see `eigenvalues`."""
    if scene.is_large:
        raise UserError("eigenvalues: a structure is too large; reduce it: gapbeam.reduced_at_points")
    feedbacks, damping = [*scene.feedbacks, *_closed_joints(scene, closed)], scene.damping
    sense, act = scene.rows([one.sense for one in feedbacks]), scene.rows([one.act for one in feedbacks])
    A, B, C, D = side_by_side(feedbacks)
    (Bd, Bv), (Dd, Dv), n = np.split(B, 2, axis=1), np.split(D, 2, axis=1), scene.size
    K = np.diag(scene.squares) - act.T @ Dd @ sense
    drag = (np.diag(damping[0]) if len(damping) == 1 else damping) - act.T @ Dv @ sense
    rows = [np.zeros((n, n)), np.eye(n), np.zeros((n, len(A)))], [-K, -drag, act.T @ C], [Bd @ sense, Bv @ sense, A]
    return np.block([*rows])


def _closed_joints(scene: Scene, closed: Closed) -> list[Feedback]:
    """Return closed contacts as springs and dampers."""
    if isinstance(closed, str) or not isinstance(closed, Sequence | Mapping):
        raise UserError(f"closed: found {shown(closed)}, expected a list of names of contacts, or a mapping of them")
    known, found = {one.name: one for one in scene.contacts if one.name}, list[Feedback]()
    for name in closed:
        if name not in known:
            names = ", ".join(known) or "none"
            raise UserError(f"closed: no contact is called {name!r}; contacts with a name: {names}")
        law = known[name].law
        if isinstance(closed, Mapping):
            given: Any = closed[name]
        elif law.kind is KelvinVoigt and not any(np.ndim(value) for value in law.values):
            given = law.values
        else:
            raise UserError(
                f"closed: the law of contact {name} has no stiffness that is one number; give it: "
                f"closed={{{name!r}: 1e6}}"
            )
        values = np.atleast_1d(positive(given, f"closed: {name}", zero=True))
        if values.size > 2:
            raise UserError(f"closed: {name}: found {given!r}, expected a stiffness, or (stiffness, damping)")
        found.append(Joint(known[name].between, float(values[0]), float(values[1:].sum())))
    return found


@checked
def root_locus(scene: Scene, path: str, values: ArrayLike, closed: Closed = (), modes: int | None = None) -> Any:
    """Return eigenvalues of the modes of a scene over a value, followed from mode to mode, (values, modes), complex.

    The modes are those of the scene without feedback, from the lowest frequency. Eigenvalues are matched to those of
    the value before by the least sum of distances.

    Args:
        scene: See `eigenvalues`.
        path: As in `scene.with_`, such as "flow.velocity".
        values: Values in the order in which they are followed; steps must be small beside the distance of two modes.
        closed: See `eigenvalues`.
        modes: Followed modes; default all that oscillate.

    Raises:
        UserError: As `eigenvalues` and `scene.with_`.
    """
    known = eigenvalues(scene.with_parts(scene.contacts, scene.loads, []), closed)
    known = known[known.imag > 0.0]
    rows = [known[np.argsort(known.imag)][: modes or len(known)]]
    for value in np.atleast_1d(finite(values, path)):
        found = eigenvalues(scene.with_({path: float(value)}), closed)
        distance = np.abs(rows[-1][:, None] - found[None])
        rows.append(found[scipy.optimize.linear_sum_assignment(distance)[1]])
    return np.array(rows[1:])


@dataclass(frozen=True)
class CriticalVelocity:
    """The value at which a scene turns unstable.

    Attributes:
        value: Value of the path, m/s for a velocity.
        frequency: Angular frequency of the mode that turns unstable, rad/s; 0 for divergence.
        eigenvalue: Eigenvalue at this value, 1/s.
        residual: Growth rate that is left there over the size of the eigenvalue.
    """

    value: float
    frequency: float
    eigenvalue: complex
    residual: float


@checked
def critical_velocity(scene: Scene, path: str, low: float, high: float, closed: Closed = ()) -> CriticalVelocity:
    """Return the value between two bounds at which the largest growth rate is 0, by Brent's method.

    Args:
        scene: See `eigenvalues`.
        path: As in `scene.with_`, such as "flow.velocity", or "flow*.velocity" for all flows of these names.
        low: Value at which the scene is stable.
        high: Value at which it is unstable; or both the other way around. Of several changes between them, one is
            found.
        closed: See `eigenvalues`.

    Raises:
        UserError: The scene is stable or unstable at both bounds, or a law of the flow does not hold there.
    """

    def growth(value: float) -> float:
        return float(eigenvalues(scene.with_({path: value}), closed)[0].real)

    if not 0.0 < low < high:
        raise UserError(f"critical velocity: found bounds {low!r} and {high!r}, expected 0 < low < high")
    first, last = growth(low), growth(high)
    if not first * last < 0.0:
        raise UserError(
            f"critical velocity: the largest growth rate is {first:.4g} 1/s at {path} = {low:g} and {last:.4g} 1/s at "
            f"{high:g}; expected decay at one bound and growth at the other; a structure without damping or that can "
            "move freely decays nowhere"
        )
    value = float(scipy.optimize.brentq(growth, low, high, xtol=SAME * low, rtol=SAME))
    at = scene.with_({path: value})
    found = eigenvalues(at, closed)[0]
    return CriticalVelocity(value, _held_at(at, found), complex(found), float(abs(found.real) / abs(found)))


def _held_at(scene: Scene, eigenvalue: Any) -> float:
    """Return the angular frequency of an eigenvalue, after a check that laws hold there."""
    frequency = abs(float(eigenvalue.imag))
    for one in scene.feedbacks if frequency > 0.0 else ():
        one.check(frequency)
    return frequency


@dataclass(frozen=True)
class IdleSupports:
    """Stability of a scene by the set of its supports that are idle.

    Attributes:
        tolerated: Supports that may be idle, whichever they are: each set of so many is stable. -1: unstable with all
            supports closed.
        growth: Largest growth rate by set of idle supports, 1/s, for all sets up to the first count with an unstable
            one.
    """

    tolerated: int
    growth: dict[frozenset[str], float]

    @property
    def unstable(self) -> list[frozenset[str]]:
        """The unstable sets, the fastest growth first."""
        return sorted((one for one, rate in self.growth.items() if not rate < 0.0), key=lambda one: -self.growth[one])


@checked
def idle_supports(scene: Scene, supports: Sequence[str] | Mapping[str, float | tuple[float, float]]) -> IdleSupports:
    """Return the number of supports that may be idle, in any combination, before a tube becomes unstable.

    Args:
        scene: See `eigenvalues`, with its flow.
        supports: Contacts that close or idle, as in `eigenvalues`; all other contacts are idle.

    Raises:
        UserError: As `eigenvalues`; or there are too many sets.
    """
    names, growth = list(supports), dict[frozenset[str], float]()
    for count in range(len(names) + 1):
        if comb(len(names), count) > MOST:
            raise UserError(f"idle supports: {comb(len(names), count)} sets of {count} supports; name fewer of them")
        for idle in map(frozenset, combinations(names, count)):
            left = [name for name in names if name not in idle]
            closed: Closed = {name: supports[name] for name in left} if isinstance(supports, Mapping) else left
            growth[idle] = float(eigenvalues(scene, closed)[0].real)
        found = IdleSupports(count - 1, growth)
        if found.unstable:
            return found
    return IdleSupports(len(names), growth)


@dataclass(frozen=True)
class ConnorsMargin:
    """Critical velocity by Connors' formula.

    Attributes:
        critical: Velocity at which the formula expects instability, m/s.
        effective: Velocity of the flow, weighted with the shape of the mode, m/s; NaN without a velocity.
        ratio: effective / critical: below 1 is stable, by this formula.
    """

    critical: float
    effective: float
    ratio: float


@checked
def connors(
    *, K: float, frequency: float, mass: float, decrement: float, diameter: float, density: float,
    velocity: float | None = None, span: FlowSpan | None = None, shape: ArrayLike | None = None,
) -> ConnorsMargin:  # fmt: skip
    """Return the critical velocity U = K f D sqrt(m delta / (rho D^2)), and the ratio of a velocity to it.

    With a span and the shape phi of a mode at its points, the effective velocity is

        U_e^2 = int rho(x)/rho U(x)^2 phi^2 dx / int phi^2 dx

    over this span, which is on the safe side where the flow covers a part of the tube. A check beside
    `critical_velocity`: the formula knows neither gaps nor phases.

    Args:
        K: Connors' constant, of the bundle; 3.0 is usual in design.
        frequency: f, angular, rad/s.
        mass: m, with the added mass, per length, kg/m.
        decrement: delta, logarithmic, 2 pi zeta; in two-phase flow with its two-phase part, an input with a source.
        diameter: D, m.
        density: rho, kg/m^3.
        velocity: Reference velocity, m/s.
        span: Span of the flow, with its profiles.
        shape: phi at the points of the span, (points,); default 1.

    Raises:
        UserError: A value is out of range, or a shape does not fit.

    Source: Connors (1970), ASME Flow-Induced Vibration in Heat Exchangers, 42; Pettigrew and Taylor (2003), J. Fluids
    Struct. 18, 61.
    """
    k, w, m, delta, D, rho = positives(
        "connors", K=K, frequency=frequency, mass=mass, decrement=decrement, diameter=diameter, density=density
    )
    critical = k * w / (2.0 * pi) * D * sqrt(m * delta / (rho * D * D))
    if velocity is None:
        return ConnorsMargin(critical, nan, nan)
    (effective,) = positives("connors", velocity=velocity)
    if span is not None:
        phi = np.ones(len(span.points)) if shape is None else finite(shape, "connors: shape")
        if phi.shape != (len(span.points),):
            raise UserError(f"connors: found a shape of {phi.size} values, expected one for each of {len(span.points)}")
        weight = span.lengths * phi**2
        effective *= sqrt(float(weight @ (span.density * span.velocity**2)) / float(weight.sum()))
    return ConnorsMargin(critical, effective, effective / critical)


OCTAVES, PARTS = 3, 4  # above and below the present velocity that are looked at, and velocities in each
UNDECIDED = 1e-10  # of an eigenvalue: growth that round-off makes
FREE = 1e-12  # of the largest eigenvalue: round-off in one of a motion that nothing holds
MODES = 12  # that Connors' formula is asked for


@dataclass(frozen=True)
class FlowMargin:
    """The first velocity at which a scene turns unstable, with all flows faster or slower by one factor.

    The factor is infinite where it is stable up to the highest one, and 0 where it is unstable from the lowest one on,
    from which the laws hold. The angular frequency, rad/s, is 0 for divergence, and NaN where no mode turns unstable.
    """

    factor: float
    frequency: float
    lowest: float
    highest: float


def flows_of(scene: Scene) -> list[Flow]:
    """Return the forces of flows of a scene."""
    return [one for one in scene.feedbacks if isinstance(one, Flow)]


def leading(scene: Scene, closed: Closed = ()) -> complex:
    """Return the eigenvalue of largest growth, 1/s, motions that nothing holds left out; 0 where nothing moves."""
    values = eigenvalues(scene, closed)
    moving = np.abs(values) > FREE * np.abs(values).max(initial=0.0)
    return complex(values[moving][0]) if moving.any() else 0j


def flow_margin(scene: Scene, closed: Closed = ()) -> FlowMargin:
    """Return the first velocity at which a scene with flows turns unstable, within three octaves of the present one.

    Raises:
        UserError: The scene has no flow, or a law does not hold at the present velocity or at the boundary.
    """
    if not flows_of(scene):
        raise UserError("flow margin: the scene has no force of a flow")

    def faster(factor: float) -> Scene:
        feedbacks = [
            one.replaced("velocity", factor * one.velocity) if isinstance(one, Flow) else one for one in scene.feedbacks
        ]
        return scene.with_parts(scene.contacts, scene.loads, feedbacks)

    def growth(factor: float) -> float:
        value = leading(faster(factor), closed)
        return value.real - UNDECIDED * abs(value)

    growth(1.0)
    rates = dict[float, float]()
    for factor in map(float, 2.0 ** (np.arange(-OCTAVES * PARTS, OCTAVES * PARTS + 1) / PARTS)):
        try:
            rates[factor] = growth(factor)
        except UserError:
            if rates:
                break
            continue
        if rates[factor] > 0.0:
            break
    tried = list(rates)
    if not rates[tried[-1]] > 0.0:
        return FlowMargin(inf, nan, tried[0], tried[-1])
    if len(tried) == 1:
        return FlowMargin(0.0, nan, tried[0], tried[0])
    found = float(scipy.optimize.brentq(growth, *tried[-2:], rtol=1e-12))
    at = faster(found)
    return FlowMargin(found, _held_at(at, leading(at, closed)), tried[0], tried[-1])


def connors_of_modes(
    scene: Scene, span: FlowSpan, closed: Closed, velocity: float, **figures: float
) -> tuple[ConnorsMargin, float]:
    """Return the largest ratio by Connors' formula of the lowest modes without flow, and the frequency of that mode.

    Modes are those with the closed supports; `figures` are K, mass, decrement, diameter and density of `connors`.
    """
    stiffness = np.diag(scene.squares)
    for one in [*(one for one in scene.feedbacks if isinstance(one, Joint)), *_closed_joints(scene, closed)]:
        rows = scene.rows([one.sense])
        stiffness -= rows.T @ one.D[:, : len(rows)] @ rows
    squares, shapes = np.linalg.eigh(stiffness)
    elastic = np.flatnonzero(squares > 1e-9 * squares[-1])[:MODES]
    moving = (scene.rows_of(span.structure, one.rows) @ shapes[:, elastic] for one in span.points)
    moved = [np.linalg.norm(one, axis=0) for one in moving]
    sizes, found = np.linalg.norm(moved, axis=0), list[tuple[ConnorsMargin, float]]()
    for shape, size, w in zip(np.transpose(moved), sizes, np.sqrt(squares[elastic]), strict=True):
        if size > 1e-3 * sizes.max():
            found.append((connors(frequency=float(w), velocity=velocity, span=span, shape=shape, **figures), float(w)))
    return max(found, key=lambda one: one[0].ratio)
