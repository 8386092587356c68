"""Multipliers of a period of steps, by the damping of modes that the steps do not resolve.

Of a mode with M = 1, K = s and damping c, let w^2 = s and r = c / 2 + sqrt(c^2 / 4 - s), or c / 2. Where w h or r h is
large, the midpoint rule turns its velocity round in each step h, and nearly keeps its size: its multipliers lie near
the unit circle, however strong its damping is, and would hide those of the motion.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from gapbeam.solver.system.operators import Array

UNRESOLVED = 2.0  # change of a velocity in a step, over the velocity
MOSTLY = 0.5  # of the squares of the velocities of a disturbance
TINY = 1.0e-300


def unresolved_decay(squares: Array, damping: Array, step: float, period: float) -> Array:
    """Return factors by which velocities of modes that a step does not resolve decay in a period; 1 for others.

    Args:
        squares: s, (n,), 1/s^2.
        damping: c, (n,), 1/s.
        step: h, s.
        period: s.
    """
    half = 0.5 * damping
    rate = half + np.sqrt(np.maximum(half**2 - squares, 0.0))
    unresolved = np.maximum(rate, np.sqrt(np.maximum(squares, 0.0))) * step > UNRESOLVED
    return np.asarray(np.where(unresolved, np.exp(-rate * period), 1.0))


def resolved_multipliers(P: Array, decay: Array, step: float) -> Any:
    """Return the eigenvalues of the derivative of a map over a period, complex.

    Stable ones of disturbances that are mostly velocities of unresolved modes are as small as these decay.

    Args:
        P: Derivative of x = (q, v, others) after the period by that before.
        decay: Factors of `unresolved_decay`, (n,).
        step: s; velocities are meant that move q by more than q in it: slow creep of a damped mode is resolved.
    """
    values, vectors = np.linalg.eig(P)
    values, n = np.asarray(values, dtype=complex), len(decay)
    if np.any(decay < 1.0):
        q, v = np.split(np.abs(vectors[: 2 * n]) ** 2, 2)
        fast = np.where((decay < 1.0)[:, None] & (step**2 * v > q), v, 0.0)
        turned = (fast.sum(axis=0) > MOSTLY * v.sum(axis=0)) & (np.abs(values) < 1.0)
        limits = (decay @ fast)[turned] / fast.sum(axis=0)[turned]
        values[turned] *= np.minimum(limits / np.maximum(np.abs(values[turned]), TINY), 1.0)
    return values
