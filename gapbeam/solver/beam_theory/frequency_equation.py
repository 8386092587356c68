"""The frequency equation of a beam on a draught spring and a torsion spring at one end, free at the other.

With xi = x / l in [0, 1], y'''' = lambda^4 y and the dimensionless springs s1 = k1 l^3 / E I, s2 = k2 l / E I, the
boundary conditions are

    y'''(0) + s1 y(0) = 0,    y''(0) - s2 y'(0) = 0,    y''(1) = y'''(1) = 0.

What satisfies those at the free end is y = A (cosh + cos)(lambda (1 - xi)) + B (sinh + sin)(lambda (1 - xi)); put
into those at the springs, its determinant is, up to a power of lambda,

    D = s1 s2 (1 + c C) - s1 lambda (s C - c S) - s2 lambda^3 (s C + c S) + lambda^4 (1 - c C)

with c, s, C, S = cos, sin, cosh, sinh of lambda: Eq. 9 of the paper times s1 s2. Divided by (1 + s1) (1 + s2) it holds
from 0 to infinity, both included. Each of its terms is an entire function of z = lambda^4, whose power series are free
of the cancellation that the formulas suffer from near 0; beyond that the formulas are scaled by exp(-lambda), which
leaves nothing to overflow.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import factorial

import numpy as np
from numpy.polynomial.polynomial import polyval
from numpy.typing import ArrayLike

from gapbeam.solver.system.operators import Array

SERIES_BELOW = 1.5  # of lambda
_TERMS = range(8)  # the ninth is below 1e-21 of the first at lambda = 1.5
# Of 1 + c C, lambda (s C - c S) / z, lambda^3 (s C + c S) / z and z (1 - c C) / z^2, in powers of z
_ONE_PLUS = [2.0, *((-4.0) ** k / factorial(4 * k) for k in _TERMS[1:])]
_DIFFERENCE = [-((-4.0) ** (k + 1)) / factorial(4 * k + 3) for k in _TERMS]
_SUM = [2.0 * (-4.0) ** k / factorial(4 * k + 1) for k in _TERMS]
_ONE_MINUS = [-((-4.0) ** (k + 1)) / factorial(4 * k + 4) for k in _TERMS]


@dataclass(frozen=True)
class EndSprings:
    """Dimensionless springs as shares s1 = held / loose, so that 0 and infinity are numbers like others.

    Attributes:
        held: s1 / (1 + s1), of any shape.
        loose: 1 / (1 + s1).
        clamped: s2 / (1 + s2), of the same shape.
        hinged: 1 / (1 + s2).
    """

    held: Array
    loose: Array
    clamped: Array
    hinged: Array

    @classmethod
    def of(cls, draught: ArrayLike, torsion: ArrayLike) -> EndSprings:
        """Return the shares of s1 = k1 l^3 / E I and s2 = k2 l / E I, each in [0, inf], broadcast to one shape.

        Raises:
            ValueError: A spring is negative or not a number.
        """
        first, second = np.broadcast_arrays(np.asarray(draught, dtype=float), np.asarray(torsion, dtype=float))
        if not (np.all(first >= 0.0) and np.all(second >= 0.0)):
            raise ValueError("an end spring is negative or not a number; expected 0 to infinity")
        return cls(*_shares(first), *_shares(second))

    @property
    def rigid_motions(self) -> Array:
        """How many roots are zero: one for each spring that is."""
        return np.asarray((self.held == 0.0).astype(int) + (self.clamped == 0.0))

    def below_lowest(self) -> Array:
        """Return a lower bound, near it where springs are soft, of the lowest lambda that is not zero.

        The zeros of D, and of D / z where a spring is zero, in z = lambda^4 are positive, and the sum of their inverses
        is -D'(0) / D(0) (Dunkerley); 0 where both springs are zero.
        """
        a1, b1, a2, b2 = self.held, self.loose, self.clamped, self.hinged
        at_zero = np.stack([a1 * a2 * _ONE_PLUS[0], a2 * b1 * _SUM[0], a1 * b2 * _DIFFERENCE[0]])
        slopes = np.stack(
            [
                a1 * b2 * _DIFFERENCE[0] + a2 * b1 * _SUM[0] - a1 * a2 * _ONE_PLUS[1],
                b1 * b2 * _ONE_MINUS[0] - a2 * b1 * _SUM[1],
                b1 * b2 * _ONE_MINUS[0] - a1 * b2 * _DIFFERENCE[1],
            ]
        )
        which = np.where(a1 == 0.0, 1, np.where(a2 == 0.0, 2, 0))[None]
        return np.asarray((np.take_along_axis(at_zero, which, 0) / np.take_along_axis(slopes, which, 0))[0] ** 0.25)


def _shares(spring: Array) -> tuple[Array, Array]:
    loose = 1.0 / (1.0 + spring)
    held = np.where(np.isinf(spring), 1.0, np.where(np.isinf(spring), 0.0, spring) * loose)
    return held, np.asarray(loose)


def determinant(root: Array, springs: EndSprings) -> Array:
    """Return D / ((1 + s1) (1 + s2)), for lambda >= 1.5 also times 2 exp(-lambda).

    Args:
        root: lambda >= 0, of the shape of the springs.
        springs: The springs.
    """
    a1, b1, a2, b2 = springs.held, springs.loose, springs.clamped, springs.hinged
    fourth = root**4
    decay = np.exp(-np.maximum(root, SERIES_BELOW))
    twice_cosh, twice_sinh = 1.0 + decay**2, 1.0 - decay**2
    cosine, sine = np.cos(root), np.sin(root)
    both, first = 2.0 * decay, cosine * twice_cosh
    result = (
        a1 * a2 * (both + first)
        - a1 * b2 * root * (sine * twice_cosh - cosine * twice_sinh)
        - b1 * a2 * root**3 * (sine * twice_cosh + cosine * twice_sinh)
        + b1 * b2 * fourth * (both - first)
    )
    small = root < SERIES_BELOW
    if np.any(small):
        z = np.where(small, fourth, 0.0)
        series = (
            a1 * a2 * polyval(z, _ONE_PLUS)
            - a1 * b2 * z * polyval(z, _DIFFERENCE)
            - b1 * a2 * z * polyval(z, _SUM)
            + b1 * b2 * z * z * polyval(z, _ONE_MINUS)
        )
        result = np.where(small, series, result)
    return np.asarray(result)
