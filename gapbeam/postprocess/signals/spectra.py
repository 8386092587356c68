"""Amplitude spectra over a whole number of forcing periods, and tables of their harmonics and subharmonics.

A moving average takes the collision response out of a signal.

Li, Jin, Han, Cao and He (2013), section 4.2, smooth the measured acceleration by five points; their sampling rate is
not printed. What n points do depends on the rate, so the rate is part of the request here. Five points at 2000 Hz are
a mean over 2.5 ms, a twentieth of the forcing period of the paper, 50 ms: a mean over a twentieth of the forcing
period is the smoothed acceleration of any motion.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import TYPE_CHECKING, Literal

import numpy as np
import scipy

from gapbeam.postprocess.signals.signal import Signal, SignalError, SignalWarning
from gapbeam.solver.messages.wording import counted
from gapbeam.solver.schema.record_table import SMOOTHING_WINDOW

if TYPE_CHECKING:
    import xarray as xr

Window = Literal["rectangular", "hann", "flattop", "blackman"]

# Twelve periods hold a whole number of cycles of period 1, 2, 3, 4, 6 and 12.
CYCLE = 12

_WHOLE = 1.0e-6
# Fraction of a period by which a span may be short: half a sampling interval at its ends.
_SLACK = 0.02
_TOP = 0.9
_ALIASED = 0.01
_SCIPY = {"rectangular": "boxcar"}


@dataclass(frozen=True)
class Spectrum:
    """Amplitudes over frequency: a sine of amplitude A on a line shows A, with any window.

    Attributes:
        frequency: (k,), Hz, from 0 to half the sampling rate.
        amplitude: (k,), >= 0, in the unit of the signal; at 0 Hz the absolute mean.
        phase: (k,), rad, of x = A sin(2 pi f t + phase), t as in the record.
        window: Window that weighted the span.
        periods: Whole forcing periods in the span; None where the forcing has no period.
        start: s, where the span starts.
        end: s, where it ends.
    """

    frequency: np.ndarray
    amplitude: np.ndarray
    phase: np.ndarray
    window: str
    periods: int | None
    start: float
    end: float


def spectrum(
    signal: Signal,
    forcing_frequency: float | None,
    periods: int | None = None,
    window: Window | None = None,
    after: float = -np.inf,
) -> Spectrum:
    """Transform the last whole forcing periods of a signal.

    A_k = 2 |sum_n w_n (x_n - mean) exp(-2 pi i k n/N)| / sum_n w_n   (half of it at half the sampling rate)

    Args:
        signal: Evenly sampled. Means over an interval h show lines times |sin(pi f h)/(pi f h)|.
        forcing_frequency: Hz; None takes the whole record, without periods.
        periods: Number of last periods; by default `default_periods` of what follows `after`.
        window: Default rectangular over whole periods, hann without.
        after: s, where the transient ends; -inf where that is not known.

    Raises:
        SignalError: Fewer than one period or eight values, or more periods than there are.

    Warns:
        SignalWarning: Too short for subharmonics, periods that are no whole number of intervals, content near
            half the sampling rate.

    Source: Harris (1978), Proc. IEEE 66, 51, for the windows and their coherent gain.
    """
    notes: list[str] = []
    if forcing_frequency is None:
        span, count = signal, None
        notes.append(f"{signal.name}: no forcing period; the span is no whole number of periods and lines leak")
    else:
        span, count = _whole_periods(signal, forcing_frequency, periods, after, notes)
    size, interval = span.time.size, span.interval
    if size < 8:
        raise SignalError(f"{signal.name}: {size} values in the span are too few for a spectrum")
    name = window or ("hann" if count is None else "rectangular")
    weights = scipy.signal.get_window(_SCIPY.get(name, name), size, fftbins=True)
    mean = float(span.values.mean())
    transform = np.fft.rfft(weights * (span.values - mean)) * (2.0 / weights.sum())
    frequency = np.fft.rfftfreq(size, interval)
    transform[0] = mean
    if size % 2 == 0:
        transform[-1] *= 0.5
    amplitude = np.abs(transform)
    phase = np.angle(transform * np.exp(-2j * np.pi * frequency * span.time[0]) * 1j)
    _note_aliasing(signal, frequency, amplitude, notes)
    for note in notes:
        warnings.warn(note, SignalWarning, stacklevel=2)
    return Spectrum(
        frequency=frequency,
        amplitude=amplitude,
        phase=phase,
        window=name,
        periods=count,
        start=float(span.time[-1]) + 0.5 * interval - size * interval,
        end=float(span.time[-1]) + 0.5 * interval,
    )


def whole_periods(signal: Signal, forcing_frequency: float) -> int:
    """Count the whole forcing periods that a signal lasts."""
    return int(np.floor(signal.duration * forcing_frequency + _WHOLE))


def default_periods(signal: Signal, forcing_frequency: float, after: float = -np.inf) -> int:
    """Choose the number of periods for a spectrum.

    The most of 12, 24, 36, ... that follow `after`; where 12 do not, the most of 12, 6 or, failing that, all
    whole periods of the whole signal.
    """
    settled, available = _since(signal, forcing_frequency, after), whole_periods(signal, forcing_frequency)
    if settled >= CYCLE:
        return settled // CYCLE * CYCLE
    return next((count for count in (CYCLE, CYCLE // 2) if available >= count), available)


def _whole_periods(
    signal: Signal, forcing_frequency: float, periods: int | None, after: float, notes: list[str]
) -> tuple[Signal, int]:
    """Cut the last whole periods out, sampled a whole number of times."""
    available = whole_periods(signal, forcing_frequency)
    if available < 1 or (periods is not None and not 1 <= periods <= available):
        raise SignalError(
            f"{signal.name}: {signal.duration:g} s hold {counted(available, 'whole forcing period')} of "
            f"{1 / forcing_frequency:g} s, asked for {periods or 'one at least'}"
        )
    periods = periods or default_periods(signal, forcing_frequency, after)
    if periods > _since(signal, forcing_frequency, after):
        notes.append(
            f"{signal.name}: the last {counted(periods, 'forcing period')} begin before {after:.4g} s: "
            "the spectrum holds some of the transient; run longer"
        )
    if periods % 6:
        notes.append(
            f"{signal.name}: {counted(periods, 'period')}, no multiple of 6: subharmonics 1/2 or 1/3 fall between lines"
        )
    exact = periods / (forcing_frequency * signal.interval)
    size = round(exact)
    if abs(exact - size) <= _WHOLE * max(1.0, 1e-3 * size):
        return Signal(signal.time[-size:], signal.values[-size:], signal.unit, signal.name, signal.width), periods
    notes.append(
        f"{signal.name}: {counted(periods, 'forcing period')} are {exact:.3f} sampling intervals; "
        "interpolated by a cubic spline to a whole number (choose a step that divides the period)"
    )
    if size < 8:
        raise SignalError(f"{signal.name}: {size} values in {periods} periods are too few for a spectrum")
    step = periods / forcing_frequency / size
    time = signal.time[-1] - step * np.arange(size - 1, -1, -1)
    time = time + max(0.0, float(signal.time[0] - time[0]))
    values = scipy.interpolate.CubicSpline(signal.time, signal.values)(time)
    return Signal(time, values, signal.unit, signal.name, signal.width), periods


def _since(signal: Signal, forcing_frequency: float, after: float) -> int:
    """Whole forcing periods of a signal since a time."""
    left = signal.duration - max(0.0, after - float(signal.time[0]))
    return min(int(np.floor(left * forcing_frequency + _SLACK)), whole_periods(signal, forcing_frequency))


def _note_aliasing(signal: Signal, frequency: np.ndarray, amplitude: np.ndarray, notes: list[str]) -> None:
    top = amplitude[frequency >= _TOP * frequency[-1]].max()
    largest = amplitude[1:].max()
    if largest > 0.0 and top > _ALIASED * largest:
        notes.append(
            f"{signal.name}: lines of {100 * top / largest:.2g} % of the largest near half the sampling rate "
            f"({frequency[-1]:g} Hz): content above it is folded in; sample more often"
        )


SUBHARMONICS = (Fraction(1, 3), Fraction(1, 2))


@dataclass(frozen=True)
class HarmonicLine:
    """One line of the table.

    Attributes:
        order: Frequency over forcing frequency.
        frequency: Hz.
        amplitude: Amplitude in the unit of the spectrum.
        phase: rad, of amplitude * sin(2 pi f t + phase).
    """

    order: Fraction
    frequency: float
    amplitude: float
    phase: float


def harmonics(spectrum: Spectrum, highest: int = 10) -> tuple[HarmonicLine, ...]:
    """Read the subharmonics 1/3 and 1/2 and the harmonics 1 to n of the forcing.

    Orders that fall between the lines of the spectrum or above half the sampling rate are left out.

    Args:
        spectrum: Spectrum over a whole number of forcing periods.
        highest: n.

    Raises:
        SignalError: The spectrum has no forcing periods.
    """
    if spectrum.periods is None:
        raise SignalError("no harmonics without a forcing period")
    rows = []
    for order in (*SUBHARMONICS, *(Fraction(n) for n in range(1, highest + 1))):
        line = order * spectrum.periods
        if line.denominator == 1 and line < spectrum.frequency.size:
            k = int(line)
            rows.append(
                HarmonicLine(
                    order,
                    float(spectrum.frequency[k]),
                    float(spectrum.amplitude[k]),
                    float(spectrum.phase[k]),
                )
            )
    return tuple(rows)


def distortion(table: tuple[HarmonicLine, ...]) -> float:
    """Root of the sum of squares of the higher harmonics over the first; inf where the first is 0."""
    first = sum(row.amplitude for row in table if row.order == 1)
    higher = float(np.sqrt(sum(row.amplitude**2 for row in table if row.order > 1)))
    return higher / first if first > 0.0 else float("inf")


Sampling = Literal["mean", "pick"]

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
        frequency: Frequency of the forcing, Hz; None: it has none.
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


def _integral_of_steps(signal: Signal, at: np.ndarray) -> np.ndarray:
    step = signal.interval
    edges = signal.time[0] + (np.arange(signal.time.size + 1) - 0.5) * step
    return np.asarray(np.interp(at, edges, np.concatenate([[0.0], np.cumsum(signal.values) * step])))


def _integral_of_lines(signal: Signal, at: np.ndarray) -> np.ndarray:
    integral = scipy.interpolate.make_interp_spline(signal.time, signal.values, k=1).antiderivative()
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
