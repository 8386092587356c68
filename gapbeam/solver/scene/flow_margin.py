"""Margins of a scene in a flow: the factor on all velocities at which it turns unstable, and Connors' formula.

The formula is linear and knows no gaps; it stands beside eigenvalues.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, pi, sqrt
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike

from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.scene.argument_checks import checked, finite, positive
from gapbeam.solver.scene.feedback import Joint
from gapbeam.solver.scene.flow_force import Flow, FlowSpan
from gapbeam.solver.scene.linear_stability import Closed, closed_joints, eigenvalues
from gapbeam.solver.scene.scene import Scene
from gapbeam.solver.system.operators import Array


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
        span: Where the profiles are.
        shape: phi at the points of the span, (points,); default 1.

    Raises:
        UserError: A value is out of range, or a shape does not fit.

    Source: Connors (1970), ASME Flow-Induced Vibration in Heat Exchangers, 42; Pettigrew and Taylor (2003), J. Fluids
    Struct. 18, 61.
    """
    given: dict[str, Any] = {
        "K": K, "frequency": frequency, "mass": mass, "decrement": decrement, "diameter": diameter, "density": density,
    }  # fmt: skip
    k, w, m, delta, D, rho = (float(positive(value, f"connors: {name}")) for name, value in given.items())
    critical = k * w / (2.0 * pi) * D * sqrt(m * delta / (rho * D * D))
    if velocity is None:
        return ConnorsMargin(critical, float("nan"), float("nan"))
    effective = float(positive(velocity, "connors: velocity"))
    if span is not None:
        phi = np.ones(len(span.points)) if shape is None else finite(shape, "connors: shape")
        if phi.shape != (len(span.points),):
            raise UserError(f"connors: found a shape of {phi.size} values, expected one for each of {len(span.points)}")
        weight = span.lengths * phi**2
        effective *= sqrt(float(weight @ (span.density * span.velocity**2)) / float(weight.sum()))
    return ConnorsMargin(critical, effective, effective / critical)


OCTAVES, PARTS = 3, 4
"""Octaves above and below the present velocity that are looked at, and velocities in each."""
UNDECIDED = 1e-10  # of an eigenvalue: growth that round-off makes
FREE = 1e-12  # of the largest eigenvalue: round-off in one of a motion that nothing holds
MODES = 12
"""Modes that Connors' formula is asked for."""


@dataclass(frozen=True)
class FlowMargin:
    """The first velocity at which a scene turns unstable, with all flows faster or slower by one factor.

    Attributes:
        factor: Critical over present velocity; infinite: stable up to `highest`; 0: unstable from `lowest` on.
        frequency: Frequency of the mode that turns unstable, rad/s; 0 for divergence, NaN where none does.
        lowest: Least factor that was looked at: the laws hold from there on.
        highest: Largest factor that was looked at.
    """

    factor: float
    frequency: float
    lowest: float
    highest: float


def flows_of(scene: Scene) -> list[Flow]:
    """Return the forces of flows of a scene."""
    return [one for one in scene.feedbacks if isinstance(one, Flow)]


def at_factor(scene: Scene, factor: float) -> Scene:
    """Return the scene with all flows faster by a factor.

    Raises:
        UserError: A law does not hold at that velocity.
    """
    feedbacks = [one.replaced("velocity", factor * one.velocity) if isinstance(one, Flow) else one
                 for one in scene.feedbacks]  # fmt: skip
    return scene.with_parts(scene.contacts, scene.loads, feedbacks)


def leading(scene: Scene, closed: Closed = ()) -> complex:
    """Return the eigenvalue of largest growth, 1/s, motions that nothing holds left out; 0 where nothing moves.

    Args:
        scene: See `eigenvalues`.
        closed: See `eigenvalues`.

    Raises:
        UserError: As `eigenvalues`.
    """
    values = eigenvalues(scene, closed)
    moving = np.abs(values) > FREE * np.abs(values).max(initial=0.0)
    return complex(values[moving][0]) if moving.any() else 0j


def flow_margin(scene: Scene, closed: Closed = ()) -> FlowMargin:
    """Return the first velocity at which a scene turns unstable, within three octaves of the present one.

    Args:
        scene: With flows.
        closed: As of `eigenvalues`.

    Raises:
        UserError: The scene has no flow, or a law does not hold at the present velocity or at the boundary.
    """
    if not flows_of(scene):
        raise UserError("flow margin: the scene has no force of a flow")
    at_factor(scene, 1.0)

    def growth(factor: float) -> float:
        value = leading(at_factor(scene, factor), closed)
        return value.real - UNDECIDED * abs(value)

    lowest, last, factor = 0.0, -inf, 1.0
    for factor in 2.0 ** (np.arange(-OCTAVES * PARTS, OCTAVES * PARTS + 1) / PARTS):
        try:
            now = growth(float(factor))
        except UserError:
            if lowest > 0.0:
                factor *= 2.0 ** (-1.0 / PARTS)
                break
            continue
        if not lowest:
            lowest, last = float(factor), now
            if now > 0.0:
                return FlowMargin(0.0, float("nan"), lowest, lowest)
        if last <= 0.0 < now:
            found = float(scipy.optimize.brentq(growth, factor * 2.0 ** (-1.0 / PARTS), factor, rtol=1e-12))
            frequency = abs(leading(at_factor(scene, found), closed).imag)
            for one in flows_of(at_factor(scene, found)) if frequency > 0.0 else ():
                one.check(frequency)
            return FlowMargin(found, frequency, lowest, float(factor))
        last = now
    return FlowMargin(inf, float("nan"), lowest, float(factor))


def connors_of_modes(
    scene: Scene, span: FlowSpan, closed: Closed, velocity: float, **figures: float
) -> tuple[ConnorsMargin, float]:
    """Return the largest ratio by Connors' formula of the lowest modes without flow, and the frequency of that mode.

    Args:
        scene: See `eigenvalues`.
        span: Where the flow is.
        closed: Supports that are closed.
        velocity: Velocity of the flow, m/s.
        figures: K, mass, decrement, diameter, density of `connors`.

    Raises:
        UserError: As `eigenvalues`.
    """
    stiffness = np.diag(scene.squares)
    for one in [*(one for one in scene.feedbacks if isinstance(one, Joint)), *closed_joints(scene, closed)]:
        rows = scene.rows([one.sense])
        stiffness -= rows.T @ one.D[:, : len(rows)] @ rows
    squares, shapes = np.linalg.eigh(stiffness)
    elastic = np.flatnonzero(squares > 1e-9 * squares[-1])[:MODES]
    found = list[tuple[ConnorsMargin, float]]()
    largest: Any = max(np.linalg.norm(_on_span(scene, span, shapes[:, i])) for i in elastic)
    for i in elastic:
        shape, w = _on_span(scene, span, shapes[:, i]), float(np.sqrt(squares[i]))
        if np.linalg.norm(shape) > 1e-3 * largest:
            found.append((connors(frequency=w, velocity=velocity, span=span, shape=shape, **figures), w))
    return max(found, key=lambda one: one[0].ratio)


def _on_span(scene: Scene, span: FlowSpan, shape: Array) -> Array:
    """Return the motions of the points of a span in a mode, (points,)."""
    moved = [scene.rows_of(span.structure, point.rows) @ shape for point in span.points]
    return np.asarray(np.linalg.norm(np.array(moved), axis=1), dtype=float)
