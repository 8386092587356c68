"""The moving average that takes the collision response out of a signal.

Li, Jin, Han, Cao and He (2013), section 4.2, smooth the measured acceleration by five points; their sampling rate is
not printed. What n points do depends on the rate, so the rate is part of the request here. Five points at 2000 Hz are
a mean over 2.5 ms, a twentieth of the forcing period of the paper, 50 ms: a mean over a twentieth of the forcing
period is the smoothed acceleration of any motion.
"""

from __future__ import annotations

import warnings
from dataclasses import replace
from typing import Literal

import numpy as np
import xarray as xr
from scipy.interpolate import make_interp_spline

from gapbeam.postprocess.signals.signal import Signal, SignalError, SignalWarning
from gapbeam.solver.record_table import SMOOTHING_WINDOW

Sampling = Literal["mean", "pick"]
FloatArray = np.ndarray

POINTS = 5  # as in the paper
SHARE = 0.05  # of the forcing period, or of the record without one

_EDGE = 1.0e-6
_FOLDED = 0.01


def smooth(signal: Signal, rate: float, points: int = POINTS, sampling: Sampling = "mean") -> Signal:
    """Sample a signal at a rate, then average over n points, centered.

    Args:
        signal: Evenly sampled, at `rate` or faster.
        rate: Sampling rate in Hz.
        points: n, number of points averaged.
        sampling: "mean": every sample is the mean over the sampling interval, so that the result is the mean
            over n/rate seconds; "pick": every sample is the value at its instant, as of a converter without
            filter.

    Returns:
        The smoothed signal at the sampling rate; shorter by n - 1 samples, each at the middle of its n.

    Raises:
        SignalError: The signal is too short or sampled more slowly than `rate`.
    """
    averaged = moving_average(resample(signal, rate, sampling), points)
    return replace(averaged, name=f"smoothed {signal.name}")


def window_of(history: xr.Dataset, frequency: float | None) -> float:
    """Return the time over which the smoothed acceleration of a history is a mean, s.

    That of its run; else a twentieth of the forcing period, or of the record without forcing.

    Args:
        history: The records of a run.
        frequency: Of the forcing, Hz; None: it has none.
    """
    if SMOOTHING_WINDOW in history.attrs:
        return float(history.attrs[SMOOTHING_WINDOW])
    time = history["time"].values
    return SHARE / frequency if frequency is not None else SHARE * float(time[-1] - time[0])


def smooth_over(signal: Signal, window: float) -> Signal:
    """Average a signal over a time: of at most five samples, each the mean over a fifth of it, as `smooth` does.

    Args:
        signal: Evenly sampled.
        window: s.

    Raises:
        SignalError: Fewer than two values in the window, or the signal is shorter.
    """
    points = min(POINTS, int(window / signal.interval + _EDGE))
    if points < 2:
        raise SignalError(
            f"{signal.name}: recorded at {1 / signal.interval:g} Hz, it cannot be averaged over {window:.3g} s; "
            "try output.smoothing_window, or a shorter output.history_interval"
        )
    return smooth(signal, points / window, points)


def resample(signal: Signal, rate: float, sampling: Sampling = "mean") -> Signal:
    """Sample a signal at a lower rate.

    "mean": sample j is the mean over j/rate <= t <= (j+1)/rate, placed at the middle: exact for the piecewise
    constant (interval means) or piecewise linear (instants) signal that the record describes. "pick": the
    value at the first time + j/rate, linear between the values of the record.

    Args:
        signal: Evenly sampled, at `rate` or faster.
        rate: Sampling rate in Hz.
        sampling: "mean" or "pick".

    Raises:
        SignalError: A rate that is not positive or above the signal's, or no whole sampling interval.

    Warns:
        SignalWarning: Picked samples of a signal that holds more than 1 % of its rms above rate/2.
    """
    interval = signal.interval
    if not rate > 0.0:
        raise SignalError(f"sampling rate {rate:g} Hz: it must be positive")
    if rate * interval > 1.0 + _EDGE:
        raise SignalError(
            f"{signal.name}: recorded at {1 / interval:g} Hz, it cannot be sampled at {rate:g} Hz; "
            "lower the rate or set output.history_interval"
        )
    if sampling == "pick":
        _warn_of_folding(signal, rate)
        count = int(np.floor((signal.time[-1] - signal.time[0]) * rate + _EDGE)) + 1
        time = signal.time[0] + np.arange(count) / rate
        return replace(signal, time=time, values=np.interp(time, signal.time, signal.values))
    held = abs(signal.width - interval) <= _EDGE * interval
    start = signal.time[0] - (0.5 * interval if held else 0.0)
    end = signal.time[-1] + (0.5 * interval if held else 0.0)
    edges = np.arange(np.ceil(start * rate - _EDGE), np.floor(end * rate + _EDGE) + 1) / rate
    if edges.size < 2:
        raise SignalError(f"{signal.name}: {end - start:g} s are shorter than one sample at {rate:g} Hz")
    integral = _integral_of_steps(signal, edges) if held else _integral_of_lines(signal, edges)
    width = 1.0 / rate + (0.0 if held else signal.width)
    return replace(signal, time=0.5 * (edges[1:] + edges[:-1]), values=np.diff(integral) * rate, width=width)


def moving_average(signal: Signal, points: int = POINTS) -> Signal:
    """Average over n consecutive values, placed at their middle: y_j = (x_j + ... + x_(j+n-1))/n.

    Args:
        signal: Evenly sampled.
        points: n >= 1.

    Raises:
        SignalError: Fewer than n values, or n < 1.
    """
    if points < 1:
        raise SignalError(f"a moving average over {points} points: at least one is needed")
    if signal.time.size < points:
        raise SignalError(f"{signal.name}: {signal.time.size} values are too few for {points} points")
    if points == 1:
        return signal
    weights = np.full(points, 1.0 / points)
    return replace(
        signal,
        time=np.convolve(signal.time, weights, mode="valid"),
        values=np.convolve(signal.values, weights, mode="valid"),
        width=signal.width + (points - 1) * signal.interval,
    )


def _integral_of_steps(signal: Signal, at: FloatArray) -> FloatArray:
    step = signal.interval
    edges = signal.time[0] + (np.arange(signal.time.size + 1) - 0.5) * step
    return np.asarray(np.interp(at, edges, np.concatenate([[0.0], np.cumsum(signal.values) * step])))


def _integral_of_lines(signal: Signal, at: FloatArray) -> FloatArray:
    integral = make_interp_spline(signal.time, signal.values, k=1).antiderivative()
    return np.asarray(integral(np.clip(at, signal.time[0], signal.time[-1])))


def _warn_of_folding(signal: Signal, rate: float) -> None:
    transform = np.fft.rfft((signal.values - signal.values.mean()) * np.hanning(signal.values.size))
    power = np.abs(transform) ** 2
    above = np.fft.rfftfreq(signal.values.size, signal.interval) > 0.5 * rate
    share = float(np.sqrt(power[above].sum() / power.sum())) if power.sum() > 0.0 else 0.0
    if share > _FOLDED:
        warnings.warn(
            f"{signal.name}: picked at {rate:g} Hz, {100 * share:.0f} % of the rms lie above {rate / 2:g} Hz "
            "and are folded into the band below; take the mean over the sampling interval, or a higher rate",
            SignalWarning,
            stacklevel=3,
        )
