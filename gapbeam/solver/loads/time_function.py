"""The function of time s of a load, and its mean over intervals."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.system_load import Alike


@dataclass(frozen=True)
class TimeFunction:
    """A function of time.

    Attributes:
        value: s at a time, or at each of an array of times.
        mean: Mean of s over intervals from starts, (times,), to ends, (times,).
        rate: Derivative of s, where s moves a wall.
        signal: Computes s together with others of its kind; None: s is computed by itself.
    """

    value: Callable[[Any], Any]
    mean: Callable[[Array, Array], Array]
    rate: Callable[[Any], Any] | None = None
    signal: Alike | None = None


def constant(value: float) -> TimeFunction:
    """Return the function that has one value at all times."""
    return TimeFunction(lambda _time: value, lambda starts, _ends: np.full(np.shape(starts), value))


def smooth(value: Callable[[Any], Any], rate: Callable[[Any], Any] | None = None) -> TimeFunction:
    """Return a function that polynomials follow well over a step; its mean is found by quadrature.

    Args:
        value: s at a time, or at each of an array of times.
        rate: Its derivative, where it moves a wall.
    """
    return TimeFunction(value, partial(quadrature_mean, value), rate)


def quadrature_mean(value: Callable[[Any], Any], start: Any, end: Any) -> Any:
    """Return the mean over an interval, or each of many; by Gauss-Legendre quadrature, exact on short ones."""
    half, middle = 0.5 * (end - start), 0.5 * (end + start)
    values: list[Any] = [value(middle + half * x) for x in _NODES]
    return sum(0.5 * w * value for w, value in zip(_WEIGHTS, values, strict=True))


def piecewise_mean(value: Callable[[Array], Array], knots: Array, starts: Array, ends: Array) -> Array:
    """Return the mean over intervals of a function that is smooth between knots; exact up to degree 9 there, (times,).

    Args:
        value: s at each of an array of times.
        knots: Where s goes from one smooth piece to the next, s; those outside of the intervals do not count.
        starts: (times,), s.
        ends: (times,), s, none before its start.
    """
    inside = (knots > np.min(starts)) & (knots < np.max(ends))
    edges = np.unique(np.concatenate([starts, ends, knots[inside]]))
    half, middle = 0.5 * np.diff(edges), 0.5 * (edges[1:] + edges[:-1])
    parts = np.zeros(len(half) + 1)
    for node, weight in zip(*_FIVE, strict=True):
        parts[:-1] += weight * half * value(np.asarray(middle + half * node))
    # a sum for each interval by itself: the same bits wherever a run is interrupted
    places = np.stack([np.searchsorted(edges, starts), np.searchsorted(edges, ends)], axis=1)
    gained, spans = np.add.reduceat(parts, places.ravel())[::2], ends - starts
    at_starts = value(np.asarray(starts, dtype=float))
    return np.asarray(np.divide(gained, spans, out=at_starts, where=spans > 0.0))


_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(6)
_FIVE = np.polynomial.legendre.leggauss(5)
