"""The waveforms of two runs at the same phases of the forcing, or at the same times."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass

import numpy as np
import xarray as xr

from gapbeam.postprocess.results.results import Results
from gapbeam.postprocess.results.run_watch import motion_of
from gapbeam.postprocess.signals.periodicity import last_periods
from gapbeam.postprocess.signals.signal import Signal, SignalError, probe_signal
from gapbeam.postprocess.signals.smoothing import smooth_over, window_of
from gapbeam.postprocess.signals.spectra import whole_periods
from gapbeam.postprocess.signals.steady_figures import FEWEST

FloatArray = np.ndarray

LONGEST = 12.0  # forcing periods of a record that does not repeat
_SAME = 1e-6


def is_raw(name: str) -> bool:
    """Return whether a figure is of the raw acceleration, which depends on the output interval and does not decide."""
    return name.endswith(" acceleration") and not name.endswith(" smoothed acceleration")


@dataclass(frozen=True)
class Run:
    """History and origin of time of a compared run.

    Attributes:
        history: Its records.
        origin: Time at which its first harmonic load has phase 0, s.
    """

    history: xr.Dataset
    origin: float


def run_of(results: Results, frequency: float) -> Run:
    """Return the run to compare; a computed periodic orbit is repeated as often as a record needs.

    Raises:
        ResultsError: The results cannot be read.
    """
    loads = [load for load in results.case.get("load", ()) if load.get("frequency")]
    origin = -float(loads[0].get("phase", 0.0)) / 360.0 / float(loads[0]["frequency"]) if loads else 0.0
    return Run(motion_of(results, frequency), origin)


@dataclass(frozen=True)
class Overlay:
    """One signal of both runs at the same phases of the forcing.

    Attributes:
        name: Probe and signal.
        unit: SI unit.
        time: (n,), s, from the start of a forcing period.
        a: (n,).
        b: (n,).
    """

    name: str
    unit: str
    time: FloatArray
    a: FloatArray
    b: FloatArray

    @property
    def range(self) -> float:
        """The larger of the two ranges."""
        return float(max(np.ptp(self.a), np.ptp(self.b)))

    @property
    def rms(self) -> float:
        """Root mean square of the difference relative to the range."""
        return float(np.sqrt(np.mean((self.a - self.b) ** 2)) / self.range) if self.range > 0.0 else 0.0

    @property
    def largest(self) -> float:
        """Largest difference relative to the range."""
        return float(np.max(np.abs(self.a - self.b)) / self.range) if self.range > 0.0 else 0.0


def _signals(one: Run, probe: str, frequency: float) -> dict[str, Signal]:
    raw = probe_signal(one.history, "acceleration_absolute", probe)
    found = {"displacement": probe_signal(one.history, "displacement", probe)}
    with contextlib.suppress(SignalError):  # recorded too seldom
        found["smoothed acceleration"] = smooth_over(raw, window_of(one.history, frequency))
    return found | {"acceleration": raw}


def cycles_overlaid(a: Run, b: Run, probes: tuple[str, ...], frequency: float, cycle: int) -> tuple[Overlay, ...]:
    """Return the last cycle of both, A by the whole periods earlier that suit the first signal best."""
    found, shift = list[Overlay](), None
    for probe in probes:
        of_a, of_b = _signals(a, probe, frequency), _signals(b, probe, frequency)
        for name in (name for name in of_a if name in of_b):
            waves = []
            for one, signal in ((a, of_a[name]), (b, of_b[name])):
                waves.append(_folded(signal, frequency, cycle, one.origin))
            if waves[0].size != waves[1].size:
                size = min(wave.size for wave in waves)
                waves = [_thinned(wave, size) for wave in waves]
            if shift is None:
                size = waves[0].size // cycle
                gaps = [float(np.sum((np.roll(waves[0], size * j) - waves[1]) ** 2)) for j in range(cycle)]
                shift = int(np.argmin(gaps))
            size = waves[0].size
            moved = np.roll(waves[0], shift * (size // cycle))
            time = np.arange(size) / (size * frequency) * cycle
            found.append(Overlay(f"{probe} {name}", of_a[name].unit, time, moved, waves[1]))
    return tuple(found)


def _folded(signal: Signal, frequency: float, cycle: int, origin: float) -> FloatArray:
    """Return the last cycle, (values,), beginning at phase 0 of the forcing; of a record of one cycle all of it."""
    available = whole_periods(signal, frequency)
    rows = last_periods(signal, frequency, min(available, cycle) if available else 1)
    if len(rows) < cycle:  # a smoothed record loses some of its ends: an orbit's neighbors are itself
        raise SignalError(f"{signal.name}: the record holds less than a cycle of {cycle} forcing periods")
    size = rows.shape[1]
    begins = (signal.time[-1] - (rows.size - 1) / (frequency * size) - origin) * frequency
    wave = rows.reshape(-1)
    places = (np.arange(wave.size) / size - begins) % cycle * size  # of the phases 0, 1/size, ... in the wave
    return np.asarray(np.interp(places, np.arange(wave.size + 1), np.append(wave, wave[0])))


def _thinned(wave: FloatArray, size: int) -> FloatArray:
    """Return a closed wave at fewer phases."""
    places = np.arange(size) * (wave.size / size)
    return np.asarray(np.interp(places, np.arange(wave.size + 1), np.append(wave, wave[0])))


def times_overlaid(a: Run, b: Run, probes: tuple[str, ...], frequency: float) -> tuple[Overlay, ...]:
    """Return the last 12 periods that both records hold, at the same times; nothing where they hold too few."""
    found = []
    for probe in probes:
        of_a, of_b = _signals(a, probe, frequency), _signals(b, probe, frequency)
        for name in (name for name in of_a if name in of_b):
            one, other = of_a[name], of_b[name]
            end = min(one.time[-1], other.time[-1])
            start = max(one.time[0], other.time[0], end - LONGEST / frequency)
            if end - start < FEWEST / frequency:
                return ()
            step = max(one.interval, other.interval)
            time = start + step * np.arange(int((end - start) / step + _SAME) + 1)
            values = [np.interp(time, signal.time, signal.values) for signal in (one, other)]
            found.append(Overlay(f"{probe} {name}", one.unit, time, *values))
    return tuple(found)
