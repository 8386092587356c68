"""Two runs side by side: the same motion, another one, or one that can be described by its statistics only.

Both are taken over their last whole forcing periods and at the same phase of the forcing. Where both repeat with the
same cycle, waveforms and figures are compared, A shifted by the whole periods that suit best. Where neither repeats,
the records are compared at the same times, as runs from the same start may be; what differs there is compared by the
means over windows of 12 periods, with their scatter. A cycle against another one, or against none, is another branch.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf, lcm
from typing import Any

import numpy as np
import xarray as xr

from gapbeam.postprocess.display_units import in_percent
from gapbeam.postprocess.results.results import Results
from gapbeam.postprocess.results.run_watch import motion_of
from gapbeam.postprocess.signals.figure_names import NOT_SETTLED
from gapbeam.postprocess.signals.periodicity import last_periods
from gapbeam.postprocess.signals.signal import Signal, SignalError, names_along
from gapbeam.postprocess.signals.spectra import whole_periods
from gapbeam.postprocess.signals.steady_figures import (
    FEWEST,
    HARMONICS,
    RAW,
    Steady,
    WindowFigure,
    motions_of,
    scales_of,
    steady,
)
from gapbeam.solver.messages.wording import counted

LONGEST = 12.0  # forcing periods of a record that does not repeat


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
    time: np.ndarray
    a: np.ndarray
    b: np.ndarray

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


MOTIONS = ("displacement", "smoothed acceleration", RAW)  # in the order in which they are shown


def cycles_overlaid(a: Run, b: Run, probes: tuple[str, ...], frequency: float, cycle: int) -> tuple[Overlay, ...]:
    """Return the last cycle of both, A by the whole periods earlier that suit the first signal best."""
    found, shift = list[Overlay](), None
    for probe in probes:
        of_a, of_b = (motions_of(one.history, probe, frequency, []) for one in (a, b))
        for name in (name for name in MOTIONS if name in of_a and name in of_b):
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


def _folded(signal: Signal, frequency: float, cycle: int, origin: float) -> np.ndarray:
    """Return the last cycle, (values,), beginning at phase 0 of the forcing; of a record of one cycle all of it."""
    available = whole_periods(signal, frequency)
    rows = last_periods(signal, frequency, min(available, cycle) if available else 1)
    if len(rows) < cycle:  # a smoothed record loses some of its ends: an orbit's neighbors are itself
        raise SignalError(f"{signal.name}: the record holds less than a cycle of {counted(cycle, 'forcing period')}")
    size = rows.shape[1]
    begins = (signal.time[-1] - (rows.size - 1) / (frequency * size) - origin) * frequency
    wave = rows.reshape(-1)
    places = (np.arange(wave.size) / size - begins) % cycle * size  # of the phases 0, 1/size, ... in the wave
    return np.asarray(np.interp(places, np.arange(wave.size + 1), np.append(wave, wave[0])))


def _thinned(wave: np.ndarray, size: int) -> np.ndarray:
    """Return a closed wave at fewer phases."""
    places = np.arange(size) * (wave.size / size)
    return np.asarray(np.interp(places, np.arange(wave.size + 1), np.append(wave, wave[0])))


def times_overlaid(a: Run, b: Run, probes: tuple[str, ...], frequency: float) -> tuple[Overlay, ...]:
    """Return the last 12 periods that both records hold, at the same times; nothing where they hold too few."""
    found = []
    for probe in probes:
        of_a, of_b = (motions_of(one.history, probe, frequency, []) for one in (a, b))
        for name in (name for name in MOTIONS if name in of_a and name in of_b):
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


TOLERANCE = 0.01
DISAGREE = 5  # exit status
FEWEST_WINDOWS = 2  # of a mean with a scatter
CONFIDENCE = 2.0  # standard errors of the means
FAR = 0.2  # of the range: two motions further apart are likely to be different branches
_SAME = 1e-6


class ComparisonError(ValueError):
    """Two results folders that cannot be compared."""

    exit_status = 2


@dataclass(frozen=True)
class ComparedFigure:
    """One figure of both runs.

    Attributes:
        name: Name of the figure.
        unit: SI unit.
        a: Value in the first run, the mean over its windows.
        b: Value in the second run.
        scatter: Standard deviations over the windows, of both.
        difference: |a - b| relative to the larger (harmonics: to the largest of the probe).
        allowed: Allowance beyond the tolerance, for the standard errors of the means; same measure.
        decides: Whether the verdict depends on it.
    """

    name: str
    unit: str
    a: float
    b: float
    scatter: tuple[float, float]
    difference: float
    allowed: float = 0.0
    decides: bool = True


@dataclass(frozen=True)
class RunComparison:
    """Two runs side by side.

    Attributes:
        a: The first run.
        b: The second.
        steady: Figures of both over their windows.
        rows: Their figures.
        overlays: Their waveforms; for different branches of several cycles side by side.
        phases: Phase of A minus that of B of every harmonic, by probe, rad.
        costs: Wall times, sizes and the like: name, of A, of B.
        way: "cycle", "same times", "statistics" or "branches": what the verdict rests on.
        agree: Whether they agree within the tolerance.
        verdict: The finding in one sentence.
        tolerance: Largest difference that counts as agreement.
        notes: Warnings.
    """

    a: Results
    b: Results
    steady: tuple[Steady, Steady]
    rows: tuple[ComparedFigure, ...]
    overlays: tuple[Overlay, ...]
    phases: dict[str, np.ndarray]
    costs: tuple[tuple[str, Any, Any], ...]
    way: str
    agree: bool
    verdict: str
    tolerance: float
    notes: tuple[str, ...] = field(default=())


def compare(a: Results, b: Results, tolerance: float = TOLERANCE, after: float | None = None) -> RunComparison:
    """Compare two runs.

    Args:
        a: The first.
        b: The second.
        tolerance: Largest relative difference of a figure, and rms difference of a waveform relative to its range,
            that counts as agreement.
        after: s, where the transient of both ends; by default found out, see `steady_figures.steady`.

    Raises:
        ResultsError: Results that cannot be read.
        ComparisonError: No common probe, no forcing frequency, or not the same one.
        SignalError: A record that is too short, or values that are not finite.
    """
    frequency = _frequency(a, b)
    probes = _probes(a, b)
    runs = run_of(a, frequency), run_of(b, frequency)
    both = _steady(a, runs[0], frequency, after), _steady(b, runs[1], frequency, after)
    notes = [f"{name}: {note}" for name, one in zip("AB", both, strict=True) for note in one.notes]
    notes += [
        f"{name}: the run ended as {one.status}: {one.summary.get('message')}"
        for name, one in zip("AB", (a, b), strict=True)
        if one.status not in ("completed", "unknown")
    ]
    overlays: tuple[Overlay, ...] = ()
    rows = _rows(both)
    shared = _shared_cycle(both)
    if shared is not None:
        overlays = cycles_overlaid(*runs, probes, frequency, shared)
        word = " against ".join(dict.fromkeys(one.word for one in both))
        way, (agree, verdict) = "cycle", _verdict(rows, overlays, tolerance, word)
    elif both[0].settled or both[1].settled:
        overlays = cycles_overlaid(*runs, probes, frequency, _span(both))
        way, agree = "branches", False
        verdict = f"different branches: {both[0].word} against {both[1].word}"
        if NOT_SETTLED in (both[0].word, both[1].word):
            verdict = f"one has settled, the other has not: {both[0].word} against {both[1].word}; run longer"
    else:
        overlays = times_overlaid(*runs, probes, frequency)
        deciding = [one for one in overlays if not is_raw(one.name)]
        if deciding and max(one.rms for one in deciding) <= tolerance:
            rows = tuple(ComparedFigure(**(vars(row) | {"allowed": 0.0})) for row in rows)
            way, (agree, verdict) = "same times", _verdict(rows, overlays, tolerance, "no cycle, but the same times")
        else:
            way, (agree, verdict) = "statistics", _statistics(rows, both, tolerance)
    shift = 2.0 * np.pi * frequency * (runs[0].origin - runs[1].origin) * np.arange(1, HARMONICS + 1)
    phases = {
        probe: np.angle(np.exp(1j * (_angles(both[0], probe) - _angles(both[1], probe) + shift))) for probe in probes
    }
    return RunComparison(a, b, both, rows, overlays, phases, _costs(a, b), way, agree, verdict, tolerance, tuple(notes))


def _frequency(a: Results, b: Results) -> float:
    frequencies = []
    for one in (a, b):
        if one.forcing_frequency is None:
            raise ComparisonError(
                f"{one.folder}: the forcing has no period, so there are no steady windows to compare; "
                "expected harmonic loads of one frequency"
            )
        frequencies.append(one.forcing_frequency)
    if abs(frequencies[0] - frequencies[1]) > _SAME * frequencies[0]:
        raise ComparisonError(
            f"{a.folder} is forced at {frequencies[0]:g} Hz and {b.folder} at {frequencies[1]:g} Hz; "
            "expected the same frequency"
        )
    return frequencies[0]


def _probes(a: Results, b: Results) -> tuple[str, ...]:
    named = [names_along(one.history, "probe") for one in (a, b)]
    shared = tuple(name for name in named[0] if name in named[1])
    if not shared:
        words = (f"{one.folder} has {', '.join(names) or 'none'}" for one, names in zip((a, b), named, strict=True))
        raise ComparisonError(f"no common probe: {'; '.join(words)}; expected a [[probe]] of the same name")
    return shared


def _steady(results: Results, run: Run, frequency: float, after: float | None) -> Steady:
    try:
        return steady(run.history, frequency, after)
    except SignalError as fault:
        raise ComparisonError(f"{results.folder}: {fault}") from fault


def _shared_cycle(both: tuple[Steady, Steady]) -> int | None:
    """Return the cycle of both; one that is nearly steady may have the cycle of the other."""
    periods = {one.cycle.period for one in both if not one.creeps}
    return periods.pop() if len(periods) == 1 else None


def _span(both: tuple[Steady, Steady]) -> int:
    """Return the forcing periods that show two different cycles, or none, next to each other."""
    known = [one.cycle.period for one in both if one.cycle.period is not None]
    return min(lcm(*known) if len(known) == 2 else int(LONGEST) // 2, *(one.periods * one.windows for one in both))


def _rows(both: tuple[Steady, Steady]) -> tuple[ComparedFigure, ...]:
    one, other = (run.quantities for run in both)
    scales = scales_of({
        name: max(known[name].mean for known in (one, other) if name in known) for name in {**one, **other}
    })  # fmt: skip
    return tuple(_row(name, one[name], other[name], scales[name]) for name in one if name in other)


def _row(name: str, one: WindowFigure, other: WindowFigure, scale: float) -> ComparedFigure:
    """Return a figure of both; differences are relative to a scale."""
    errors = float(np.hypot(one.uncertainty, other.uncertainty))
    return ComparedFigure(
        name, one.unit, one.mean, other.mean, (one.scatter, other.scatter), abs(one.mean - other.mean) / scale,
        CONFIDENCE * errors / scale, not is_raw(name),
    )  # fmt: skip


def _angles(one: Steady, probe: str) -> np.ndarray:
    return np.asarray(np.angle(one.harmonics[probe].mean(axis=0)))


def _verdict(
    rows: tuple[ComparedFigure, ...], overlays: tuple[Overlay, ...], tolerance: float, word: str
) -> tuple[bool, str]:
    worst, where = -inf, ""
    for row in rows:
        if row.decides and row.difference > worst:
            worst, where = row.difference, row.name
    for one in overlays:
        if not is_raw(one.name) and one.rms > worst:
            worst, where = one.rms, f"waveform of {one.name}"
    if worst <= tolerance:
        return True, f"agree within {in_percent(worst)} ({word}; largest difference: {where})"
    far = max((one.rms for one in overlays), default=0.0) > FAR
    also = "; the waveforms are so far apart that these may be different branches of the same period" if far else ""
    return False, f"differ by {in_percent(worst)} in {where}, above {in_percent(tolerance)} ({word}){also}"


def _statistics(rows: tuple[ComparedFigure, ...], both: tuple[Steady, Steady], tolerance: float) -> tuple[bool, str]:
    fewest = min(one.windows for one in both)
    if fewest < FEWEST_WINDOWS:
        return False, (
            f"neither repeats, and {fewest} window of {min(one.periods for one in both)} forcing periods gives no "
            "scatter: nothing can be said; run longer"
        )
    outside = [row for row in rows if row.decides and row.difference > tolerance + row.allowed]
    windows = f"chaotic: statistics over {both[0].windows} and {both[1].windows} windows compared"
    if not outside:
        within = max(row.difference for row in rows if row.decides)
        return (
            True,
            f"{windows}; means agree within {in_percent(within)}, the tolerance and {CONFIDENCE:g} standard errors",
        )
    worst = max(outside, key=lambda row: row.difference - row.allowed)
    return False, (
        f"{windows}; {worst.name} differs by {in_percent(worst.difference)}, more than {in_percent(tolerance)} and "
        f"{CONFIDENCE:g} standard errors of {in_percent(worst.allowed / CONFIDENCE)}"
    )


def _costs(a: Results, b: Results) -> tuple[tuple[str, Any, Any], ...]:
    def of(table: str, key: str) -> tuple[Any, Any]:
        return tuple((one.summary.get(table) or {}).get(key) for one in (a, b))  # type: ignore[return-value]

    rows = [("wall time, total (s)", *of("wall_time", "total")), ("wall time, march (s)", *of("wall_time", "march"))]
    rows += [("wall time of a step (s)", *of("wall_time", "per_step")), ("steps", *of("convergence", "steps"))]
    rows += [("degrees of freedom", *of("model", "dofs")), ("energy residual", *of("energy", "relative_residual"))]
    return tuple(row for row in rows if row[1] is not None or row[2] is not None)
