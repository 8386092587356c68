"""Figures of a forced response over windows of whole periods at the end of a record: one number each, with its scatter.

A window is 12 forcing periods long, which hold whole cycles of 1, 2, 3, 4, 6 and 12 periods; a response with another
cycle gets the next multiple of it. A settled response has the same figures in every window, to its residual; one that
never repeats has a mean and a scatter, which is all that can be compared. Without a forcing period the figures are peak
to peak over the whole record, and the largest forces.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import ceil
from typing import TYPE_CHECKING

import numpy as np

from gapbeam.postprocess.signals.figure_names import LARGEST_FORCE
from gapbeam.postprocess.signals.periodicity import TOLERANCE, Periodicity, last_periods, left_to_change, periodicity
from gapbeam.postprocess.signals.signal import (
    Signal,
    SignalError,
    face_signal,
    names_along,
    probe_signal,
    probes_of,
    smooth_motions,
    struck_in,
)
from gapbeam.postprocess.signals.spectra import CYCLE, smooth_over, whole_periods, window_of
from gapbeam.solver.messages.wording import counted

if TYPE_CHECKING:
    import xarray as xr

FEWEST = 4  # forcing periods of a record: a cycle of one has to repeat three times
_EDGE = 1.0e-6


@dataclass(frozen=True)
class Windows:
    """The windows at the end of a record.

    Attributes:
        frequency: Frequency of the forcing, Hz.
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
        """Start of the first window, s."""
        return self.end - self.count * self._length

    def of(self, periods: int) -> Windows:
        """Return windows of so many periods in the same span, or the one that is as long as it."""
        whole = self.periods * self.count
        return replace(self, periods=min(periods, whole), count=max(1, whole // periods))

    def ranges(self, signal: Signal) -> np.ndarray:
        """Peak to peak in every window, (k,)."""
        return np.array([np.ptp(part) for part in self._parts(signal)])

    def largest(self, signal: Signal) -> np.ndarray:
        """Largest value in every window, (k,)."""
        return np.array([part.max() for part in self._parts(signal)])

    def smallest(self, signal: Signal) -> np.ndarray:
        """Smallest value in every window, (k,)."""
        return np.array([part.min() for part in self._parts(signal)])

    def deviations(self, signal: Signal) -> np.ndarray:
        """Root mean square of the deviation from the mean of every window, (k,)."""
        return np.array([part.std() for part in self._parts(signal)])

    def increments(self, signal: Signal) -> np.ndarray:
        """Growth of a running total in a forcing period, the mean over every window, (k,)."""
        edges = np.interp(self.end - self._length * np.arange(self.count, -1, -1), signal.time, signal.values)
        return np.asarray(np.diff(edges) / self.periods)

    def harmonics(self, signal: Signal, count: int) -> np.ndarray:
        """A exp(i phase) of A sin(2 pi n f t + phase), n = 1 ... count, in every window, (k, count).

        Raises:
            SignalError: Fewer values in a forcing period than the harmonics need.
        """
        rows = last_periods(signal, self.frequency, self.periods * self.count)
        size = rows.shape[1]
        if size < 2 * count + 2:
            raise SignalError(
                f"{signal.name}: {counted(size, 'value')} in a forcing period, harmonic {count} asks for "
                f"{2 * count + 2}"
            )
        begins = signal.time[-1] - (rows.size - 1) / (self.frequency * size)  # as a window is whole periods later
        lines = np.fft.rfft(rows.reshape(self.count, -1), axis=1)[:, self.periods * np.arange(1, count + 1)]
        turned = np.exp(-2j * np.pi * self.frequency * np.arange(1, count + 1) * begins) * 1j
        return np.asarray(lines * turned * (2.0 / (size * self.periods)))

    @property
    def _length(self) -> float:
        return self.periods / self.frequency

    def _parts(self, signal: Signal) -> list[np.ndarray]:
        place = np.floor((self.end - signal.time) / self._length - _EDGE).astype(int)
        place = np.where(place < 0, 0, place)
        parts = [signal.values[place == window] for window in range(self.count - 1, -1, -1)]
        if any(part.size == 0 for part in parts):
            raise SignalError(f"{signal.name}: a window of {counted(self.periods, 'forcing period')} holds no value")
        return parts


def settled_windows(
    history: xr.Dataset,
    frequency: float,
    after: float | None = None,
    tolerance: float = TOLERANCE,
    probes: Sequence[str] | None = None,
) -> tuple[Periodicity, Windows, list[str]]:
    """Find the cycle of a response, and the windows after its transient, with notes of caution.

    Args:
        history: The records of a run.
        frequency: Frequency of the forcing, Hz.
        after: s, where the transient ends; by default where the cycle begins or, without one, half the record is over.
        tolerance: Tolerance of the periodicity, as a fraction of the range.
        probes: Names of those that are looked at; by default all.

    Raises:
        SignalError: No probe, fewer than four forcing periods or four values in one, or values that are not finite.
    """
    names = probes_of(history) if probes is None else probes
    motions = [motion for probe in names for motion in smooth_motions(history, probe)]
    recorded = whole_periods(motions[0], frequency)
    if recorded < FEWEST:
        raise SignalError(
            f"the record of {motions[0].duration:.4g} s holds {counted(recorded, 'forcing period')} of "
            f"{1.0 / frequency:g} s; expected at least {FEWEST}: run longer"
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
            f"windows of {counted(periods, 'forcing period')}: too short to distinguish subharmonics from scatter; "
            "run longer"
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


HARMONICS = 5


@dataclass(frozen=True)
class WindowFigure:
    """One figure of a response, window by window.

    Attributes:
        unit: SI unit.
        values: (k,), one a window.
        unsettled: Possible further change as the transient decays; 0 if not asked for.
    """

    unit: str
    values: np.ndarray
    unsettled: float = 0.0

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
        """Standard error of the mean; 0 with a single window, which says nothing about it."""
        return self.scatter / float(np.sqrt(self.values.size))


@dataclass(frozen=True)
class Steady:
    """A forced response after its transient.

    Attributes:
        frequency: Frequency of the forcing, Hz.
        cycle: Its period, and how well it repeats.
        periods: Forcing periods in a window.
        windows: Number of windows k.
        start: s, where the first window begins.
        end: s, where the last one ends.
        quantities: Figures by name: "<probe> peak-to-peak displacement" and so on, see `steady`.
        harmonics: Harmonics of the displacement, by probe: complex amplitudes A exp(i phase) of
            A sin(2 pi n f t + phase) for n = 1 ... 5, (k, 5), m.
        notes: Warnings.
    """

    frequency: float
    cycle: Periodicity
    periods: int
    windows: int
    start: float
    end: float
    quantities: dict[str, WindowFigure]
    harmonics: dict[str, np.ndarray]
    notes: tuple[str, ...] = ()

    @property
    def settled(self) -> bool:
        """True where the response repeats."""
        return self.cycle.period is not None

    @property
    def creeps(self) -> bool:
        """True where the response repeats within the tolerance but is not yet steady."""
        return self.cycle.period is None and self.cycle.residual <= self.cycle.tolerance

    @property
    def word(self) -> str:
        """The kind of response in a word or two."""
        return self.cycle.word


def steady(
    history: xr.Dataset,
    frequency: float,
    after: float | None = None,
    tolerance: float = TOLERANCE,
) -> Steady:
    """Compute the figures of a response over its last windows.

    For every probe, in the bending direction: peak to peak of the absolute acceleration as recorded and of its mean
    over `smoothing_window` ("smoothed"), of the displacement, and the amplitudes of the harmonics 1 to 5 of the
    displacement ("harmonic 1" ...; those of the relative acceleration are (2 pi n f)^2 times as large). For every face:
    the largest contact force on record but of impulses, and the impulse in a forcing period ("impulse").

    Args:
        history: The records of a run.
        frequency: Frequency of the forcing, Hz.
        after: s, where the transient ends; by default where the cycle begins or, without one, half the record is over.
        tolerance: Tolerance of the periodicity, as a fraction of the range.

    Raises:
        SignalError: No probe, fewer than four forcing periods or four values in one, or values that are not finite.
    """
    cycle, windows, notes = settled_windows(history, frequency, after, tolerance)
    quantities, amplitudes, faults = figures_over(history, frequency, windows.periods, windows.count)
    if cycle.period is not None:
        for probe in names_along(history, "probe"):
            for name, motion in motions_of(history, probe, frequency, []).items():
                if name != RAW:
                    figure, left = f"{probe} peak-to-peak {name}", left_to_change(motion, frequency, cycle.period)
                    quantities[figure] = replace(quantities[figure], unsettled=left)
    return Steady(
        frequency, cycle, windows.periods, windows.count, windows.start, windows.end, quantities, amplitudes,
        tuple(dict.fromkeys([*notes, *faults])),
    )  # fmt: skip


RAW = "acceleration"
"""The motion that depends on the interval of the records."""


def motions_of(history: xr.Dataset, probe: str, frequency: float | None, notes: list[str]) -> dict[str, Signal]:
    """Return the motions of a probe whose range is a figure, by name.

    These are the displacement and, where it is known, the absolute acceleration, as recorded and smoothed.

    Args:
        history: The records of a run.
        probe: Name of the probe.
        frequency: Frequency of the forcing, Hz; None: it has none.
        notes: Takes the reasons for which one is not known.

    Raises:
        SignalError: No such probe, or values that are not finite.
    """
    found = {"displacement": probe_signal(history, "displacement", probe)}
    if "acceleration_absolute" not in history:
        notes.append("no figures of accelerations: the motion of the points with the frame is not known")
        return found
    found[RAW] = probe_signal(history, "acceleration_absolute", probe)
    try:
        found["smoothed acceleration"] = smooth_over(found[RAW], window_of(history, frequency))
    except SignalError as fault:  # recorded too seldom
        notes.append(f"not smoothed: {fault}")
    return found


def scales_of(figures: Mapping[str, float]) -> dict[str, float]:
    """Return the scales of differences: themselves; harmonics, forces and impulses to the largest of them."""
    scales = {name: abs(value) for name, value in figures.items()}
    for name in figures:
        if " harmonic " in name:
            probe = name.split(" harmonic ")[0]
            scales[name] = max(figures[f"{probe} harmonic {order}"] for order in range(1, HARMONICS + 1))
        else:
            ending = next((ending for ending in (" impulse", f" {LARGEST_FORCE}") if name.endswith(ending)), None)
            if ending is not None:
                scales[name] = max(value for key, value in figures.items() if key.endswith(ending))
    return {name: scale or 1.0 for name, scale in scales.items()}


def figures_over(
    history: xr.Dataset, frequency: float, periods: int, count: int = 1
) -> tuple[dict[str, WindowFigure], dict[str, np.ndarray], list[str]]:
    """Return figures, harmonics and notes, as in `Steady`, over the last windows of a record, settled or not.

    Args:
        history: The records of a run.
        frequency: Frequency of the forcing, Hz.
        periods: Forcing periods in a window.
        count: Number of windows.

    Raises:
        SignalError: A window without values, or fewer values in a forcing period than the harmonics need.
    """
    quantities: dict[str, WindowFigure] = {}
    amplitudes: dict[str, np.ndarray] = {}
    notes: list[str] = []
    span = Windows(frequency, periods, count, float(history["time"].values[-1]))
    for probe in names_along(history, "probe"):
        motions = motions_of(history, probe, frequency, notes)
        for name, motion in motions.items():
            quantities[f"{probe} peak-to-peak {name}"] = WindowFigure(motion.unit, span.ranges(motion))
        amplitudes[probe] = span.harmonics(motions["displacement"], HARMONICS)
        for order in range(1, HARMONICS + 1):
            quantities[f"{probe} harmonic {order}"] = WindowFigure(
                motions["displacement"].unit, np.abs(amplitudes[probe][:, order - 1])
            )
    for face in names_along(history, "face"):
        force, pushed = (face_signal(history, name, face) for name in ("contact_force", "impulse"))
        if face not in struck_in(history):
            quantities[f"{face} {LARGEST_FORCE}"] = WindowFigure(force.unit, span.largest(force))
        quantities[f"{face} impulse"] = WindowFigure(pushed.unit, span.increments(pushed))
    return quantities, amplitudes, notes


WORD = "no period"


def figures_of_record(history: xr.Dataset, after: float | None = None) -> tuple[dict[str, WindowFigure], list[str]]:
    """Return figures, named as in `gapbeam.postprocess.signals.steady_figures.steady`, and notes.

    For every probe, in the bending direction: peak to peak of displacement, acceleration and smoothed acceleration.
    For every face: the largest contact force on record and the impulse of all contacts ("whole impulse").

    Args:
        history: The records of a run.
        after: s, from when on; by default all.

    Raises:
        SignalError: No probe, nothing after that time, or values that are not finite.
    """
    quantities: dict[str, WindowFigure] = {}
    notes: list[str] = []
    for probe in probes_of(history):
        for name, motion in motions_of(history, probe, None, notes).items():
            quantities[f"{probe} peak-to-peak {name}"] = _range(motion, after)
    for face in names_along(history, "face"):
        force, pushed = (face_signal(history, name, face) for name in ("contact_force", "impulse"))
        impulse = _later(pushed, after)
        if face not in struck_in(history):
            quantities[f"{face} {LARGEST_FORCE}"] = WindowFigure(force.unit, np.array([_later(force, after).max()]))
        quantities[f"{face} whole impulse"] = WindowFigure(pushed.unit, np.array([impulse[-1] - impulse[0]]))
    return quantities, list(dict.fromkeys(notes))


def _range(signal: Signal, after: float | None) -> WindowFigure:
    return WindowFigure(signal.unit, np.array([np.ptp(_later(signal, after))]))


def _later(signal: Signal, after: float | None) -> np.ndarray:
    values = signal.values if after is None else signal.values[signal.time >= after]
    if values.size == 0:
        raise SignalError(f"{signal.name}: the record ends before the transient does")
    return values
