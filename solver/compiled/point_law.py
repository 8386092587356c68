"""The contact laws of `solver.contact.law` at one point, compiled."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from solver.compiled.jit import compiled
from solver.contact.dampers import ConstantDamper, HuntCrossleyDamper, SmoothStepDamper
from solver.contact.law import SLOWEST_TOUCH, ContactLaw
from solver.contact.springs import FAR_APART
from solver.operators import Array

UNDAMPED, CONSTANT, HUNT_CROSSLEY, SMOOTH_STEP = 0, 1, 2, 3
MEAN, IMPLICIT, ENDPOINT = 0, 1, 2  # discrete gradient, its implicit sibling, the law at one instant
_NODES, _TWICE = np.polynomial.legendre.leggauss(4)
_SHARES, _WEIGHTS = np.asarray(0.5 * (1.0 + _NODES)), np.asarray(0.5 * _TWICE)


class LawNumbers(NamedTuple):
    """What of a contact law is the same at all points.

    Attributes:
        exponent: n.
        damper: Which damper.
        full_depth: d_max of the smooth step, m.
        adhesive: Whether the damper may pull.
        touch_depth: Depth over which a damper that jumps is switched on, m.
        touch_product: p = chi v0 where chi follows from the touch speed; 0: chi is given.
    """

    exponent: float
    damper: int
    full_depth: float
    adhesive: bool
    touch_depth: float
    touch_product: float


class LawTable(NamedTuple):
    """A contact law as numbers.

    Attributes:
        numbers: What is the same at all points.
        stiffness: K of each point, (m,).
        coefficient: Coefficient of the damper at each point, (m,): c, chi or c_max.
    """

    numbers: LawNumbers
    stiffness: Array
    coefficient: Array


class StepNumbers(NamedTuple):
    """What a scheme makes of the law.

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


def law_table(law: ContactLaw, size: int) -> LawTable:
    """Return a law without friction and multipliers as numbers, for m = `size` points."""
    damper = law.damper
    kind, full_depth = UNDAMPED, 1.0
    coefficient: Array = np.zeros(size)
    if isinstance(damper, ConstantDamper) and np.any(damper.coefficient):
        kind, coefficient = CONSTANT, np.zeros(size) + damper.coefficient
    elif isinstance(damper, HuntCrossleyDamper):
        kind, coefficient = HUNT_CROSSLEY, np.zeros(size) + damper.factor
    elif isinstance(damper, SmoothStepDamper):
        kind, coefficient, full_depth = SMOOTH_STEP, np.zeros(size) + damper.coefficient, damper.full_depth
    numbers = LawNumbers(
        float(law.spring.exponent),
        kind,
        float(full_depth),
        bool(law.adhesive),
        float(law.touch_depth),
        float(law.touch_product or 0.0),
    )
    return LawTable(numbers, np.zeros(size) + law.spring.stiffness, coefficient)


@compiled
def touch_factor(product: float, speed: float) -> float:
    """Return chi = p / v0 of a contact that began at a speed."""
    return product / max(speed, SLOWEST_TOUCH)


@compiled
def spring_pressure(stiffness: float, exponent: float, depth: float) -> float:
    """Return K <d>^n."""
    if depth <= 0.0:
        return 0.0
    return stiffness * (depth if exponent == 1.0 else depth**exponent)


@compiled
def spring_slope(stiffness: float, exponent: float, depth: float) -> float:
    """Return n K <d>^(n-1)."""
    if depth <= 0.0:
        return 0.0
    return stiffness if exponent == 1.0 else exponent * stiffness * depth ** (exponent - 1.0)


@compiled
def spring_potential(stiffness: float, exponent: float, depth: float) -> float:
    """Return K <d>^(n+1) / (n+1)."""
    if depth <= 0.0:
        return 0.0
    return (
        0.5 * stiffness * depth * depth if exponent == 1.0 else stiffness / (exponent + 1.0) * depth ** (exponent + 1)
    )


