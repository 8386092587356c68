"""Recorded loads: functions of time from a file, with the checks and warnings of their records.

Records are refused or questioned where they are too coarse for their motion or for the run, jump, or look like another
unit.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from math import ceil
from typing import ClassVar, Self

from gapbeam.solver.loads.load_table import RecordedTable
from gapbeam.solver.loads.record_file import GREATEST, RecordError
from gapbeam.solver.loads.recorded_function import (
    MOST_POWER,
    ROUNDING,
    RecordCurve,
    curve_of,
    holes_between,
    signal_of,
)
from gapbeam.solver.loads.time_function import TimeFunction
from gapbeam.solver.messages.errors import Fault, Key
from gapbeam.solver.messages.wording import apart, counted, either, exceeds

MOST_ROWS = 20_000_000
"""Most rows that a run goes through, repeated ones included."""


def _hole_faults(load: RecordedTable, key: Key, curve: RecordCurve) -> Iterator[Fault]:
    """Yield a filled hole at whose ends a derivative that the load needs does not exist."""
    if load.derivatives == 0 or len(holes_between(curve.knots)) == 0:
        return
    fits = {"spline": 2, "linear": 1}
    if load.derivatives > fits.get(load.holes, 2 if load.holes == "refuse" else 0):
        possible = [name for name, most in fits.items() if most >= load.derivatives]
        yield Fault(
            (*key, "holes"),
            f"{load.holes}, of a motion that jumps or bends at the ends of its holes",
            f"{either(possible)}: the motion is differentiated in time",
            f'holes = "{possible[0]}"',
            ((*key, "file"),),
        )


def _span_faults(
    load: RecordedTable, key: Key, curve: RecordCurve, given: float, step: float | None
) -> Iterator[Fault]:
    shift = 0.0 if load.start is None else load.start - curve.first
    end = given if step is None else max(given, round(given / step) * step)
    first, last = curve.first, curve.first + curve.span
    if load.beyond == "repeat":
        rows = len(curve.knots) * max(1, ceil(max(end, load.ramp) / curve.span))
        if rows > MOST_ROWS:
            yield Fault(
                (*key, "beyond"),
                f"repeat, of {counted(len(curve.knots), 'row')} over {curve.span:.3g} s until {end:g} s: {rows:.3g} "
                "rows",
                f"at most {MOST_ROWS}",
                "a record of more than one period of the signal, or fewer rows",
                (("time", "end"),),
            )
        return
    if shift < -end or shift > curve.span:
        yield Fault(
            (*key, "start"),
            f"{load.start:g} s: the run of {end:g} s sees nothing of the record",
            f"a time in the record, which goes from {first:.9g} to {last:.9g} s",
            "leave start out to start at the first row",
            (("time", "end"),),
        )
        return
    if load.beyond == "zero":
        return
    slack = ROUNDING * curve.span
    if shift < -slack:
        yield Fault(
            (*key, "start"),
            f"{load.start:g} s, before the first row at {first:.9g} s",
            "a time in the record",
            'leave start out, or beyond = "zero"',
        )
    if shift + end > curve.span + slack:
        begin = first + shift
        yield Fault(
            ("time", "end"),
            f"{given:g} s, and the record of the load {load.name} ends {last - begin:.9g} s after the start",
            f"at most that, or `beyond` given: the record goes from {first:.9g} to {last:.9g} s",
            _remedy(load, curve, end, shift),
            ((*key, "file"),),
        )


def _remedy(load: RecordedTable, curve: RecordCurve, end: float, shift: float) -> str:
    remedies = f'end = {float(f"{curve.span - shift:.9g}")!r}, or beyond = "zero" or "repeat" in [[load]] {load.name}'
    if (shift + end) > 500.0 * curve.span:
        return f"are the times in another unit than s? Else {remedies}"
    return remedies


EDGE = 0.8
"""Share of half the sampling rate, above which a record that was filtered before sampling holds little."""
LITTLE = 0.01
"""Share of the power of a record, or of its peak, that counts as little."""
MOST_OVERSHOOT = 0.05
"""Largest overshoot over the range of the rows."""
UNEVEN = 2.0
"""Mean interval over the shortest, from which on rows are corners of a curve, without a sampling rate."""
LONG = 500.0
"""Times the run: a record that looks as if its times were in ms."""
FEW, ENOUGH = 20, 50
"""Steps in a period."""


class RecordedLoad(RecordedTable):
    """A recorded load with its record."""

    forcing_frequency: ClassVar[None] = None  # no period is sought in a record

    def time_function(self) -> TimeFunction:
        """Return the curve through the rows of the record, scaled, or its derivative that is an acceleration.

        Raises:
            RecordError: The file cannot be used.
        """
        signal = signal_of(self)
        return TimeFunction(signal.value, signal.mean)

    @property
    def peak(self) -> float:
        """Largest size in the record, N or m/s^2."""
        return signal_of(self).peak

    @property
    def frequency_of_interest(self) -> tuple[float, str]:
        """The frequency below which 99 % of the power of the record lie, Hz."""
        origin = f"below which {MOST_POWER:.0%} of the power of the load {self.name} lie"
        return signal_of(self).content.below(MOST_POWER), origin

    def frequency_words(self, step: float) -> tuple[str, str]:
        """Return the frequency of interest, and the contents of the record."""
        signal = signal_of(self)
        curve, frequency = signal.curve, signal.content.below(MOST_POWER)
        words = (
            f"below which {MOST_POWER:.0%} of its power lie, {1.0 / (frequency * step):.4g} steps per period; "
            if frequency > 0.0
            else ""
        )
        words += (
            f"{counted(len(curve.knots), 'row')} over {curve.span:.6g} s, every {curve.interval:.4g} s; peak "
            f"{signal.peak:.4g}"
        )
        return f"{frequency:.4g} Hz", words

    def with_checksum(self) -> Self:
        """Return the load with the checksum of its file.

        Raises:
            RecordError: The file cannot be used, or is another one than its checksum says.
        """
        return self.model_copy(update={"checksum": curve_of(self).checksum})

    def faults(self, key: Key) -> Iterator[Fault]:
        """Yield the faults of the file."""
        try:
            curve_of(self)
        except RecordError as error:
            for fault in error.faults:
                yield replace(fault, key=(*key, *fault.key))

    def faults_in_run(self, key: Key, end: float, step: float | None) -> Iterator[Fault]:
        """Yield a record that does not cover the run, or is scaled beyond all reason."""
        try:
            curve = curve_of(self)
        except RecordError:
            return
        yield from _hole_faults(self, key, curve)
        peak = signal_of(self).peak
        if not peak <= GREATEST and abs(self.scale) <= GREATEST:
            found = f"{self.scale:g}, which makes a peak of {peak:.3g}"
            yield Fault((*key, "scale"), found, f"a peak of at most {GREATEST:g}")
        yield from _span_faults(self, key, curve, end, step)

    def unusual_values(self) -> Iterator[str]:
        """Yield the oddities of the record."""
        signal = signal_of(self)
        if signal.peak == 0.0:
            yield "is 0 all the time: it does nothing"
        if signal.curve.overshoot > MOST_OVERSHOOT and self.interpolation == "cubic":
            yield (
                f"goes {signal.curve.overshoot:.0%} of its range beyond its rows between them: it jumps, or rows are "
                'too few; interpolation = "monotone" keeps within'
            )
        half = float(signal.content.frequencies[-1])
        share = signal.content.above(EDGE * half)
        if signal.peak > 0.0 and share > LITTLE and signal.curve.interval < UNEVEN * signal.curve.closest:
            yield (
                f"has {share:.2g} of its power above {EDGE * half:.4g} Hz, close to half its sampling rate of "
                f"{2.0 * half:.4g} Hz: sampled too slowly, or without a filter, it holds aliases or noise; "
                "record it faster, or filter it"
            )

    def unusual_in_run(self, end: float) -> Iterator[str]:
        """Yield a record that is far longer than the run, or that jumps where it starts or ends."""
        signal = signal_of(self)
        curve, limit = signal.curve, LITTLE * signal.peak
        if curve.span > LONG * end:
            times = f"{curve.span / end:.3g} times the run"
            yield f"lasts {curve.span:.4g} s, {times}: are its times in ms? Then time_scale = 1e-3"
        yield from super().unusual_in_run(end)
        if self.ramp == 0.0 and signal.shift >= 0.0 and abs(first := signal.value(0.0)) > limit:
            yield f"starts with a jump to {first:.3g}, and its peak is {signal.peak:.3g}; a ramp softens it"
        if self.beyond == "zero":
            if signal.shift < 0.0 and abs(first := signal.value(-signal.shift)) > limit:
                yield f"starts with a jump to {first:.3g} at t = {-signal.shift:.4g} s"
            if signal.last < end and abs(last := signal.value(signal.last)) > limit:
                yield f"ends with a jump from {last:.3g} to 0 at t = {signal.last:.4g} s"

    def unusual_steps(self, step: float) -> Iterator[str]:
        """Yield a step that is too long for the record."""
        signal = signal_of(self)
        if signal.peak == 0.0:
            return
        frequency, lost = signal.content.below(MOST_POWER), signal.content.above(0.5 / step)
        if exceeds(step, signal.curve.closest) and lost > LITTLE:
            yield (
                f"longer than the {apart(step, signal.curve.closest)[1]} s between rows, and {lost:.2g} of the power "
                f"above the {0.5 / step:.4g} Hz that steps can show: the march takes aliases of the load {signal.name}"
            )
        elif frequency * step > 1.0 / FEW:
            yield (
                f"{1.0 / (frequency * step):.3g} steps in a period of {frequency:.4g} Hz, and {ENOUGH} are good; below "
                f"lie {MOST_POWER:.0%} of the power of the load {signal.name}"
            )
