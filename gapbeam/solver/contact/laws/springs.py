"""The elastic part of a contact law, per area: p = K d^n for d > 0, at one point."""

from __future__ import annotations

from dataclasses import dataclass
from math import frexp, prod

import numpy as np

from gapbeam.solver.compilation.jit import compiled_in_order
from gapbeam.solver.system.operators import Array

FAR_APART = 1.0e-3  # of the depth: beyond it the difference quotient of the potential is exact enough
_NODES, _TWICE = np.polynomial.legendre.leggauss(4)
SHARES, WEIGHTS = np.asarray(0.5 * (1.0 + _NODES)), np.asarray(0.5 * _TWICE)  # between two depths that are close


@dataclass(frozen=True)
class Spring:
    """K d^n, with K > 0 (Pa/m^n) and n >= 1, or K f(d) by the formula of a law.

    Attributes:
        stiffness: K, Pa/m^n, one number or one per point, (m,).
        exponent: n; 1 is linear, 1.5 that of Hertz.
        law: Name of the law in a case file whose formula f is; empty: K d^n.
        parameters: Parameters of that formula, at most `damper.ROOM` numbers.
    """

    stiffness: float | Array
    exponent: float = 1.0
    law: str = ""
    parameters: tuple[float, ...] = ()


def rows_of(depth: Array) -> Array:
    """Return depths (..., m) as rows, (r, m)."""
    *rows, size = depth.shape
    return np.ascontiguousarray(depth, dtype=float).reshape(prod(rows), size)


def at_points(value: float | Array, size: int) -> Array:
    """Return a value of all points, or one of each, as (m,) for m = `size` points."""
    return np.zeros(size) + value


@compiled_in_order
def power(base: float, exponent: float) -> float:
    """Return base^exponent of a base > 0, whose digits are the same for a base that is a power of four times as large.

    A library takes the power by logarithms, and rounds it otherwise at another size. Contact on a nearly free beam
    multiplies such a last digit by the condition of the stiffness matrix.
    """
    mantissa, twos = frexp(base)  # base = mantissa 2^twos
    if twos % 2 != 0:
        mantissa, twos = 2.0 * mantissa, twos - 1
    return float(mantissa**exponent * 2.0 ** (twos * exponent))


@compiled_in_order
def spring_pressure(stiffness: float, exponent: float, depth: float) -> float:
    """Return K <d>^n."""
    if depth <= 0.0:
        return 0.0
    return stiffness * (depth if exponent == 1.0 else power(depth, exponent))


@compiled_in_order
def spring_slope(stiffness: float, exponent: float, depth: float) -> float:
    """Return n K <d>^(n-1), 0 for d <= 0."""
    if depth <= 0.0:
        return 0.0
    return stiffness if exponent == 1.0 else exponent * stiffness * power(depth, exponent - 1.0)


@compiled_in_order
def spring_potential(stiffness: float, exponent: float, depth: float) -> float:
    """Return K <d>^(n+1) / (n+1)."""
    if depth <= 0.0:
        return 0.0
    above = exponent + 1.0
    return stiffness / above * (depth * depth if exponent == 1.0 else power(depth, above))


@compiled_in_order
def spring_mean(stiffness: float, exponent: float, old: float, new: float) -> tuple[float, float]:
    """Return the discrete gradient of the potential between two depths, and its slope in the second.

    Both are written without cancellation: exactly for n = 1, by Gauss-Legendre quadrature of K d^n between two close
    depths otherwise. Ratios come first: squares of tiny depths would underflow.
    """
    if old <= 0.0 and new <= 0.0:
        return 0.0, 0.0
    if exponent == 1.0:
        half = 0.5 * stiffness
        if old > 0.0 and new > 0.0:
            return half * (new + old), half
        if new > 0.0:
            share = new / (new - old)
            return half * (new * share), half * share * ((new - 2.0 * old) / (new - old))
        share = old / (old - new)
        return half * (old * share), half * (share * share)
    apart = new - old
    if abs(apart) <= FAR_APART * max(abs(old), abs(new)):
        mean, slope = 0.0, 0.0
        for share, weight in zip(SHARES, WEIGHTS):  # noqa: B905 - compiled code knows no strict
            between = old + share * apart
            mean += weight * spring_pressure(stiffness, exponent, between)
            slope += weight * share * spring_slope(stiffness, exponent, between)
        return mean, slope
    mean = (spring_potential(stiffness, exponent, new) - spring_potential(stiffness, exponent, old)) / apart
    return mean, max((spring_pressure(stiffness, exponent, new) - mean) / apart, 0.0)