@compiled
def spring_mean(stiffness: float, exponent: float, old: float, new: float) -> tuple[float, float]:
    """Return the discrete gradient of the potential and its slope, for old > 0 or new > 0; as `Spring.mean`."""
    apart = new - old
    if exponent == 1.0:
        half = 0.5 * stiffness
        if old > 0.0 and new > 0.0:
            return half * (new + old), half
        if new > 0.0:
            share = new / apart
            return half * new * share, half * share * ((new - 2.0 * old) / apart)
        share = old / apart
        return -half * old * share, half * share * share
    if abs(apart) <= FAR_APART * max(abs(old), abs(new)):
        mean, slope = 0.0, 0.0
        for share, weight in zip(_SHARES, _WEIGHTS):  # noqa: B905 - compiled code knows no strict
            between = old + share * apart
            mean += weight * spring_pressure(stiffness, exponent, between)
            slope += weight * share * spring_slope(stiffness, exponent, between)
        return mean, slope
    potential = spring_potential(stiffness, exponent, new) - spring_potential(stiffness, exponent, old)
    mean = potential / apart
    return mean, max((spring_pressure(stiffness, exponent, new) - mean) / apart, 0.0)


@compiled
def damping(law: LawNumbers, stiffness: float, coefficient: float, depth: float) -> tuple[float, float, float]:
    """Return c(d), its slope and its integral C(d)."""
    if depth <= 0.0:
        return 0.0, 0.0, 0.0
    exponent = law.exponent
    if law.damper == CONSTANT:
        return coefficient, 0.0, coefficient * depth
    if law.damper == HUNT_CROSSLEY:
        return (
            coefficient * spring_pressure(stiffness, exponent, depth),
            coefficient * spring_slope(stiffness, exponent, depth),
            coefficient * spring_potential(stiffness, exponent, depth),
        )
    q = min(depth / law.full_depth, 1.0)
    beyond = max(depth - law.full_depth, 0.0)
    return (
        coefficient * q * q * (3.0 - 2.0 * q),
        coefficient * 6.0 * q * (1.0 - q) / law.full_depth,
        coefficient * (law.full_depth * q * q * q * (1.0 - 0.5 * q) + beyond),
    )


@compiled
def stage_pressure(step: StepNumbers, law: LawNumbers, point: Point, depth: float) -> tuple[float, float, float]:
    """Return pressure, slope and elastic part in the balance of a step that ends at a depth."""
    if step.form == ENDPOINT:
        pressure, slope, elastic = _endpoint(step, law, point, depth)
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
    if law.damper == UNDAMPED:
        return elastic, slope, elastic
    value, _, integral = damping(law, stiffness, point.coefficient, depth)
    pressure = elastic + (integral - damping(law, stiffness, point.coefficient, old)[2]) / step.dt
    slope += value / step.dt
    if not law.adhesive and pressure <= 0.0:
        return 0.0, 0.0, elastic
    return pressure, slope, elastic


@compiled
def _endpoint(step: StepNumbers, law: LawNumbers, point: Point, depth: float) -> tuple[float, float, float]:
    if depth <= 0.0:
        return 0.0, 0.0, 0.0
    elastic = spring_pressure(point.stiffness, law.exponent, depth)
    slope = spring_slope(point.stiffness, law.exponent, depth)
    if law.damper == UNDAMPED:
        return elastic, slope, elastic
    value, value_slope, _ = damping(law, point.stiffness, point.coefficient, depth)
    rate = point.guess_rate + step.rate_slope * (depth - point.guess_depth)
    bracket = elastic + value * rate
    slope = max(slope + value * step.rate_slope + value_slope * rate, 0.0)
    if not law.adhesive and bracket <= 0.0:
        bracket, slope = 0.0, 0.0
    if law.damper != CONSTANT:
        return bracket, slope, elastic
    share = min(depth / law.touch_depth, 1.0)
    share_slope = 1.0 / law.touch_depth if depth < law.touch_depth else 0.0
    return share * bracket, share * slope + share_slope * bracket, elastic
