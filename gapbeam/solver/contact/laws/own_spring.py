"""An elastic pressure that a law brings, with its slope and its potential, where it is not K d^n.

The potential W is checked to be the integral of the pressure e over the penetration:

    W'(x) = e(x),    W(b) - W(a) = int_a^b e dx

W' is a central difference, by three steps: what they differ by is uncertain, by kinks of e or by round-off of W, which
may have no digits at small x. Between places that can be judged, the integral is Gauss's, over the whole and over its
halves: it finds jumps of W that no slope shows.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.system.operators import Array

_NODES, _TWICE = np.polynomial.legendre.leggauss(8)
SHARES, WEIGHTS = np.asarray(0.5 * (1.0 + _NODES)), np.asarray(0.5 * _TWICE)
STEPS = (1e-4, 2.7e-4, 1.9e-3)  # of the place
CERTAIN = 1e-3  # of the slope: by how much slopes of a place that is judged may differ
CAUTION = 4.0  # times what is uncertain: how far the functions may differ
Function = Callable[[Array], Array]
Flags = NDArray[np.bool_]


def compared(function: Function, whole: Function, places: Array, agreed: float) -> tuple[Flags, Flags]:
    """Return the places where W differs from the integral of e, and those that could be compared, (places, ...).

    The last place stands for itself; all others also for the interval to the next one.

    Args:
        function: e, of arrays.
        whole: W, likewise.
        places: x, ascending along the first axis.
        agreed: Share of the slope or of the integral by which they may differ.
    """
    value = function(places)
    near, *others = ((whole(x * (1.0 + s)) - whole(x * (1.0 - s))) / (2.0 * s * x) for x in [places] for s in STEPS)
    apart = np.maximum(*(np.abs(near - one) for one in others))
    judged = np.isfinite(value) & (apart <= CERTAIN * np.abs(near)) & ((near != 0.0) | (value == 0.0))
    differ = judged & ~(np.abs(near - value) <= agreed * np.abs(value) + CAUTION * apart)
    low, high = places[:-1], places[1:]
    middle = 0.5 * (low + high)
    found = _integral(function, low, middle) + _integral(function, middle, high)
    unsure = np.abs(found - _integral(function, low, high))
    noise = apart * STEPS[0] * places
    away = np.abs(whole(high) - whole(low) - found)
    both = judged[:-1] & judged[1:] & np.isfinite(away) & np.isfinite(unsure)
    differ[:-1] |= both & ~(away <= agreed * np.abs(found) + CAUTION * (unsure + noise[:-1] + noise[1:]))
    return differ, judged


def _integral(function: Function, low: Array, high: Array) -> Array:
    nodes = low + SHARES.reshape(-1, *([1] * low.ndim)) * (high - low)
    return np.asarray((high - low) * np.tensordot(WEIGHTS, function(nodes), 1))


AGREES = 1.0e-6  # of the largest value: how well potential, pressure and slope belong together


def check_spring(name: str, depth: float, function: Function, rise: Function, whole: Function) -> None:
    """Refuse functions of a spring that do not belong together, about a depth.

    Args:
        name: Name of the law.
        depth: Touch depth of the law, m.
        function: e(d) for penetrations d > 0, of arrays (..., 1).
        rise: e'(d), likewise.
        whole: psi(d) = int_0^d e, likewise.

    Raises:
        UserError: The potential is not the integral of the pressure, or the slope not its derivative, or the pressure
            falls, is negative, or is not 0 at touch.
    """
    high = depth * 2.0 ** np.arange(-8.0, 16.0)[:, None]
    low = 0.75 * high
    pressure = function(low + SHARES[:, None, None] * (high - low))
    largest = np.abs(pressure).max(axis=0)
    differs, stored = compared(function, whole, high, AGREES)
    rises_apart, risen = compared(rise, function, high, AGREES)
    at_touch = np.abs(function(1.0e-12 * high[:1])) + np.zeros_like(largest)
    wrong = {
        "a potential that is not the integral of the pressure": differs | ~np.any(stored, axis=0),
        "a slope that is not the derivative of the pressure": rises_apart | ~np.any(risen, axis=0),
        "a pressure that falls, or is negative": (pressure.min(axis=0) < 0.0) | (rise(high) < 0.0),
        "a pressure at touch": at_touch > AGREES * largest[-1],
    }
    for found, where in wrong.items():
        if np.any(where):
            place = float(high[int(np.argmax(np.any(where, axis=1))), 0])
            raise UserError(
                f"the law {name}: found {found}, near a penetration of {place:.3g} m; expected e(d) >= 0 that does "
                "not fall from e(0) = 0, e'(d), and psi(d) with psi' = e, for d > 0"
            )
