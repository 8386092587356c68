"""What is wrong with a record by itself and in a run; the file is read for that."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from math import ceil

from gapbeam.solver.faults import Fault, Key
from gapbeam.solver.loads.record_curve import RecordCurve, curve_of, holes_between
from gapbeam.solver.loads.record_file import GREATEST, RecordError
from gapbeam.solver.loads.recorded_function import ROUNDING, signal_of
from gapbeam.solver.loads.recorded_table import RecordedTable
from gapbeam.solver.wording.short_words import either

MOST_ROWS = 20_000_000
"""That a run goes through, repeated ones included."""


def file_faults(load: RecordedTable, key: Key) -> Iterator[Fault]:
    """Yield what is wrong with the file of a load.

    Args:
        load: The load.
        key: The way to its table in the case.
    """
    try:
        curve_of(load)
    except RecordError as error:
        for fault in error.faults:
            yield replace(fault, key=(*key, *fault.key))


def run_faults(load: RecordedTable, key: Key, end: float, step: float | None) -> Iterator[Fault]:
    """Yield a record that does not cover the run, or is scaled beyond all reason.

    Args:
        load: The load.
        key: The way to its table in the case.
        end: End of the run, s.
        step: Time step, s; None: computed later.
    """
    try:
        curve = curve_of(load)
    except RecordError:
        return
    yield from _hole_faults(load, key, curve)
    peak = signal_of(load).peak
    if not peak <= GREATEST and abs(load.scale) <= GREATEST:
        found = f"{load.scale:g}, which makes a peak of {peak:.3g}"
        yield Fault((*key, "scale"), found, f"a peak of at most {GREATEST:g}")
    yield from _span_faults(load, key, curve, end, step)


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
                f"repeat, of {len(curve.knots)} rows over {curve.span:.3g} s until {end:g} s: {rows:.3g} rows",
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
