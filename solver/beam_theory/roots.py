"""Roots of the frequency equation: the n-th for certain, for any end springs.

A spring that stiffens raises every root, and none beyond the next root of the beam without it (each is a positive
perturbation of rank one), so that

    lambda_n(0, s2) <= lambda_n(s1, s2) <= lambda_n(inf, s2) <= lambda_n+1(0, s2)

and likewise in s2. Between its neighbors lies the n-th root and no other, and the sign of the determinant is known on
either side of it, (-1)^(n-1) before and -(-1)^(n-1) after: bisection needs no value at the ends, where the root itself
may lie. It starts from the four limits, whose roots lie one to an interval between multiples of pi / 2.

Source: Courant and Hilbert (1953), VI.1, for the interlacing.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from solver.beam_theory.frequency_equation import EndSprings, determinant
from solver.operators import Array, Indices

MOST_HALVINGS = 80  # of an interval; it shrinks to neighboring numbers before that
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
    found = _limit_of(tuple(numbers.tolist()), draught, torsion, after, before)
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
    for _ in range(MOST_HALVINGS):
        middle = np.where(high > WIDE * low, np.sqrt(low) * np.sqrt(high), low + 0.5 * (high - low))
        if not np.any((low < middle) & (middle < high)):
            break
        below = before * determinant(middle, springs) > 0.0
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return np.asarray(0.5 * (low + high))
