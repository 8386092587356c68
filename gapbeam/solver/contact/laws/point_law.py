"""Contact law at one point: spring, damper and clipping in the form that a scheme asks for.

With the penetration d = -g, the closed law is p = e(d) + c(d) d' for d > 0, p = 0 otherwise, clipped at p >= 0 unless
the face may pull. At many points, rows of m points, (r, m), are filled in place.

The elastic pressure is a spring and ramps, linear springs that begin at a depth, e = K (f(d) + sum_j k_j <d - b_j>).
f is d^n, whose discrete gradient has a closed form, or the formula of a law with its slope and its integral: the
discrete gradient is then their difference quotient, or a quadrature of f where two depths are so close that the
difference would cancel.

A stop that yields is a linear spring whose plastic set s stays: d is counted from it, and pressing bends at the depth
b = s h / (1 - h) + p_y / K beyond it and goes on with the slope h K; it returns along K. Over a step that starts with
s0 the pressure is a sum of two ramps, whose discrete gradient does exactly the work of pressing: elastic energy
K <d - s>^2 / 2 and plastic work. The set changes when a step is accepted: s1 = max(s0, (1 - h) (d1 - p_y / K)).

Source: Simo and Hughes (1998), Computational Inelasticity, ch. 1, for the return in one dimension.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gapbeam.solver.compilation.jit import compiled_in_order, entry
from gapbeam.solver.contact.laws.damper import DampedPoint, Parameters
from gapbeam.solver.contact.laws.law_choice import UNDAMPED, damping, own_spring
from gapbeam.solver.contact.laws.law_tables import ENDPOINT, MEAN
from gapbeam.solver.contact.laws.springs import (
    FAR_APART,
    SHARES,
    WEIGHTS,
    spring_mean,
    spring_potential,
    spring_pressure,
    spring_slope,
)
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
        softer: 1 - h of a law that yields; 0: it does not.
        spring: Number of the formula of the spring, of `law_choice`; 0: K d^n.
        own: Parameters of that formula.
        ramps: k_j and b_j, m, of each ramp, one after the other.
    """

    exponent: float
    formula: int
    parameters: Parameters
    jumps: bool
    adhesive: bool
    touch_depth: float
    touch_product: float
    slowest_touch: float
    softer: float
    spring: int
    own: Parameters
    ramps: Array


