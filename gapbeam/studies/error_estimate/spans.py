"""The spans of a run over which figures are taken, and the windows in them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import floor

from gapbeam.solver.case.case import Case
from gapbeam.solver.loads.forcing import forcing_frequencies
from gapbeam.studies.error_estimate.motion_record import MotionRecord

WHOLE_RUN, SETTLED = "whole run", "settled part"
UP_TO_HORIZON, BEYOND_HORIZON = "up to the horizon", "beyond the horizon"
PERIODS = 12  # of the forcing, in a window: whole cycles of 1, 2, 3, 4, 6 and 12 periods
FEWEST_PERIODS = 4  # in a run, or there is no settled part
FEWEST_WINDOWS = 4  # of which a standard error is taken
FEWEST, FEWEST_RECORDS = 2, 8  # records in a span: at all, and up to the horizon, where some steps say nothing
ALL = 0.999  # of the time of a run: what ends earlier is a part of it
_WHOLE = 1.0e-6


@dataclass(frozen=True)
class Span:
    """Part of a motion, in windows of equal length.

    Attributes:
        name: "whole run", "first part", "start-up", "settled part", UP_TO_HORIZON or BEYOND_HORIZON.
        start: s.
        width: Of a window, s.
        count: Number of windows.
        frequency: Of the forcing, Hz, where the windows are whole periods of it; None: no harmonics.
    """

    name: str
    start: float
    width: float
    count: int
    frequency: float | None = None

    @property
    def predictable(self) -> bool:
        """Whether it lies before the horizon."""
        return self.name != BEYOND_HORIZON

    @property
    def end(self) -> float:
        """End of the last window, s."""
        return self.start + self.count * self.width

    def windows(self, motion: MotionRecord) -> Iterator[MotionRecord]:
        """Yield the motion window by window."""
        for number in range(self.count):
            begin = self.start + number * self.width
            yield motion.between(begin, begin + self.width)


def spans_of(case: Case, end: float, interval: float, horizon: float | None, repeats: bool = False) -> list[Span]:
    """Return the spans of a run.

    A run under one forcing frequency, at least four periods long, has a start-up and a settled part, which begins
    after the smooth start of the loads and in the middle of the run at the earliest; windows of the settled part are
    12 forcing periods long, or a quarter of it where it is shorter. Other runs are taken as a whole; where the records
    end before the case does, as those of slow companions, they are the first part. What lies beyond
    the horizon is a span of its own; so few windows lie there at times that its figures have no error. What lies before
    it is none where there are fewer than eight records.

    Args:
        case: The case.
        end: Of the records, s.
        interval: Between records, s.
        horizon: Up to where the motion is predictable, s; None: up to the end.
        repeats: The settled part is periodic: its figures can be predicted, whatever the horizon is.
    """
    frequencies = forcing_frequencies(case.load)
    rise = max((load.rise_time for load in case.load), default=0.0)
    frequency = frequencies[0] if len(frequencies) == 1 else None
    return spans_between(end, case.time.end, frequency, rise, interval, horizon, repeats)


def spans_between(
    end: float, last: float, frequency: float | None, rise: float, interval: float, horizon: float | None,
    repeats: bool = False,
) -> list[Span]:  # fmt: skip
    """Return the spans of a motion; see `spans_of`.

    Args:
        end: Of the records, s.
        last: Up to where the run goes, s.
        frequency: Of the forcing, Hz; None: it has none, or several.
        rise: Smooth start of the loads, s.
        interval: Between records, s.
        horizon: Up to where the motion is predictable, s; None: up to the end.
        repeats: The settled part is periodic: its figures can be predicted, whatever the horizon is.
    """
    known = end if horizon is None else horizon
    least = FEWEST if horizon is None else FEWEST_RECORDS
    if frequency is None or end * frequency < FEWEST_PERIODS:
        everything = WHOLE_RUN if end > ALL * last - interval else "first part"
        whole = everything if horizon is None else UP_TO_HORIZON
        return [Span(whole, 0.0, known, 1)] if known > least * interval else []
    settled = floor((end - max(rise, 0.5 * end)) * frequency + _WHOLE) or 1
    periods = min(PERIODS, max(1, settled // FEWEST_WINDOWS))
    count, width = settled // periods, periods / frequency
    begin = end - count * width
    spans = []
    first = min(begin, known)
    if first > (FEWEST if known >= begin else FEWEST_RECORDS) * interval:
        spans.append(Span("start-up" if known >= begin else UP_TO_HORIZON, 0.0, first, 1))
    predictable = count if repeats else max(0, min(count, floor((known - begin) / width + _WHOLE)))
    if predictable:
        spans.append(Span(SETTLED, begin, width, predictable, frequency))
    if predictable < count:
        beyond = begin + predictable * width
        spans.append(Span(BEYOND_HORIZON, beyond, width, count - predictable, frequency))
    return spans
