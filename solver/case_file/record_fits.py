"""Contradictions between the records of a case and the rest of it; the files are read for that."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from math import ceil

from solver.case import Case
from solver.case_file.faults import Fault
from solver.case_file.places import Loads
from solver.case_tables.recorded import Recorded
from solver.case_tables.time import Time
from solver.loads.curve import Curve, curve_of
from solver.loads.record_file import GREATEST, RecordError
from solver.loads.recorded import ROUNDING, signal_of

MOST_ROWS = 20_000_000
"""That a run goes through, repeated ones included."""


def records_can_be_read(load: Loads) -> Iterator[Fault]:
    """The file of every recorded load holds a record."""
    for number, entry in load.items():
        if not isinstance(entry, Recorded):
            continue
        try:
            curve_of(entry)
        except RecordError as error:
            for fault in error.faults:
                yield replace(fault, key=("load", number, *fault.key))


def records_fit_the_run(time: Time, load: Loads) -> Iterator[Fault]:
    """Records cover the run, are not scaled beyond all reason, and leave the base motion an acceleration."""
    for number, entry in load.items():
        if not isinstance(entry, Recorded):
            continue
        try:
            curve = curve_of(entry)
        except RecordError:
            continue
        peak = signal_of(entry).peak
        if not peak <= GREATEST and abs(entry.scale) <= GREATEST:
            key = ("load", number, "scale")
            yield Fault(key, f"{entry.scale:g}, which makes a peak of {peak:.3g}", f"a peak of at most {GREATEST:g}")
        if getattr(entry, "quantity", "") == "displacement" and entry.interpolation == "monotone":
            yield Fault(
                ("load", number, "interpolation"),
                "monotone, of a displacement",
                "cubic: the second derivative of the others jumps at every row",
                'interpolation = "cubic"',
                (("load", number, "quantity"),),
            )
        yield from _span_faults(number, entry, curve, time)


def _span_faults(number: int, entry: Recorded, curve: Curve, time: Time) -> Iterator[Fault]:
    shift = 0.0 if entry.start is None else entry.start - curve.first
    end = time.end if time.step == "auto" else max(time.end, round(time.end / time.step) * time.step)
    first, last = curve.first, curve.first + curve.span
    if entry.beyond == "repeat":
        rows = len(curve.knots) * max(1, ceil(max(end, entry.ramp) / curve.span))
        if rows > MOST_ROWS:
            yield Fault(
                ("load", number, "beyond"),
                f"repeat, of {len(curve.knots)} rows over {curve.span:.3g} s until {end:g} s: {rows:.3g} rows",
                f"at most {MOST_ROWS}",
                "a record of more than one period of the signal, or fewer rows",
                (("time", "end"),),
            )
        return
    if shift < -end or shift > curve.span:
        yield Fault(
            ("load", number, "start"),
            f"{entry.start:g} s: the run of {end:g} s sees nothing of the record",
            f"a time in the record, which goes from {first:.9g} to {last:.9g} s",
            "leave start out to start at the first row",
            (("time", "end"),),
        )
        return
    if entry.beyond == "zero":
        return
    slack = ROUNDING * curve.span
    if shift < -slack:
        yield Fault(
            ("load", number, "start"),
            f"{entry.start:g} s, before the first row at {first:.9g} s",
            "a time in the record",
            'leave start out, or beyond = "zero"',
        )
    if shift + end > curve.span + slack:
        begin = first + shift
        yield Fault(
            ("time", "end"),
            f"{time.end:g} s, and the record of the load {entry.name} ends {last - begin:.9g} s after the start",
            f"at most that, or `beyond` given: the record goes from {first:.9g} to {last:.9g} s",
            _remedy(entry, curve, end, shift),
            (("load", number, "file"),),
        )


def _remedy(entry: Recorded, curve: Curve, end: float, shift: float) -> str:
    remedies = f'end = {float(f"{curve.span - shift:.9g}")!r}, or beyond = "zero" or "repeat" in [[load]] {entry.name}'
    if (shift + end) > 500.0 * curve.span:
        return f"are the times in another unit than s? Else {remedies}"
    return remedies


def with_checksums(case: Case) -> Case:
    """Return a case whose records have the checksums of their files.

    Raises:
        RecordError: The file of a recorded load cannot be used, or is another one than its checksum tells.
    """
    if not any(isinstance(load, Recorded) for load in case.load):
        return case
    loads = tuple(
        load.model_copy(update={"checksum": curve_of(load).checksum}) if isinstance(load, Recorded) else load
        for load in case.load
    )
    return case.model_copy(update={"load": loads})
