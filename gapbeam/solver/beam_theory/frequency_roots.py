"""Roots of the frequency equation: the n-th for certain, for any end springs.

A spring that stiffens raises every root, and none beyond the next root of the beam without it (each is a positive
perturbation of rank one), so that

    lambda_n(0, s2) <= lambda_n(s1, s2) <= lambda_n(inf, s2) <= lambda_n+1(0, s2)

and likewise in s2. Between its neighbors lies the n-th root and no other, and the sign of the determinant is known on
either side of it, (-1)^(n-1) before and -(-1)^(n-1) after: bisection needs no value at the ends, where the root itself
may lie. Between halvings, secants hasten it, with halved weights of ends that stay (the Illinois rule). It starts from
the four limits, whose roots lie one to an interval between multiples of pi / 2.

Source: Courant and Hilbert (1953), VI.1, for the interlacing.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from gapbeam.solver.beam_theory.frequency_equation import EndSprings, determinant
from gapbeam.solver.system.operators import Array, Indices

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
