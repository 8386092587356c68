"""Records that are too coarse for their motion or for the run, that jump, or that look like another unit."""

from __future__ import annotations

from collections.abc import Iterator

from solver.case import Case, OfSupport
from solver.case_tables.recorded import Recorded
from solver.loads.recorded import MOST_POWER, RecordedSignal, signal_of

EDGE = 0.8
"""Of half the sampling rate, above which a record that was filtered before it was sampled holds little."""
LITTLE = 0.01
"""Of the power of a record, or of its peak."""
MOST_OVERSHOOT = 0.05
"""Of the range of the rows."""
LONG = 500.0
"""Times the run: a record that looks as if its times were in ms."""
HARDEST = 1.0e4
"""Usual acceleration of a support, m/s^2."""
FEW, ENOUGH = 20, 50
"""Steps in a period."""


def records(case: Case) -> Iterator[str]:
    """Yield what is worth a second look in the records of a case."""
    for number, load in enumerate(case.load, 1):
        if not isinstance(load, Recorded):
            continue
        place, signal = f'[[load]] number {number} (name "{load.name}")', signal_of(load)
        for line in (*_values(load, signal), *_rows(signal), *_ends(load, signal, case.time.end)):
            yield f"{place} {line}"
        if case.time.step != "auto":
            for line in _steps(signal, case.time.step):
                yield f"[time] step = {case.time.step:g}: {line} the load {load.name}"


def _values(load: Recorded, signal: RecordedSignal) -> Iterator[str]:
    if signal.peak == 0.0:
        yield "is 0 all the time: it does nothing"
    elif isinstance(load, OfSupport) and signal.peak > HARDEST:
        yield f"shakes the support with {signal.peak:.3g} m/s^2, over 1000 g: are scale and time_scale right?"
    if signal.curve.overshoot > MOST_OVERSHOOT and load.interpolation == "cubic":
        yield (
            f"goes {signal.curve.overshoot:.0%} of its range beyond its rows between them: it jumps, or rows are too "
            'few; interpolation = "monotone" keeps within'
        )


def _rows(signal: RecordedSignal) -> Iterator[str]:
    half = 0.5 / signal.curve.interval
    share = signal.content.above(EDGE * half)
    if signal.peak > 0.0 and share > LITTLE:
        yield (
            f"has {share:.2g} of its power above {EDGE * half:.4g} Hz, close to half its sampling rate of "
            f"{2.0 * half:.4g} Hz: sampled too slowly, or without a filter, it holds aliases or noise; "
            "record it faster, or filter it"
        )


def _ends(load: Recorded, signal: RecordedSignal, end: float) -> Iterator[str]:
    curve, limit = signal.curve, LITTLE * signal.peak
    if curve.span > LONG * end:
        times = f"{curve.span / end:.3g} times the run"
        yield f"lasts {curve.span:.4g} s, {times}: are its times in ms? Then time_scale = 1e-3"
    if load.ramp > end:
        yield f"ramp = {load.ramp:g} is longer than the run, {end:g} s"
    if load.ramp == 0.0 and signal.shift >= 0.0 and abs(first := signal.value(0.0)) > limit:
        yield f"starts with a jump to {first:.3g}, and its peak is {signal.peak:.3g}; a ramp softens it"
    if load.beyond == "zero":
        if signal.shift < 0.0 and abs(first := signal.value(-signal.shift)) > limit:
            yield f"starts with a jump to {first:.3g} at t = {-signal.shift:.4g} s"
        if signal.last < end and abs(last := signal.value(signal.last)) > limit:
            yield f"ends with a jump from {last:.3g} to 0 at t = {signal.last:.4g} s"


def _steps(signal: RecordedSignal, step: float) -> Iterator[str]:
    if signal.peak == 0.0:
        return
    frequency, lost = signal.content.below(MOST_POWER), signal.content.above(0.5 / step)
    if step > signal.curve.interval and lost > LITTLE:
        yield (
            f"longer than the {signal.curve.interval:.4g} s between rows, and {lost:.2g} of the power above the "
            f"{0.5 / step:.4g} Hz that steps can show: the march takes aliases of"
        )
    elif frequency * step > 1.0 / FEW:
        yield (
            f"{1.0 / (frequency * step):.3g} steps in a period of {frequency:.4g} Hz, and {ENOUGH} are good; below lie "
            f"{MOST_POWER:.0%} of the power of"
        )
