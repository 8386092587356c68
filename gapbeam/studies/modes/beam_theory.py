"""Frequencies and mode shapes of a beam on end springs: the n-th root for certain, for any springs.

A spring that stiffens raises every root, and none beyond the next root of the beam without it (each is a positive
perturbation of rank one), so that

    lambda_n(0, s2) <= lambda_n(s1, s2) <= lambda_n(inf, s2) <= lambda_n+1(0, s2)

and likewise in s2. Between its neighbors lies the n-th root and no other, and the sign of the determinant is known on
either side of it, (-1)^(n-1) before and -(-1)^(n-1) after: bisection needs no value at the ends, where the root itself
may lie. Between halvings, secants hasten it, with halved weights of ends that stay (the Illinois rule). It starts from
the four limits, whose roots lie one to an interval between multiples of pi / 2.

Source: Courant and Hilbert (1953), VI.1, for the interlacing.

The beam stands on a translational and a rotational spring at one end and is free at the other. With xi = x / l in [0,
1], y'''' = lambda^4 y and the dimensionless springs s1 = k1 l^3 / E I, s2 = k2 l / E I, the boundary conditions are

    y'''(0) + s1 y(0) = 0,    y''(0) - s2 y'(0) = 0,    y''(1) = y'''(1) = 0.

What satisfies those at the free end is y = A (cosh + cos)(lambda (1 - xi)) + B (sinh + sin)(lambda (1 - xi)); put
into those at the springs, its determinant is, up to a power of lambda,

    D = s1 s2 (1 + c C) - s1 lambda (s C - c S) - s2 lambda^3 (s C + c S) + lambda^4 (1 - c C)

with c, s, C, S = cos, sin, cosh, sinh of lambda: Eq. 9 of the paper times s1 s2. Divided by (1 + s1) (1 + s2) it holds
from 0 to infinity, both included. Each of its terms is an entire function of z = lambda^4, whose power series are free
of the cancellation that the formulas suffer from near 0; beyond that the formulas are scaled by exp(-lambda), which
leaves nothing to overflow.

Mode shapes hold up to the thousandth. Two functions satisfy the equation and the conditions at the free end, with eta =
1 - xi: those of Krylov,

    sum_k z^k eta^(4k) / (4k)!,    sum_k z^k eta^(4k+1) / (4k+1)!,    z = lambda^4,

near z = 0, where they are the rigid motions, and beyond it two that stay below 3 however high the mode,

    exp(-lambda eta) + cos(lambda eta) - sin(lambda eta),
    exp(-lambda xi) + exp(-lambda) (cos(lambda eta) + sin(lambda eta)).

Their ratio follows from the better conditioned of the two conditions at the springs.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from math import factorial, pi, sqrt

import numpy as np
from numpy.polynomial.polynomial import polyval
from numpy.typing import ArrayLike

from gapbeam.solver.system.operators import Array, Indices

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
        """Number of roots that are zero: one for each spring that is."""
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


MOST_TRIALS = 250  # every third of them halves the interval, so that it shrinks to neighboring numbers before that
HALVED = 3
CLOSEST = 4.0  # units in the last place between the ends of an interval that is done
WIDE = 2.0  # ratio of the ends of an interval that is halved in the logarithm


def clamped_roots(modes: ArrayLike) -> Array:
    """Return the roots of 1 + cos x cosh x (Eq. 10), x_n in ((n - 1) pi, n pi); modes n = 1, 2, ... in any shape."""
    return _limit(modes, np.inf, np.inf, 1.0, 0.0)


def pinned_roots(modes: ArrayLike) -> Array:
    """Return the roots of tan x = tanh x, x_1 = 0 and x_n in ((n - 1) pi, (n - 1/2) pi)."""
    return _limit(modes, np.inf, 0.0, 1.0, 0.5)


def sliding_roots(modes: ArrayLike) -> Array:
    """Return the roots of tan x = -tanh x, x_1 = 0 and x_n in ((n - 3/2) pi, (n - 1) pi)."""
    return _limit(modes, 0.0, np.inf, 1.5, 1.0)


def free_roots(modes: ArrayLike) -> Array:
    """Return the roots of 1 - cos x cosh x (Eq. 11), x_1 = x_2 = 0 and x_n in ((n - 2) pi, (n - 1) pi)."""
    return _limit(modes, 0.0, 0.0, 2.0, 1.0)


def roots(modes: ArrayLike, draught: ArrayLike, torsion: ArrayLike) -> Array:
    """Return lambda_n of a beam on end springs, to round-off.

    Args:
        modes: n = 1, 2, ..., of any shape that broadcasts with the springs.
        draught: s1 = k1 l^3 / E I, from 0 to infinity, both included.
        torsion: s2 = k2 l / E I, likewise.

    Returns:
        lambda_n, of the shape that all broadcast to; 0 for the rigid motions that springs of 0 leave.

    Raises:
        ValueError: A mode is not a positive integer, or a spring is negative or not a number.
    """
    numbers, first, second = np.broadcast_arrays(
        _numbers(modes), np.asarray(draught, float), np.asarray(torsion, float)
    )
    springs = EndSprings.of(first, second)
    low = _between(numbers, EndSprings.of(0.0 * numbers, second), free_roots(numbers), sliding_roots(numbers))
    held = EndSprings.of(np.full(numbers.shape, np.inf), second)
    high = _between(numbers, held, pinned_roots(numbers), clamped_roots(numbers))
    return _between(numbers, springs, low, high)


def _numbers(modes: ArrayLike) -> Indices:
    numbers = np.asarray(modes)
    if not np.issubdtype(numbers.dtype, np.integer) or np.any(numbers < 1):
        raise ValueError("a mode is not a positive integer")
    return numbers


def _limit(modes: ArrayLike, draught: float, torsion: float, after: float, before: float) -> Array:
    """Return the roots for springs of 0 or infinity, x_n in ((n - after) pi, (n - before) pi)."""
    numbers, position = np.unique(_numbers(modes), return_inverse=True)
    found = _limit_of(tuple(int(number) for number in numbers), draught, torsion, after, before)
    return found[position].reshape(np.shape(modes))


@cache
def _limit_of(modes: tuple[int, ...], draught: float, torsion: float, after: float, before: float) -> Array:
    numbers = np.array(modes)
    low, high = (np.maximum(numbers - shift, 0.0) * np.pi for shift in (after, before))
    return _between(numbers, EndSprings.of(np.full(numbers.shape, draught), torsion), low, high)


def _between(numbers: Indices, springs: EndSprings, low: Array, high: Array) -> Array:
    """Return the root of D between two ends that hold no other."""
    moving = numbers > springs.rigid_motions
    lowest = moving & (low == 0.0)
    low = np.where(lowest, np.where(lowest, springs.below_lowest(), 0.0), np.where(moving, low, 0.0))
    high = np.where(moving, high, 0.0)
    before = np.where(numbers % 2 == 1, 1.0, -1.0)
    at_low, at_high = np.full(numbers.shape, np.nan), np.full(numbers.shape, np.nan)
    was_below = np.zeros(numbers.shape, dtype=bool)
    for trial in range(MOST_TRIALS):
        closest = CLOSEST * np.spacing(high)
        if np.all(high - low <= closest):
            break
        place = np.where(high > WIDE * low, np.sqrt(low) * np.sqrt(high), low + 0.5 * (high - low))
        if trial % HALVED != 0:
            with np.errstate(invalid="ignore", divide="ignore"):
                secant = low + (high - low) * (at_low / (at_low - at_high))
            secant = np.clip(secant, low + 0.5 * closest, high - 0.5 * closest)
            place = np.where(np.isnan(secant) | (high > WIDE * low), place, secant)
        value = before * determinant(place, springs)
        below = value > 0.0
        low, high = np.where(below, place, low), np.where(below, high, place)
        weaker = np.where(below == was_below, 0.5, 1.0)
        at_low, at_high = np.where(below, value, weaker * at_low), np.where(below, weaker * at_high, value)
        was_below = below
    return np.asarray(0.5 * (low + high))


_SPRING_BEAM_TERMS = 7
_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(24)  # for z < 5 exact to round-off


@dataclass(frozen=True)
class ModeShape:
    """y(xi) with the integral of y^2 over [0, 1] equal to 1 and y(1) > 0.

    Attributes:
        root: lambda_n.
        weights: Weights of the two functions.
    """

    root: float
    weights: tuple[float, float]

    def __call__(self, xi: Array, derivative: int = 0) -> Array:
        """Return a derivative of y with respect to xi, 0 to 3, at places xi in [0, 1], 0 at the springs."""
        first, second = _functions(self.root, np.asarray(xi, dtype=float), derivative)
        return np.asarray(self.weights[0] * first + self.weights[1] * second)


def mode_shape(mode: int, draught: float, torsion: float, root: float | None = None) -> ModeShape:
    """Return the shape of mode n.

    Args:
        mode: n >= 1.
        draught: s1 = k1 l^3 / E I in [0, inf].
        torsion: s2 = k2 l / E I in [0, inf].
        root: lambda_n, where it is known already.

    Returns:
        The shape. The free beam has two rigid motions: its mode 1 is the translation, mode 2 turns about the middle.

    Raises:
        ValueError: The mode is not a positive integer, or a spring is negative or not a number.
    """
    root = float(roots(mode, draught, torsion)) if root is None else root
    springs = EndSprings.of(draught, torsion)
    if mode <= 2 and int(springs.rigid_motions) == 2:
        return ModeShape(root, (1.0, 0.0) if mode == 1 else (sqrt(3.0), -2.0 * sqrt(3.0)))
    at_springs = np.array([[float(each) for each in _functions(root, np.array(0.0), order)] for order in range(4)])
    rows = [
        float(springs.loose) * at_springs[3] + float(springs.held) * at_springs[0],
        float(springs.hinged) * at_springs[2] - float(springs.clamped) * at_springs[1],
    ]
    sizes = (
        float(springs.loose) * np.abs(at_springs[3]).max() + float(springs.held) * np.abs(at_springs[0]).max(),
        float(springs.hinged) * np.abs(at_springs[2]).max() + float(springs.clamped) * np.abs(at_springs[1]).max(),
    )
    conditioning = [np.linalg.norm(row) / size if size > 0.0 else 0.0 for row, size in zip(rows, sizes, strict=True)]
    row = rows[int(np.argmax(conditioning))]
    raw = ModeShape(root, (float(-row[1]), float(row[0])))
    scale = 1.0 / sqrt(_square_integral(raw))
    if raw(np.array(1.0)) < 0.0:
        scale = -scale
    return ModeShape(root, (scale * raw.weights[0], scale * raw.weights[1]))


def _square_integral(shape: ModeShape) -> float:
    """Return the integral of y^2: 4 z int y^2 = [3 y y''' - y' y'' + xi (z y^2 - 2 y' y''' + y''^2)] from 0 to 1."""
    if shape.root < SERIES_BELOW:
        return float(0.5 * _WEIGHTS @ shape(0.5 * (1.0 + _POINTS)) ** 2)
    y, slope, moment, shear = (float(shape(np.array(0.0), order)) for order in range(4))
    end = float(shape(np.array(1.0)))
    return 0.25 * (end * end - (3.0 * y * shear - slope * moment) / shape.root**4)


def _functions(root: float, xi: Array, derivative: int) -> tuple[Array, Array]:
    """Return a derivative of both functions at places."""
    if root < SERIES_BELOW:
        return _krylov(root**4, 1.0 - xi, derivative, 0), _krylov(root**4, 1.0 - xi, derivative, 1)
    angle = root * (1.0 - xi)
    less, more = np.cos(angle) - np.sin(angle), np.cos(angle) + np.sin(angle)
    waves = [(less, more), (more, -less), (-less, -more), (-more, less)][derivative]
    first = np.exp(-angle) + waves[0]
    second = (-1.0) ** derivative * np.exp(-root * xi) + np.exp(-root) * waves[1]
    return root**derivative * first, root**derivative * second


def _krylov(z: float, eta: Array, derivative: int, power: int) -> Array:
    """Return a derivative with respect to xi = 1 - eta of sum_k z^k eta^(4k + power) / (4k + power)!."""
    total = np.zeros_like(eta)
    for k in range(_SPRING_BEAM_TERMS):
        left = 4 * k + power - derivative
        if left >= 0:
            total += z**k * eta**left / factorial(left)
    return (-1.0) ** derivative * total


@dataclass(frozen=True)
class SpringBeam:
    """An Euler-Bernoulli beam; f_n = lambda_n^2 / (2 pi l^2) sqrt(E I / rho A).

    Attributes:
        length: l, m.
        bending: E I, N m^2.
        mass: rho A, kg/m.
    """

    length: float
    bending: float
    mass: float

    @property
    def draught_unit(self) -> float:
        """E I / l^3, N/m: k1 = s1 times that."""
        return self.bending / self.length**3

    @property
    def torsion_unit(self) -> float:
        """E I / l, N m/rad: k2 = s2 times that."""
        return self.bending / self.length

    @property
    def frequency_unit(self) -> float:
        """sqrt(E I / rho A) / (2 pi l^2), Hz: f = lambda^2 times that."""
        return sqrt(self.bending / self.mass) / (2.0 * pi * self.length**2)

    def roots(self, modes: ArrayLike, draught: ArrayLike, torsion: ArrayLike) -> Array:
        """Return lambda_n for springs k1 (N/m) and k2 (N m/rad), all of shapes that broadcast; see `roots`."""
        return roots(modes, np.asarray(draught) / self.draught_unit, np.asarray(torsion) / self.torsion_unit)

    def frequencies(self, modes: ArrayLike, draught: ArrayLike, torsion: ArrayLike) -> Array:
        """Return f_n, Hz, for springs k1 (N/m) and k2 (N m/rad), all of shapes that broadcast; see `roots`."""
        return np.asarray(self.frequency_unit * self.roots(modes, draught, torsion) ** 2)

    def shape(self, mode: int, draught: float, torsion: float) -> ModeShape:
        """Return the shape of mode n over xi = x / l, x from the springs; see `mode_shape`."""
        return mode_shape(mode, draught / self.draught_unit, torsion / self.torsion_unit)

    def sensitivities(self, modes: ArrayLike, draught: float, torsion: float, known: Array | None = None) -> Array:
        """Return d ln f_n / d (ln k1, ln k2), (modes, 2).

        A root moves as its shape moves the spring: d lambda^4 / d s1 = y(0)^2, d lambda^4 / d s2 = y'(0)^2, with y
        normalized. So an entry is half of the spring's share of the elastic energy, and both together are at most 1/2.

        Args:
            modes: Numbers n, (modes,).
            draught: k1, N/m, finite.
            torsion: k2, N m/rad, finite.
            known: lambda_n, (modes,), where they are known already.
        """
        numbers = np.atleast_1d(modes)
        springs = draught / self.draught_unit, torsion / self.torsion_unit
        found = np.zeros((len(numbers), 2))
        for row, root in enumerate(roots(numbers, *springs) if known is None else known):
            shape = mode_shape(int(numbers[row]), *springs, float(root))
            y, slope, moment, shear = (float(shape(np.array(0.0), order)) for order in range(4))
            if shape.root > 0.0:  # s1 y(0)^2 = -y y''', s2 y'(0)^2 = y' y''
                found[row] = 0.5 * np.array([-y * shear, slope * moment]) / shape.root**4
        return found
