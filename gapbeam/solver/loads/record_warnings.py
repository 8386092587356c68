"""Records that are too coarse for their motion or for the run, that jump, or that look like another unit."""

from __future__ import annotations

from collections.abc import Iterator

from gapbeam.solver.loads.recorded_function import MOST_POWER, RecordedSignal
from gapbeam.solver.loads.recorded_table import RecordedTable
from gapbeam.solver.wording.compared_numbers import apart, exceeds

EDGE = 0.8
"""Of half the sampling rate, above which a record that was filtered before it was sampled holds little."""
LITTLE = 0.01
"""Of the power of a record, or of its peak."""
MOST_OVERSHOOT = 0.05
"""Of the range of the rows."""
LONG = 500.0
"""Times the run: a record that looks as if its times were in ms."""
FEW, ENOUGH = 20, 50
"""Steps in a period."""


def curve_warnings(load: RecordedTable, signal: RecordedSignal) -> Iterator[str]:
    """Yield a record that is 0, or a curve that goes far beyond its rows."""
    if signal.peak == 0.0:
        yield "is 0 all the time: it does nothing"
    if signal.curve.overshoot > MOST_OVERSHOOT and load.interpolation == "cubic":
        yield (
            f"goes {signal.curve.overshoot:.0%} of its range beyond its rows between them: it jumps, or rows are too "
            'few; interpolation = "monotone" keeps within'
        )


def row_warnings(signal: RecordedSignal) -> Iterator[str]:
    """Yield rows that are too far apart for what they hold."""
    half = 0.5 / signal.curve.interval
    share = signal.content.above(EDGE * half)
    if signal.peak > 0.0 and share > LITTLE:
        yield (
            f"has {share:.2g} of its power above {EDGE * half:.4g} Hz, close to half its sampling rate of "
            f"{2.0 * half:.4g} Hz: sampled too slowly, or without a filter, it holds aliases or noise; "
            "record it faster, or filter it"
        )


def end_warnings(load: RecordedTable, signal: RecordedSignal, end: float) -> Iterator[str]:
    """Yield a record that is far longer than the run, or that jumps where it starts or ends."""
    curve, limit = signal.curve, LITTLE * signal.peak
    if curve.span > LONG * end:
        times = f"{curve.span / end:.3g} times the run"
        yield f"lasts {curve.span:.4g} s, {times}: are its times in ms? Then time_scale = 1e-3"
    if exceeds(load.ramp, end):
        yield "ramp = {} is longer than the run, {} s".format(*apart(load.ramp, end))
    if load.ramp == 0.0 and signal.shift >= 0.0 and abs(first := signal.value(0.0)) > limit:
        yield f"starts with a jump to {first:.3g}, and its peak is {signal.peak:.3g}; a ramp softens it"
    if load.beyond == "zero":
        if signal.shift < 0.0 and abs(first := signal.value(-signal.shift)) > limit:
            yield f"starts with a jump to {first:.3g} at t = {-signal.shift:.4g} s"
        if signal.last < end and abs(last := signal.value(signal.last)) > limit:
            yield f"ends with a jump from {last:.3g} to 0 at t = {signal.last:.4g} s"


def step_warnings(signal: RecordedSignal, step: float) -> Iterator[str]:
    """Yield a step that is too long for the rows, or for the frequencies of a record."""
    if signal.peak == 0.0:
        return
    frequency, lost = signal.content.below(MOST_POWER), signal.content.above(0.5 / step)
    if exceeds(step, signal.curve.interval) and lost > LITTLE:
        yield (
            f"longer than the {apart(step, signal.curve.interval)[1]} s between rows, and {lost:.2g} of the power "
            f"above the {0.5 / step:.4g} Hz that steps can show: the march takes aliases of the load {signal.name}"
        )
    elif frequency * step > 1.0 / FEW:
        yield (
            f"{1.0 / (frequency * step):.3g} steps in a period of {frequency:.4g} Hz, and {ENOUGH} are good; below lie "
            f"{MOST_POWER:.0%} of the power of the load {signal.name}"
        )
