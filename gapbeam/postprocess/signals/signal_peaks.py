"""Extremes of a signal: overall and in every forcing period, with their times."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gapbeam.postprocess.signals.signal import Signal, SignalError

FloatArray = np.ndarray

_PHASE_SLACK = 1.0e-6


@dataclass(frozen=True)
class SignalPeaks:
    """Extremes of a signal over one span.

    Attributes:
        maximum: Largest value, in the unit of the signal.
        minimum: Smallest value.
        time_of_maximum: s, the first time it is met.
        time_of_minimum: s, the first time it is met.
    """

    maximum: float
    minimum: float
    time_of_maximum: float
    time_of_minimum: float

    @property
    def peak_to_peak(self) -> float:
        """Maximum minus minimum."""
        return self.maximum - self.minimum


@dataclass(frozen=True)
class PeriodPeaks:
    """Extremes in every whole forcing period.

    Attributes:
        period: Indices of the forcing periods, (k,); period j spans j/f <= t < (j+1)/f.
        start: (k,), s, where they start.
        maximum: (k,), in the unit of the signal.
        minimum: (k,).
        time_of_maximum: (k,), s.
        time_of_minimum: (k,), s.
    """

    period: np.ndarray
    start: FloatArray
    maximum: FloatArray
    minimum: FloatArray
    time_of_maximum: FloatArray
    time_of_minimum: FloatArray

    @property
    def peak_to_peak(self) -> FloatArray:
        """Maximum minus minimum of every period, (k,)."""
        return np.asarray(self.maximum - self.minimum)


def peaks(signal: Signal) -> SignalPeaks:
    """Find the extremes of a signal over its whole span.

    Sampled values as they are: nothing is interpolated between them.
    """
    high, low = int(np.argmax(signal.values)), int(np.argmin(signal.values))
    return SignalPeaks(
        maximum=float(signal.values[high]),
        minimum=float(signal.values[low]),
        time_of_maximum=float(signal.time[high]),
        time_of_minimum=float(signal.time[low]),
    )


def peaks_per_period(signal: Signal, forcing_frequency: float) -> PeriodPeaks:
    """Find the extremes in every whole forcing period, counted from t = 0.

    Args:
        signal: Evenly sampled, at least two values in a period.
        forcing_frequency: f in Hz.

    Raises:
        SignalError: Not one whole period, or fewer than two values in a period.
    """
    interval, period = signal.interval, 1.0 / forcing_frequency
    if interval > 0.5 * period:
        raise SignalError(f"{signal.name}: fewer than two values in a forcing period of {period:g} s")
    index = np.floor(signal.time / period + _PHASE_SLACK).astype(int)
    margin = max(interval, 0.5 * signal.width)
    first = int(np.ceil((signal.time[0] - margin) / period - _PHASE_SLACK))
    stop = int(np.floor((signal.time[-1] + margin) / period + _PHASE_SLACK))
    if stop <= first:
        raise SignalError(f"{signal.name}: {signal.duration:g} s hold no whole forcing period of {period:g} s")
    rows = [peaks(_part(signal, index == j)) for j in range(first, stop)]
    number = np.arange(first, stop)
    return PeriodPeaks(
        period=number,
        start=number * period,
        maximum=np.array([row.maximum for row in rows]),
        minimum=np.array([row.minimum for row in rows]),
        time_of_maximum=np.array([row.time_of_maximum for row in rows]),
        time_of_minimum=np.array([row.time_of_minimum for row in rows]),
    )


def _part(signal: Signal, keep: np.ndarray) -> Signal:
    return Signal(signal.time[keep], signal.values[keep], signal.unit, signal.name, signal.width)