class LawTable(NamedTuple):
    """Contact laws as numbers: one law at all points, or several of them side by side.

    Attributes:
        rows: The `LawNumbers` of each law, (laws, 17 + 2 ramps); ramps that one does not have are of no stiffness.
        owner: The law of each point, (m,).
        by_touch: Whether the damper of a law follows from touch speeds.
        stiffness: K of each point, (m,).
        coefficient: Coefficient of the damper at each point, (m,).
        yielding: Plastic set s and yield depth p_y / K of each point, (m, 2), m; 0 where the law does not yield.
    """

    rows: Array
    owner: Indices
    by_touch: bool
    stiffness: Array
    coefficient: Array
    yielding: Array


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
        coefficient: Coefficient of the damper.
        old_depth: Penetration at the start of the step, m.
        old_pressure: Pressure that acted last, Pa.
        guess_depth: Penetration of the predictor, ENDPOINT, m.
        guess_rate: Its rate, m/s.
        plastic_set: s at the start of the step, m.
        yield_depth: p_y / K, m.
    """

    stiffness: float
    coefficient: float
    old_depth: float
    old_pressure: float
    guess_depth: float
    guess_rate: float
    plastic_set: float
    yield_depth: float


BEFORE_RAMPS = 17  # columns of a row


def row_of(numbers: LawNumbers) -> Array:
    """Return the numbers of a law as a row of a table, (17 + 2 ramps,)."""
    exponent, formula, parameters, *others, own, ramps = numbers
    return np.array([exponent, formula, *parameters, *others, *own, *ramps], dtype=float)


@compiled_in_order
def numbers_at(law: LawTable, point: int) -> LawNumbers:
    """Return the numbers of the law at a point."""
    row = law.rows[law.owner[point]]
    parameters = (row[2], row[3], row[4], row[5])
    return LawNumbers(
        row[0], int(row[1]), parameters, row[6] > 0.0, row[7] > 0.0, row[8], row[9], row[10], row[11], int(row[12]),
        (row[13], row[14], row[15], row[16]), row[BEFORE_RAMPS:],
    )  # fmt: skip


@compiled_in_order
def resting_point(law: LawTable, point: int) -> Point:
    """Return a contact point at rest."""
    yielding = law.yielding[point]
    return Point(law.stiffness[point], law.coefficient[point], 0.0, 0.0, 0.0, 0.0, yielding[0], yielding[1])


@compiled_in_order
def touch_factor(product: float, slowest: float, speed: float) -> float:
    """Return chi = p / v0 of a contact that began at a speed, at the slowest one where that is larger."""
    return product / max(speed, slowest)


@compiled_in_order
def damping_at(law: LawNumbers, stiffness: float, coefficient: float, depth: float) -> tuple[float, float, float]:
    """Return c(d), its slope and its integral C(d) at a point."""
    return damping(law.formula, DampedPoint(stiffness, law.exponent, coefficient, law.parameters), depth)


@compiled_in_order
def set_after(law: LawNumbers, point: Point, depth: float) -> float:
    """Return the plastic set that is left of a penetration, m."""
    if law.softer == 0.0:
        return 0.0
    return max(law.softer * (depth - point.yield_depth), point.plastic_set)


@compiled_in_order
def bend_of(law: LawNumbers, point: Point) -> float:
    """Return the depth b beyond the plastic set from which a law yields, m."""
    return point.plastic_set * (1.0 - law.softer) / law.softer + point.yield_depth


@compiled_in_order
def own_parts(law: LawNumbers, stiffness: float, depth: float) -> tuple[float, float, float]:
    """Return K f(d), its slope and its potential by the formula of the law, 0 for d <= 0."""
    if depth <= 0.0:
        return 0.0, 0.0, 0.0
    pressure, slope, potential = own_spring(law.spring, law.own, depth)
    return stiffness * pressure, stiffness * slope, stiffness * potential


@compiled_in_order
def own_mean(law: LawNumbers, stiffness: float, old: float, new: float) -> tuple[float, float]:
    """Return the discrete gradient of K f(d) between two depths, and its slope in the second, as `spring_mean`."""
    apart, mean, slope = new - old, 0.0, 0.0
    if abs(apart) <= FAR_APART * max(abs(old), abs(new)):
        for share, weight in zip(SHARES, WEIGHTS):  # noqa: B905 - compiled code knows no strict
            pressure, rise, _ = own_parts(law, stiffness, old + share * apart)
            mean, slope = mean + weight * pressure, slope + weight * share * rise
        return mean, slope
    pressure, _, stored = own_parts(law, stiffness, new)
    mean = (stored - own_parts(law, stiffness, old)[2]) / apart
    return mean, max((pressure - mean) / apart, 0.0)


@compiled_in_order
def elastic_pressure(law: LawNumbers, point: Point, depth: float) -> tuple[float, float]:
    """Return e(d) and its slope, with the set of the point."""
    beyond, stiffness = depth - point.plastic_set, point.stiffness
    if law.spring == 0:
        pressure = spring_pressure(stiffness, law.exponent, beyond)
        slope = spring_slope(stiffness, law.exponent, beyond)
    else:
        pressure, slope, _ = own_parts(law, stiffness, beyond)
    for j in range(0, len(law.ramps), 2):
        pressure += spring_pressure(law.ramps[j] * stiffness, 1.0, beyond - law.ramps[j + 1])
        slope += spring_slope(law.ramps[j] * stiffness, 1.0, beyond - law.ramps[j + 1])
    if law.softer > 0.0:
        over = beyond - bend_of(law, point)
        pressure -= spring_pressure(law.softer * stiffness, 1.0, over)
        slope -= spring_slope(law.softer * stiffness, 1.0, over)
    return pressure, max(slope, 0.0)


@compiled_in_order
def elastic_potential(law: LawNumbers, point: Point, depth: float) -> float:
    """Return psi(d), with the set that the penetration leaves."""
    beyond, stiffness = depth - max(set_after(law, point, depth), 0.0), point.stiffness
    if law.spring == 0:
        potential = spring_potential(stiffness, law.exponent, beyond)
    else:
        potential = own_parts(law, stiffness, beyond)[2]
    for j in range(0, len(law.ramps), 2):
        potential += spring_potential(law.ramps[j] * stiffness, 1.0, beyond - law.ramps[j + 1])
    return potential


@compiled_in_order
def elastic_mean(law: LawNumbers, point: Point, old: float, new: float) -> tuple[float, float, float]:
    """Return the discrete gradient of the work of pressing, its slope in the second depth, and its elastic part."""
    before, beyond, stiffness = old - point.plastic_set, new - point.plastic_set, point.stiffness
    if law.spring == 0:
        mean, slope = spring_mean(stiffness, law.exponent, before, beyond)
    else:
        mean, slope = own_mean(law, stiffness, before, beyond)
    if law.softer == 0.0 and len(law.ramps) == 0:
        return mean, slope, mean
    for j in range(0, len(law.ramps), 2):
        begins = law.ramps[j + 1]
        ramp = spring_mean(law.ramps[j] * stiffness, 1.0, before - begins, beyond - begins)
        mean, slope = mean + ramp[0], slope + ramp[1]
    elastic = mean
    if law.softer > 0.0:
        bend = bend_of(law, point)
        ramp = spring_mean(law.softer * stiffness, 1.0, before - bend, beyond - bend)
        mean, slope = mean - ramp[0], slope - ramp[1]
        after = set_after(law, point, new)
        if after > point.plastic_set:
            first, last = max(before, 0.0), max(new - after, 0.0)
            elastic = 0.5 * stiffness * (last + first) * ((last - first) / (new - old))
    return mean, max(slope, 0.0), elastic


@compiled_in_order
def stage_pressure(step: StepNumbers, law: LawNumbers, point: Point, depth: float) -> tuple[float, float, float]:
    """Return pressure, slope and elastic part in the balance of a step that ends at a depth."""
    if step.form == ENDPOINT:
        rate = point.guess_rate + step.rate_slope * (depth - point.guess_depth)
        pressure, slope, elastic = endpoint_pressure(law, point, depth, rate, step.rate_slope)
        share = step.old_share
        return (1.0 - share) * pressure + share * point.old_pressure, (1.0 - share) * slope, elastic
    old = point.old_depth
    if old <= 0.0 and depth <= 0.0:
        return 0.0, 0.0, 0.0
    if step.form == MEAN:
        pressure, slope, elastic = elastic_mean(law, point, old, depth)
    else:
        pressure, slope = elastic_pressure(law, point, depth)
        elastic = pressure
        if law.softer > 0.0:
            after = set_after(law, point, depth)
            if after > point.plastic_set:
                elastic *= 1.0 - (after - point.plastic_set) / (depth - old)
    if law.formula == UNDAMPED:
        return pressure, slope, elastic
    stiffness, before = point.stiffness, point.plastic_set
    value, _, integral = damping_at(law, stiffness, point.coefficient, depth - before)
    pressure += (integral - damping_at(law, stiffness, point.coefficient, old - before)[2]) / step.dt
    slope += value / step.dt
    if not law.adhesive and pressure <= 0.0:
        return 0.0, 0.0, elastic
    return pressure, slope, elastic


@compiled_in_order
def endpoint_pressure(
    law: LawNumbers, point: Point, depth: float, rate: float, rate_slope: float
) -> tuple[float, float, float]:
    """Return pressure, slope and elastic part of the law at one instant, p = chi(d) <e(d) + c(d) d'>.

    For a damper that jumps at touch, chi rises linearly from 0 to 1 over a depth: that keeps the clipped law
    non-decreasing in d. For others chi = 1.
    """
    if depth <= 0.0:
        return 0.0, 0.0, 0.0
    elastic, slope = elastic_pressure(law, point, depth)
    if law.formula == UNDAMPED:
        return elastic, slope, elastic
    value, value_slope, _ = damping_at(law, point.stiffness, point.coefficient, depth)
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
def fill_elastic(law: LawTable, depth: Array, found: Array) -> None:
    """Set e(d), its slope and psi(d), (3, r, m)."""
    for row in range(depth.shape[0]):
        for i in range(depth.shape[1]):
            numbers, point = numbers_at(law, i), resting_point(law, i)
            found[0, row, i], found[1, row, i] = elastic_pressure(numbers, point, depth[row, i])
            found[2, row, i] = elastic_potential(numbers, point, depth[row, i])


@entry
def fill_stage(step: StepNumbers, law: LawTable, old: Array, new: Array, found: Array) -> None:
    """Set pressure, slope and elastic part, (3, r, m), of a step between two depths; MEAN or IMPLICIT."""
    for row in range(new.shape[0]):
        for i in range(new.shape[1]):
            here = resting_point(law, i)
            point = Point(
                here.stiffness, here.coefficient, old[row, i], 0.0, 0.0, 0.0, here.plastic_set, here.yield_depth
            )
            pressure, slope, elastic = stage_pressure(step, numbers_at(law, i), point, new[row, i])
            found[0, row, i], found[1, row, i], found[2, row, i] = pressure, slope, elastic


@entry
def fill_endpoint(law: LawTable, depth: Array, rate: Array, rate_slope: float, found: Array) -> None:
    """Set pressure, slope and elastic part, (3, r, m), at one instant."""
    for row in range(depth.shape[0]):
        for i in range(depth.shape[1]):
            pressure, slope, elastic = endpoint_pressure(
                numbers_at(law, i), resting_point(law, i), depth[row, i], rate[row, i], rate_slope
            )
            found[0, row, i], found[1, row, i], found[2, row, i] = pressure, slope, elastic


@entry
def fill_damping(law: LawTable, depth: Array, found: Array) -> None:
    """Set c(d), (r, m)."""
    for row in range(depth.shape[0]):
        for i in range(depth.shape[1]):
            beyond = depth[row, i] - law.yielding[i, 0]
            found[row, i] = damping_at(numbers_at(law, i), law.stiffness[i], law.coefficient[i], beyond)[0]


@entry
def fill_touch_factors(product: float, slowest: float, speed: Array, factor: Array) -> None:
    """Set chi, (m,), of contacts that began at these speeds, (m,)."""
    for i in range(len(speed)):
        factor[i] = touch_factor(product, slowest, speed[i])
