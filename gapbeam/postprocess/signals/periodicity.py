"""Poincaré section and period of a forced response.

The response is cut into forcing periods. It has period p where every one of the last 3 p periods repeats the
one p before it, all along the period and not at one phase only.

A motion that still rings comes near to that: in 11 forcing periods it passes almost a whole number of its own. It is
distinguished by what the rest of the transient may still change: a longer period counts where every shorter one would
be refused even then. A motion without a cycle never repeats only where what does not repeat neither fades nor grows.

The part of a response that does not repeat is stationary where it neither fades, as ringing does, nor grows.

The rest of a forcing period is what differs from the period before it. A chaotic response has rests of all sizes in no
order; what rings has smaller and smaller ones. Kendall's rank correlation of their sizes with time decides: batches of
periods in the second half of the record, compared by pairs.

Source: Kendall (1938), Biometrika 30, 81, for tau and its variance 2 (2 k + 5) / (9 k (k - 1)) without a trend.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
import scipy

from gapbeam.postprocess.display_units import in_percent
from gapbeam.postprocess.signals.figure_names import NOT_SETTLED
from gapbeam.postprocess.signals.signal import Signal, SignalError
from gapbeam.postprocess.signals.spectra import whole_periods
from gapbeam.solver.diagnostics.statistics.batch_interval import batch_means, kendall
from gapbeam.solver.messages.wording import counted

BATCHES = 20  # with fewer, ringing of a few long beats passes for no order
TREND = 0.6  # of tau; 3.7 standard deviations without a trend, 1 % false alarms on stationary rattling


class Rest(Enum):
    """Verdict on the part that does not repeat."""

    STATIONARY = "stationary"
    CHANGING = "changing"
    SHORT = "short"


def rest_of(waves: np.ndarray) -> Rest:
    """Return whether the rests of the second half of a record have a trend.

    Args:
        waves: Values by forcing period, (periods, values in a period, signals).
    """
    steps = np.diff(waves, axis=0)[-(len(waves) // 2) :]
    scale = np.maximum(np.ptp(waves, axis=(0, 1)), np.finfo(float).tiny)
    sizes = np.mean((steps / scale) ** 2, axis=(1, 2))
    if len(sizes) < BATCHES:
        return Rest.SHORT
    return Rest.CHANGING if abs(kendall(batch_means(sizes, BATCHES))) > TREND else Rest.STATIONARY


TOLERANCE = 0.01
LONGEST = 12  # forcing periods of a cycle; a record has to hold four of them
REPEATS = 3
NO_CYCLE = "no cycle"

_SETTLED = 1.0e-3
_DRIFT = 2.0  # times the difference over one cycle that three cycles make; 3 where it drifts, 1 for noise
_REST_WORDS = {
    Rest.STATIONARY: "never repeats",
    Rest.CHANGING: f"{NOT_SETTLED}: what does not repeat still fades or grows",
    Rest.SHORT: f"{NOT_SETTLED}, as far as so short a record shows",
}
_REST = 1.0e-9


@dataclass(frozen=True)
class Periodicity:
    """Periodicity of a motion from its Poincaré sections.

    Attributes:
        period: Cycle length in forcing periods; None where no cycle was found.
        residual: Largest difference between a period and the one p before it, over the last 3 p periods, as a
            fraction of the range of the motion; of the best p tried where no cycle was found, inf where none
            could be.
        remaining: Estimated distance from the cycle, same fraction: residual q/(1-q), where the residual
            shrinks by q from cycle to cycle.
        repeats: Repetitions of the cycle in a row up to the end.
        transient: s, where the cycle starts; None without a cycle.
        longest: Longest cycle that the record could show.
        tolerance: Limit of residual and remaining.
        verdict: The finding in one sentence.
        stationary: Whether there is no cycle, and what does not repeat neither fades nor grows: the response has
            settled to a motion that never repeats. False where that is not known.
    """

    period: int | None
    residual: float
    remaining: float
    repeats: int
    transient: float | None
    longest: int
    tolerance: float
    verdict: str
    stationary: bool = False

    @property
    def word(self) -> str:
        """The kind of response in a word or two."""
        if self.period is not None:
            return f"period {self.period}"
        return NO_CYCLE if self.stationary else NOT_SETTLED


@dataclass(frozen=True)
class PoincareSection:
    """States at every forcing period.

    Attributes:
        time: (k,), s: start of the record's first whole period, and every period after it.
        displacement: (k,), m.
        velocity: (k,), m/s.
    """

    time: np.ndarray
    displacement: np.ndarray
    velocity: np.ndarray


def poincare_section(displacement: Signal, velocity: Signal, forcing_frequency: float) -> PoincareSection:
    """Take the state once per forcing period, at t = j/f.

    Args:
        displacement: m.
        velocity: m/s, at the same times.
        forcing_frequency: f in Hz.

    Raises:
        SignalError: No such time in the record.
    """
    start, end = displacement.time[0] * forcing_frequency, displacement.time[-1] * forcing_frequency
    time = np.arange(np.ceil(start - 1e-6), np.floor(end + 1e-6) + 1) / forcing_frequency
    if time.size == 0:
        raise SignalError(f"{displacement.name}: the record is shorter than a forcing period")
    return PoincareSection(time, _at(displacement, time), _at(velocity, time))


def periodicity(signals: tuple[Signal, ...], forcing_frequency: float, tolerance: float = TOLERANCE) -> Periodicity:
    """Find the shortest cycle of 1, 2, 3, ... `LONGEST` forcing periods in which a response has settled.

    For a cycle of p periods, e_j = max |x(t) - x(t - p/f)| over period j and over all signals, each divided
    by its range in the last 4 p periods. Period p is reported if e_j <= tolerance in the last 3 p periods and
    the estimated rest of the transient is within tolerance too: a response that creeps is not called
    periodic. Nor is one whose shorter periods are refused for less than twice that rest: both ends of a
    difference may still move by it.

    Args:
        signals: Signals at the same times, for example displacement and velocity of a probe.
        forcing_frequency: f in Hz.
        tolerance: As a fraction of the range.

    Raises:
        SignalError: No signal, or fewer than four values in a forcing period.
    """
    if not signals:
        raise SignalError("periodicity needs a signal")
    available = whole_periods(signals[0], forcing_frequency)
    tried = min(LONGEST, available // (REPEATS + 1))
    if tried < 1:
        return Periodicity(
            None, np.inf, np.inf, 0, None, 0, tolerance,
            f"undecided: {counted(available, 'forcing period')} are too few, at least {REPEATS + 1} are needed",
        )  # fmt: skip
    waves = np.stack([last_periods(signal, forcing_frequency, available) for signal in signals], axis=-1)
    best, best_residual, nearest = 1, np.inf, np.inf
    for p in range(1, tried + 1):
        difference = _differences(waves, p)
        residual = float(difference[-REPEATS * p :].max())
        if residual < best_residual:
            best, best_residual = p, residual
        if residual <= tolerance:
            remaining = _remaining(waves, difference, p, tolerance)
            if remaining <= tolerance and nearest - 2.0 * remaining > tolerance:
                return _found(difference, p, remaining, tried, tolerance, signals[0], forcing_frequency)
        nearest = min(nearest, residual)
    remaining = _remaining(waves, _differences(waves, best), best, tolerance)
    rest = rest_of(waves)
    if best_residual <= tolerance:
        verdict = (
            f"{NOT_SETTLED}: the last cycles of {counted(best, 'forcing period')} differ by "
            f"{in_percent(best_residual)}, but the rest of the transient may be {in_percent(remaining)} of the range; "
            "run longer"
        )
    else:
        verdict = (
            f"{_REST_WORDS[rest]}: no cycle of up to {counted(tried, 'forcing period')} within "
            f"{in_percent(tolerance)} of the range "
            f"(closest: {best}, residual {in_percent(best_residual)}); {available} periods recorded"
        )
    stationary = best_residual > tolerance and rest == Rest.STATIONARY
    return Periodicity(None, best_residual, remaining, 0, None, tried, tolerance, verdict, stationary)


def left_to_change(signal: Signal, forcing_frequency: float, p: int) -> float:
    """Return by how much a signal of a response with period p may still change while its transient fades.

    One quantity can ring where others have settled: accelerations weigh a frequency by its square.

    Args:
        signal: Evenly sampled.
        forcing_frequency: f in Hz.
        p: Forcing periods in a cycle of the response.

    Returns:
        Largest difference of neighboring cycles among the last four, in the unit of the signal, and the rest of the
        geometric series that these begin, where they begin one.
    """
    cycles = min(whole_periods(signal, forcing_frequency) // p, REPEATS + 1)
    if cycles < 2:
        return float(np.ptp(signal.values))
    waves = last_periods(signal, forcing_frequency, cycles * p)[..., None]
    difference = _differences(waves, p)
    rest = _remaining(waves, difference, p, 0.0) if cycles > REPEATS else 0.0
    largest = float(difference.max()) + (rest if np.isfinite(rest) else 0.0)
    return largest * float(np.ptp(waves))


def _found(
    difference: np.ndarray,
    p: int,
    remaining: float,
    tried: int,
    tolerance: float,
    signal: Signal,
    frequency: float,
) -> Periodicity:
    outside = np.flatnonzero(difference > tolerance)
    first = int(outside[-1]) + 1 if outside.size else 0  # difference[first:] is within tolerance
    residual = float(difference[-REPEATS * p :].max())
    repeats = (difference.size - first) // p
    end = float(signal.time[-1]) + (0.5 * signal.interval if signal.width else 0.0)
    transient = max(0.0, end - (difference.size + p - first) / frequency)
    verdict = (
        f"period {p}: a cycle of {p} forcing period{'s' if p > 1 else ''}, repeated {repeats} times within "
        f"{in_percent(tolerance)} of the range (residual {in_percent(residual)}); transient {transient:.4g} s"
    )
    return Periodicity(p, residual, remaining, repeats, transient, tried, tolerance, verdict)


def last_periods(signal: Signal, frequency: float, periods: int) -> np.ndarray:
    """Cut the last whole forcing periods out, (periods, values in a period); interpolated where they do not fit.

    Args:
        signal: Evenly sampled.
        frequency: Frequency of the forcing, Hz.
        periods: Number of periods; the signal must last as long.

    Raises:
        SignalError: Fewer than four values in a period.
    """
    exact = 1.0 / (frequency * signal.interval)
    if exact < 4:
        raise SignalError(f"{signal.name}: {exact:.3g} values in a forcing period, at least four are needed")
    size = round(exact)
    if abs(exact - size) * periods < 1e-3:
        return signal.values[-size * periods :].reshape(periods, size)
    size = int(np.ceil(exact))
    time = signal.time[-1] - np.arange(size * periods - 1, -1, -1) / (frequency * size)
    return _at(signal, np.maximum(time, signal.time[0])).reshape(periods, size)


def _differences(waves: np.ndarray, p: int) -> np.ndarray:
    """e_j for j = p, p + 1, ...: (periods - p,), relative to the range in the last 4 p periods."""
    recent = waves[-(REPEATS + 1) * p :]
    span = np.ptp(recent, axis=(0, 1))
    whole = np.ptp(waves, axis=(0, 1))
    level = np.abs(waves).max(axis=(0, 1))
    resting = span <= _REST * np.maximum(whole, level)  # at rest to round-off: nothing left that could differ
    scale = np.where(resting, np.maximum(np.maximum(whole, level), np.finfo(float).tiny), span)
    return np.asarray((np.abs(waves[p:] - waves[:-p]) / scale).max(axis=(1, 2)))


def _remaining(waves: np.ndarray, difference: np.ndarray, p: int, tolerance: float) -> float:
    """Sum of the geometric series that the residuals of the last three cycles begin; infinite for a drift."""
    last = difference[-REPEATS * p :].reshape(REPEATS, p).max(axis=1)
    if last[-1] <= _SETTLED * tolerance:
        return float(last[-1])
    ratio = float((last[-1] / max(last[0], np.finfo(float).tiny)) ** (1.0 / (REPEATS - 1)))
    if ratio < 1.0:
        return float(last[-1]) * ratio / (1.0 - ratio)
    return np.inf if last[-1] > 0.1 * tolerance or _drifts(waves, difference, p) else float(last[-1])


def _drifts(waves: np.ndarray, difference: np.ndarray, p: int) -> bool:
    """Return whether periods differ the more, the further they are apart: noise does not."""
    return bool(_differences(waves, REPEATS * p)[-p:].max() > _DRIFT * difference[-p:].max())


def _at(signal: Signal, time: np.ndarray) -> np.ndarray:
    if signal.time.size < 4:
        return np.asarray(np.interp(time, signal.time, signal.values))
    return np.asarray(
        scipy.interpolate.CubicSpline(signal.time, signal.values)(np.clip(time, signal.time[0], signal.time[-1]))
    )
