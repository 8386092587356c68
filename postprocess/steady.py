"""The figures of a forced response over windows of whole periods: one number each, with its scatter.

A window is 12 forcing periods long, which hold whole cycles of 1, 2, 3, 4, 6 and 12 periods; a response with another
cycle gets the next multiple of it. A settled response has the same figures in every window, to its residual; one that
never repeats has a mean and a scatter, which is all that can be compared.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

import numpy as np
import xarray as xr

from postprocess.periodicity import TOLERANCE, Periodicity, last_periods, periodicity
from postprocess.signals import Signal, SignalError, face_signal, probe_signal
from postprocess.smoothing import smooth
from postprocess.spectra import CYCLE, whole_periods

FloatArray = np.ndarray

HARMONICS = 5
FEWEST = 4  # forcing periods of a record: a cycle of one has to repeat three times
_EDGE = 1.0e-6


@dataclass(frozen=True)
class Quantity:
    """One figure of a response, window by window.

    Attributes:
        unit: SI unit.
        values: (k,), one a window.
    """

    unit: str
    values: FloatArray

    @property
    def mean(self) -> float:
        """Mean over the windows."""
        return float(self.values.mean())

    @property
    def scatter(self) -> float:
        """Standard deviation of the windows about their mean; 0 with a single window."""
        return float(self.values.std(ddof=1)) if self.values.size > 1 else 0.0

    @property
    def uncertainty(self) -> float:
        """Standard error of the mean; 0 with a single window, which tells nothing of it."""
        return self.scatter / float(np.sqrt(self.values.size))


@dataclass(frozen=True)
class Steady:
    """A forced response after its transient.

    Attributes:
        frequency: Of the forcing, Hz.
        cycle: Its period, and how well it repeats.
        periods: Forcing periods in a window.
        windows: Number of windows k.
        start: s, where the first window begins.
        end: s, where the last one ends.
        quantities: Figures by name: "<probe> displacement" and so on, see `steady`.
        harmonics: Of the displacement, by probe: complex amplitudes A exp(i phase) of A sin(2 pi n f t + phase) for
            n = 1 ... 5, (k, 5), m.
        notes: What to read with care.
    """

    frequency: float
    cycle: Periodicity
    periods: int
    windows: int
    start: float
    end: float
    quantities: dict[str, Quantity]
    harmonics: dict[str, FloatArray]
    notes: tuple[str, ...] = ()

    @property
    def settled(self) -> bool:
        """Whether the response repeats."""
        return self.cycle.period is not None

    @property
    def creeps(self) -> bool:
        """Whether it repeats within the tolerance, but is still on its way."""
        return self.cycle.period is None and self.cycle.residual <= self.cycle.tolerance

    @property
    def word(self) -> str:
        """The kind of response in a word or two."""
        if self.settled:
            return f"period {self.cycle.period}"
        return "not settled" if self.creeps else "no cycle"


def steady(
    history: xr.Dataset,
    frequency: float,
    after: float | None = None,
    tolerance: float = TOLERANCE,
) -> Steady:
    """Compute the figures of a response over its last windows.

    For every probe, in the bending direction: peak to peak of the absolute acceleration as recorded ("acceleration")
    and of its 2.5 ms mean ("smoothed acceleration"), of the displacement ("displacement"), and the amplitudes of the
    harmonics 1 to 5 of the displacement ("harmonic 1" ...; those of the relative acceleration are (2 pi n f)^2 times
    as large). For every face: the largest contact force on record ("peak force") and the impulse in a forcing period
    ("impulse").

    Args:
        history: The records of a run.
        frequency: Of the forcing, Hz.
        after: s, where the transient ends; by default where the cycle begins or, without one, half the record is over.
        tolerance: Of the periodicity, as a fraction of the range.

    Raises:
        SignalError: No probe, fewer than four forcing periods or four values in one, or values that are not finite.
    """
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
        notes.append(f"windows of {periods} forcing periods: too short to tell subharmonics from scatter; run longer")
    quantities, amplitudes, faults = figures_over(history, frequency, periods, count)
    start = end - periods * count / frequency
    return Steady(
        frequency, cycle, periods, count, start, end, quantities, amplitudes, tuple(dict.fromkeys([*notes, *faults]))
    )


def figures_over(
    history: xr.Dataset, frequency: float, periods: int, count: int = 1
) -> tuple[dict[str, Quantity], dict[str, FloatArray], list[str]]:
    """Return figures, harmonics and notes, as in `Steady`, over the last windows of a record, settled or not.

    Args:
        history: The records of a run.
        frequency: Of the forcing, Hz.
        periods: Forcing periods in a window.
        count: Number of windows.

    Raises:
        SignalError: A window without values, or fewer values in a forcing period than the harmonics need.
    """
    probes = [str(name) for name in history["probe"].values]
    quantities: dict[str, Quantity] = {}
    amplitudes: dict[str, FloatArray] = {}
    notes: list[str] = []
    span = _Span(frequency, periods, count, float(history["time"].values[-1]))
    for probe in probes:
        displacement = probe_signal(history, "displacement", probe)
        acceleration = probe_signal(history, "acceleration_absolute", probe)
        quantities[f"{probe} displacement"] = Quantity("m", span.ranges(displacement))
        quantities[f"{probe} acceleration"] = Quantity("m/s^2", span.ranges(acceleration))
        try:
            quantities[f"{probe} smoothed acceleration"] = Quantity("m/s^2", span.ranges(smooth(acceleration)))
        except SignalError as fault:
            notes.append(f"not smoothed: {fault}")
        amplitudes[probe] = span.harmonics(displacement)
        for order in range(1, HARMONICS + 1):
            quantities[f"{probe} harmonic {order}"] = Quantity("m", np.abs(amplitudes[probe][:, order - 1]))
    for face in (str(name) for name in history["face"].values) if "face" in history.coords else ():
        quantities[f"{face} peak force"] = Quantity("N", span.largest(face_signal(history, "contact_force", face)))
        quantities[f"{face} impulse"] = Quantity("N s", span.increments(face_signal(history, "impulse", face)))
    return quantities, amplitudes, notes


def _windows(available: int, cycle: int | None) -> tuple[int, int]:
    """Return the forcing periods of a window, and how many windows there are."""
    whole = CYCLE if cycle is None else cycle * ceil(CYCLE / cycle)
    if available >= whole:
        return whole, available // whole
    if cycle is not None:
        return max(available // cycle, 1) * cycle, 1
    half = CYCLE // 2
    return (half, 1) if available >= half else (available, min(available, 1))


@dataclass(frozen=True)
class _Span:
    """The windows at the end of a record."""

    frequency: float
    periods: int
    count: int
    end: float

    def ranges(self, signal: Signal) -> FloatArray:
        """Peak to peak in every window, (k,)."""
        return np.array([np.ptp(part) for part in self._parts(signal)])

    def largest(self, signal: Signal) -> FloatArray:
        """Largest value in every window, (k,)."""
        return np.array([part.max() for part in self._parts(signal)])

    def increments(self, signal: Signal) -> FloatArray:
        """Growth of a running total in a forcing period, the mean over every window, (k,)."""
        edges = np.interp(self.end - self._length * np.arange(self.count, -1, -1), signal.time, signal.values)
        return np.asarray(np.diff(edges) / self.periods)

    def harmonics(self, signal: Signal) -> FloatArray:
        """A exp(i phase) of A sin(2 pi n f t + phase) in every window, (k, 5)."""
        rows = last_periods(signal, self.frequency, self.periods * self.count)
        size = rows.shape[1]
        if size < 2 * HARMONICS + 2:
            raise SignalError(
                f"{signal.name}: {size} values in a forcing period, harmonic {HARMONICS} asks for {2 * HARMONICS + 2}"
            )
        begins = signal.time[-1] - (rows.size - 1) / (self.frequency * size)  # as a window is whole periods later
        lines = np.fft.rfft(rows.reshape(self.count, -1), axis=1)[:, self.periods * np.arange(1, HARMONICS + 1)]
        turned = np.exp(-2j * np.pi * self.frequency * np.arange(1, HARMONICS + 1) * begins) * 1j
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
