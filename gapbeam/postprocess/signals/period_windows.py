"""Windows of whole forcing periods at the end of a record, after the transient."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil

import numpy as np
import xarray as xr

from gapbeam.postprocess.signals.periodicity import TOLERANCE, Periodicity, last_periods, periodicity
from gapbeam.postprocess.signals.signal import Signal, SignalError, probe_signal
from gapbeam.postprocess.signals.spectra import CYCLE, whole_periods

FloatArray = np.ndarray

FEWEST = 4  # forcing periods of a record: a cycle of one has to repeat three times
_EDGE = 1.0e-6


@dataclass(frozen=True)
class Windows:
    """The windows at the end of a record.

    Attributes:
        frequency: Of the forcing, Hz.
        periods: Forcing periods in a window.
        count: Number of windows k.
        end: s, where the last one ends.
    """

    frequency: float
    periods: int
    count: int
    end: float

    @property
    def start(self) -> float:
        """Where the first window begins, s."""
        return self.end - self.count * self._length

    def of(self, periods: int) -> Windows:
        """Return windows of so many periods in the same span, or the one that is as long as it."""
        whole = self.periods * self.count
        return replace(self, periods=min(periods, whole), count=max(1, whole // periods))

    def ranges(self, signal: Signal) -> FloatArray:
        """Peak to peak in every window, (k,)."""
        return np.array([np.ptp(part) for part in self._parts(signal)])

    def largest(self, signal: Signal) -> FloatArray:
        """Largest value in every window, (k,)."""
        return np.array([part.max() for part in self._parts(signal)])

    def smallest(self, signal: Signal) -> FloatArray:
        """Smallest value in every window, (k,)."""
        return np.array([part.min() for part in self._parts(signal)])

    def deviations(self, signal: Signal) -> FloatArray:
        """Root mean square of the deviation from the mean of every window, (k,)."""
        return np.array([part.std() for part in self._parts(signal)])

    def increments(self, signal: Signal) -> FloatArray:
        """Growth of a running total in a forcing period, the mean over every window, (k,)."""
        edges = np.interp(self.end - self._length * np.arange(self.count, -1, -1), signal.time, signal.values)
        return np.asarray(np.diff(edges) / self.periods)

    def harmonics(self, signal: Signal, count: int) -> FloatArray:
        """A exp(i phase) of A sin(2 pi n f t + phase), n = 1 ... count, in every window, (k, count).

        Raises:
            SignalError: Fewer values in a forcing period than the harmonics need.
        """
        rows = last_periods(signal, self.frequency, self.periods * self.count)
        size = rows.shape[1]
        if size < 2 * count + 2:
            raise SignalError(
                f"{signal.name}: {size} values in a forcing period, harmonic {count} asks for {2 * count + 2}"
            )
        begins = signal.time[-1] - (rows.size - 1) / (self.frequency * size)  # as a window is whole periods later
        lines = np.fft.rfft(rows.reshape(self.count, -1), axis=1)[:, self.periods * np.arange(1, count + 1)]
        turned = np.exp(-2j * np.pi * self.frequency * np.arange(1, count + 1) * begins) * 1j
        return np.asarray(lines * turned * (2.0 / (size * self.periods)))

    @property
    def _length(self) -> float:
        return self.periods / self.frequency

    def _parts(self, signal: Signal) -> list[FloatArray]:
        place = np.floor((self.end - signal.time) / self._length - _EDGE).astype(int)
        place = np.where(place < 0, 0, place)
        parts = [signal.values[place == window] for window in range(self.count - 1, -1, -1)]
        if any(part.size == 0 for part in parts):
            raise SignalError(f"{signal.name}: a window of {self.periods} forcing periods holds no value")
        return parts


def settled_windows(
    history: xr.Dataset,
    frequency: float,
    after: float | None = None,
    tolerance: float = TOLERANCE,
    probes: Sequence[str] | None = None,
) -> tuple[Periodicity, Windows, list[str]]:
    """Find the cycle of a response, and the windows after its transient; with notes on what to read with care.

    Args:
        history: The records of a run.
        frequency: Of the forcing, Hz.
        after: s, where the transient ends; by default where the cycle begins or, without one, half the record is over.
        tolerance: Of the periodicity, as a fraction of the range.
        probes: Names of those that are looked at; by default all.

    Raises:
        SignalError: No probe, fewer than four forcing periods or four values in one, or values that are not finite.
    """
    if probes is None:
        probes = [str(name) for name in history["probe"].values] if "probe" in history.coords else []
    if not probes:
        raise SignalError("the run recorded no probe; add [[probe]] to the case")
    motions = [probe_signal(history, name, probe) for probe in probes for name in ("displacement", "velocity")]
    recorded = whole_periods(motions[0], frequency)
    if recorded < FEWEST:
        raise SignalError(
            f"the record of {motions[0].duration:.4g} s holds {recorded} forcing periods of {1.0 / frequency:g} s; "
            f"expected at least {FEWEST}: run longer"
        )
    cycle = periodicity(tuple(motions), frequency, tolerance)
    begin, end = float(motions[0].time[0]), float(motions[0].time[-1])
    if after is None:
        after = 0.5 * (begin + end) if cycle.transient is None else cycle.transient
    available = min(recorded, int(np.floor((end - after) * frequency + 1e-3)))
    periods, count = _windows(available, cycle.period)
    if periods < 1:
        raise SignalError(f"the record ends {end - after:.4g} s after the transient: not one forcing period is left")
    notes = []
    if cycle.period is None and periods < CYCLE:
        notes.append(
            f"windows of {periods} forcing periods: too short to distinguish subharmonics from scatter; run longer"
        )
    return cycle, Windows(frequency, periods, count, end), notes


def _windows(available: int, cycle: int | None) -> tuple[int, int]:
    """Return the forcing periods of a window, and how many windows there are."""
    whole = CYCLE if cycle is None else cycle * ceil(CYCLE / cycle)
    if available >= whole:
        return whole, available // whole
    if cycle is not None:
        return max(available // cycle, 1) * cycle, 1
    half = CYCLE // 2
    return (half, 1) if available >= half else (available, min(available, 1))
