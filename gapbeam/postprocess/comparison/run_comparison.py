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

from gapbeam.postprocess.comparison.waveform_overlay import (
    LONGEST,
    Overlay,
    Run,
    cycles_overlaid,
    is_raw,
    run_of,
    times_overlaid,
)
from gapbeam.postprocess.results.results import Results
from gapbeam.postprocess.signals.figure_names import LARGEST_FORCE
from gapbeam.postprocess.signals.periodicity import NOT_SETTLED
from gapbeam.postprocess.signals.signal import SignalError
from gapbeam.postprocess.signals.steady_figures import HARMONICS, Steady, WindowFigure, steady

FloatArray = np.ndarray

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
        name: Of the figure.
        unit: SI unit.
        a: Of the first run, the mean over its windows.
        b: Of the second run.
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
        phases: By probe, the phase of A minus that of B of every harmonic, rad.
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
    phases: dict[str, FloatArray]
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
    rows = _rows(both, probes)
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
    named = [
        [str(name) for name in one.history["probe"].values] if "probe" in one.history.coords else [] for one in (a, b)
    ]
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


def _rows(both: tuple[Steady, Steady], probes: tuple[str, ...]) -> tuple[ComparedFigure, ...]:
    shared = [name for name in both[0].quantities if name in both[1].quantities]
    rows = []
    for name in shared:
        one, other = (steady.quantities[name] for steady in both)
        probe = next((probe for probe in probes if name.startswith(f"{probe} harmonic ")), None)
        scale = max(abs(one.mean), abs(other.mean))
        if probe is not None:
            scale = max(s.quantities[f"{probe} harmonic {n}"].mean for s in both for n in range(1, HARMONICS + 1))
        elif name.endswith((f" {LARGEST_FORCE}", " impulse")):
            suffix = LARGEST_FORCE if name.endswith(LARGEST_FORCE) else "impulse"
            scale = max(s.quantities[key].mean for s in both for key in s.quantities if key.endswith(suffix))
        rows.append(_row(name, one, other, scale))
    return tuple(rows)


def _row(name: str, one: WindowFigure, other: WindowFigure, scale: float) -> ComparedFigure:
    """Return a figure of both; differences are relative to a scale."""
    errors = float(np.hypot(one.uncertainty, other.uncertainty))
    relative = abs(one.mean - other.mean) / scale if scale > 0.0 else 0.0
    allowed = CONFIDENCE * errors / scale if scale > 0.0 else 0.0
    return ComparedFigure(
        name, one.unit, one.mean, other.mean, (one.scatter, other.scatter), relative, allowed, not is_raw(name)
    )


def _angles(one: Steady, probe: str) -> FloatArray:
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
        return True, f"agree within {_percent(worst)} ({word}; largest difference: {where})"
    far = max((one.rms for one in overlays), default=0.0) > FAR
    also = "; the waveforms are so far apart that these may be different branches of the same period" if far else ""
    return False, f"differ by {_percent(worst)} in {where}, above {_percent(tolerance)} ({word}){also}"


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
            f"{windows}; means agree within {_percent(within)}, the tolerance and {CONFIDENCE:g} standard errors",
        )
    worst = max(outside, key=lambda row: row.difference - row.allowed)
    return False, (
        f"{windows}; {worst.name} differs by {_percent(worst.difference)}, "
        f"more than {_percent(tolerance)} and {CONFIDENCE:g} standard errors of {_percent(worst.allowed / CONFIDENCE)}"
    )


def _costs(a: Results, b: Results) -> tuple[tuple[str, Any, Any], ...]:
    def of(table: str, key: str) -> tuple[Any, Any]:
        return tuple((one.summary.get(table) or {}).get(key) for one in (a, b))  # type: ignore[return-value]

    rows = [("wall time, total (s)", *of("wall_time", "total")), ("wall time, march (s)", *of("wall_time", "march"))]
    rows += [("wall time of a step (s)", *of("wall_time", "per_step")), ("steps", *of("convergence", "steps"))]
    rows += [("degrees of freedom", *of("model", "dofs")), ("energy residual", *of("energy", "relative_residual"))]
    return tuple(row for row in rows if row[1] is not None or row[2] is not None)


def _percent(fraction: float) -> str:
    return f"{100 * fraction:.2g} %"
