"""Stationarity of the part of a response that does not repeat: it neither fades, as ringing does, nor grows.

The rest of a forcing period is what differs from the period before it. A chaotic response has rests of all sizes in no
order; what rings has smaller and smaller ones. Kendall's rank correlation of their sizes with time decides: batches of
periods in the second half of the record, compared by pairs.

Source: Kendall (1938), Biometrika 30, 81, for tau and its variance 2 (2 k + 5) / (9 k (k - 1)) without a trend.
"""

from __future__ import annotations

from enum import Enum

import numpy as np

FloatArray = np.ndarray

BATCHES = 20  # with fewer, ringing of a few long beats passes for no order
TREND = 0.6  # of tau; 3.7 standard deviations without a trend, 1 % false alarms on stationary rattling


class Rest(Enum):
    """Verdict on the part that does not repeat."""

    STATIONARY = "stationary"
    CHANGING = "changing"
    SHORT = "short"


def rest_of(waves: FloatArray) -> Rest:
    """Return whether the rests of the second half of a record have a trend.

    Args:
        waves: Values by forcing period, (periods, values in a period, signals).
    """
    steps = np.diff(waves, axis=0)[-(len(waves) // 2) :]
    scale = np.maximum(np.ptp(waves, axis=(0, 1)), np.finfo(float).tiny)
    sizes = np.mean((steps / scale) ** 2, axis=(1, 2))
    length = len(sizes) // BATCHES
    if length == 0:
        return Rest.SHORT
    batches = sizes[-BATCHES * length :].reshape(BATCHES, length).mean(axis=1)
    return Rest.CHANGING if abs(kendall(batches)) > TREND else Rest.STATIONARY


def kendall(values: FloatArray) -> float:
    """Return Kendall's rank correlation of values, (k,), with their order, -1 to 1."""
    order = np.sign(values[None, :] - values[:, None])
    return float(order[np.triu_indices(len(values), 1)].mean())
