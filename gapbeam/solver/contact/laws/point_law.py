"""Contact law at one point: spring, damper and clipping in the form that a scheme asks for.

With the penetration d = -g, the closed law is p = e(d) + c(d) d' for d > 0, p = 0 otherwise, clipped at p >= 0 unless
the face may pull. At many points, rows of m points, (r, m), are filled in place.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gapbeam.solver.compilation.jit import compiled_in_order, entry
from gapbeam.solver.contact.laws.damper import DampedPoint, Parameters
from gapbeam.solver.contact.laws.law_choice import UNDAMPED, damping
from gapbeam.solver.contact.laws.law_tables import ENDPOINT, MEAN
from gapbeam.solver.contact.laws.springs import spring_mean, spring_pressure, spring_slope
from gapbeam.solver.system.operators import Array, Indices


class LawNumbers(NamedTuple):
    """The part of a contact law that is the same at all its points.

    Attributes:
        exponent: n.
        formula: Number of the damping formula, of `law_choice`.
        parameters: Parameters of that formula.
        jumps: Whether the damper jumps at touch.
        adhesive: Whether the damper may pull.
        touch_depth: Depth over which a damper that jumps is switched on, m.
        touch_product: p = chi v0 where chi follows from the touch speed; 0: chi is given.
        slowest_touch: Speed as which slower touches are damped, m/s.
    """

    exponent: float
    formula: int
    parameters: Parameters
    jumps: bool
    adhesive: bool
    touch_depth: float
    touch_product: float
    slowest_touch: float


class LawTable(NamedTuple):
    """Contact laws as numbers: one law at all points, or several of them side by side.

    Attributes:
        rows: The `LawNumbers` of each law, (laws, 11).
        owner: The law of each point, (m,).
        by_touch: Whether the damper of a law follows from touch speeds.
        stiffness: K of each point, (m,).
        coefficient: Coefficient of the damper at each point, (m,).
    """

    rows: Array
    owner: Indices
    by_touch: bool
    stiffness: Array
    coefficient: Array


class StepNumbers(NamedTuple):
    """Form of the law in the step of a scheme.

    Attributes:
        form: MEAN, IMPLICIT or ENDPOINT.
        dt: Step, s.
        old_share: Share of the pressure before in the balance, ENDPOINT.
        rate_slope: Derivative of d' with respect to d, ENDPOINT, 1/s.
    """

    form: int
    dt: float
    old_share: float
    rate_slope: float


class Point(NamedTuple):
    """A contact point in a step.

    Attributes:
        stiffness: K.
        coefficient: Of the damper.
        old_depth: Penetration at the start of the step, m.
        old_pressure: Pressure that acted last, Pa.
        guess_depth: Penetration of the predictor, ENDPOINT, m.
        guess_rate: Its rate, m/s.
    """

    stiffness: float
    coefficient: float
    old_depth: float
    old_pressure: float
    guess_depth: float
    guess_rate: float


def row_of(numbers: LawNumbers) -> Array:
    """Return the numbers of a law as a row of a table, (11,)."""
    exponent, formula, parameters, *others = numbers
    return np.array([exponent, formula, *parameters, *others], dtype=float)


@compiled_in_order
def numbers_at(law: LawTable, point: int) -> LawNumbers:
    """Return the numbers of the law at a point."""
    row = law.rows[law.owner[point]]
    parameters = (row[2], row[3], row[4], row[5])
    return LawNumbers(row[0], int(row[1]), parameters, row[6] > 0.0, row[7] > 0.0, row[8], row[9], row[10])


@compiled_in_order
def touch_factor(product: float, slowest: float, speed: float) -> float:
    """Return chi = p / v0 of a contact that began at a speed, at the slowest one where that is larger."""
    return product / max(speed, slowest)


@compiled_in_order
def damping_at(law: LawNumbers, stiffness: float, coefficient: float, depth: float) -> tuple[float, float, float]:
    """Return c(d), its slope and its integral C(d) at a point."""
    return damping(law.formula, DampedPoint(stiffness, law.exponent, coefficient, law.parameters), depth)


@compiled_in_order
def stage_pressure(step: StepNumbers, law: LawNumbers, point: Point, depth: float) -> tuple[float, float, float]:
    """Return pressure, slope and elastic part in the balance of a step that ends at a depth."""
    if step.form == ENDPOINT:
        rate = point.guess_rate + step.rate_slope * (depth - point.guess_depth)
        pressure, slope, elastic = endpoint_pressure(
            law, point.stiffness, point.coefficient, depth, rate, step.rate_slope
        )
        share = step.old_share
        return (1.0 - share) * pressure + share * point.old_pressure, (1.0 - share) * slope, elastic
    old = point.old_depth
    if old <= 0.0 and depth <= 0.0:
        return 0.0, 0.0, 0.0
    stiffness, exponent = point.stiffness, law.exponent
    if step.form == MEAN:
        elastic, slope = spring_mean(stiffness, exponent, old, depth)
    else:
        elastic = spring_pressure(stiffness, exponent, depth)
        slope = spring_slope(stiffness, exponent, depth)
    if law.formula == UNDAMPED:
        return elastic, slope, elastic
    value, _, integral = damping_at(law, stiffness, point.coefficient, depth)
    pressure = elastic + (integral - damping_at(law, stiffness, point.coefficient, old)[2]) / step.dt
    slope += value / step.dt
    if not law.adhesive and pressure <= 0.0:
        return 0.0, 0.0, elastic
    return pressure, slope, elastic


@compiled_in_order
def endpoint_pressure(
    law: LawNumbers, stiffness: float, coefficient: float, depth: float, rate: float, rate_slope: float
) -> tuple[float, float, float]:
    """Return pressure, slope and elastic part of the law at one instant, p = chi(d) <e(d) + c(d) d'>.

    For a damper that jumps at touch, chi rises linearly from 0 to 1 over a depth: that keeps the clipped law
    non-decreasing in d. For others chi = 1.
    """
    if depth <= 0.0:
        return 0.0, 0.0, 0.0
    elastic = spring_pressure(stiffness, law.exponent, depth)
    slope = spring_slope(stiffness, law.exponent, depth)
    if law.formula == UNDAMPED:
        return elastic, slope, elastic
    value, value_slope, _ = damping_at(law, stiffness, coefficient, depth)
    bracket = elastic + value * rate
    slope = max(slope + value * rate_slope + value_slope * rate, 0.0)
    if not law.adhesive and bracket <= 0.0:
        bracket, slope = 0.0, 0.0
    if not law.jumps:
        return bracket, slope, elastic
    share = min(depth / law.touch_depth, 1.0)
    share_slope = 1.0 / law.touch_depth if depth < law.touch_depth else 0.0
    return share * bracket, share * slope + share_slope * bracket, elastic


@entry
def fill_stage(step: StepNumbers, law: LawTable, old: Array, new: Array, found: Array) -> None:
    """Set pressure, slope and elastic part, (3, r, m), of a step between two depths; MEAN or IMPLICIT."""
    for row in range(new.shape[0]):
        for i in range(new.shape[1]):
            point = Point(law.stiffness[i], law.coefficient[i], old[row, i], 0.0, 0.0, 0.0)
            pressure, slope, elastic = stage_pressure(step, numbers_at(law, i), point, new[row, i])
            found[0, row, i], found[1, row, i], found[2, row, i] = pressure, slope, elastic


@entry
def fill_endpoint(law: LawTable, depth: Array, rate: Array, rate_slope: float, found: Array) -> None:
    """Set pressure, slope and elastic part, (3, r, m), at one instant."""
    for row in range(depth.shape[0]):
        for i in range(depth.shape[1]):
            pressure, slope, elastic = endpoint_pressure(
                numbers_at(law, i), law.stiffness[i], law.coefficient[i], depth[row, i], rate[row, i], rate_slope
            )
            found[0, row, i], found[1, row, i], found[2, row, i] = pressure, slope, elastic


@entry
def fill_damping(law: LawTable, depth: Array, found: Array) -> None:
    """Set c(d), (r, m)."""
    for row in range(depth.shape[0]):
        for i in range(depth.shape[1]):
            found[row, i] = damping_at(numbers_at(law, i), law.stiffness[i], law.coefficient[i], depth[row, i])[0]


@entry
def fill_damping_parts(law: LawTable, depth: Array, found: Array) -> None:
    """Set c(d), its slope and its integral, (3, r, m)."""
    for row in range(depth.shape[0]):
        for i in range(depth.shape[1]):
            value, slope, integral = damping_at(numbers_at(law, i), law.stiffness[i], law.coefficient[i], depth[row, i])
            found[0, row, i], found[1, row, i], found[2, row, i] = value, slope, integral


@entry
def fill_touch_factors(product: float, slowest: float, speed: Array, factor: Array) -> None:
    """Set chi, (m,), of contacts that began at these speeds, (m,)."""
    for i in range(len(speed)):
        factor[i] = touch_factor(product, slowest, speed[i])
