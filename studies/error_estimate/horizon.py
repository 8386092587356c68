"""How long a motion can be predicted, and the spans of a run over which figures are taken."""

from __future__ import annotations

from collections.abc import Iterable
from math import floor

import numpy as np

from gapbeam.solver.case.case import Case
from gapbeam.solver.loads.forcing import forcing_frequencies
from gapbeam.solver.system.operators import Array
from gapbeam.studies.error_estimate.key_figures import ACCELERATION_WINDOW, BEYOND_HORIZON, UP_TO_HORIZON, Span
from gapbeam.studies.error_estimate.motion_record import MotionRecord, window_means

APART = 0.03  # of the range of the motion: beyond, two motions have parted
PERIODS = 12  # of the forcing, in a window: whole cycles of 1, 2, 3, 4, 6 and 12 periods
FEWEST_PERIODS = 4  # in a run, or there is no settled part
FEWEST_WINDOWS = 4  # of which a standard error is taken
FEWEST, FEWEST_RECORDS = 2, 8  # records in a span: at all, and up to the horizon, where some steps say nothing
ALL = 0.999  # of the time of a run: what ends earlier is a part of it
_WHOLE = 1.0e-6


def horizon_of(motion: MotionRecord, others: Iterable[MotionRecord]) -> float | None:
    """Return the first time at which another motion has left a motion by 3 % of its range, s; None: none does.

    The displacements of the probes are compared, without those of the start; without probes 2.5 ms means of the
    contact forces are.
    """
    found = []
    mine = _waves(motion)
    spans = motion.spans if motion.probes else np.ptp(mine, axis=0)
    for other in others:
        theirs = _waves(other)
        count = min(len(mine), len(theirs))
        apart = np.abs(theirs[:count] - mine[:count]) > APART * spans
        parted = np.flatnonzero(np.any(apart & (spans > 0.0), axis=1))
        if parted.size:
            found.append(float(motion.times[parted[0]]))
    return min(found, default=None)


def _waves(motion: MotionRecord) -> Array:
    if not motion.probes:
        return window_means(motion.impulse, motion.interval, ACCELERATION_WINDOW)
    return np.asarray(motion.displacement - motion.displacement[0])


def spans_of(case: Case, end: float, interval: float, horizon: float | None) -> list[Span]:
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
    """
    frequencies = forcing_frequencies(case.load)
    known = end if horizon is None else horizon
    least = FEWEST if horizon is None else FEWEST_RECORDS
    if len(frequencies) != 1 or end * frequencies[0] < FEWEST_PERIODS:
        everything = "whole run" if end > ALL * case.time.end - interval else "first part"
        whole = everything if horizon is None else UP_TO_HORIZON
        return [Span(whole, 0.0, known, 1)] if known > least * interval else []
    frequency = frequencies[0]
    rise = max((load.rise_time for load in case.load), default=0.0)
    settled = floor((end - max(rise, 0.5 * end)) * frequency + _WHOLE) or 1
    periods = min(PERIODS, max(1, settled // FEWEST_WINDOWS))
    count, width = settled // periods, periods / frequency
    begin = end - count * width
    spans = []
    first = min(begin, known)
    if first > (FEWEST if known >= begin else FEWEST_RECORDS) * interval:
        spans.append(Span("start-up" if known >= begin else UP_TO_HORIZON, 0.0, first, 1))
    predictable = max(0, min(count, floor((known - begin) / width + _WHOLE)))
    if predictable:
        spans.append(Span("settled part", begin, width, predictable, frequency))
    if predictable < count:
        beyond = begin + predictable * width
        spans.append(Span(BEYOND_HORIZON, beyond, width, count - predictable, frequency))
    return spans
