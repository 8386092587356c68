"""The part of a record that figures enlarge: its last forcing periods, or, without any, where most happens."""

from __future__ import annotations

import numpy as np

SHARE = 0.1
"""Share of the record that is enlarged where nothing repeats."""

LEAD = 0.1
"""Share of the enlarged part before the part where most happens, to show its onset."""


def enlarged_span(time: np.ndarray, values: np.ndarray, frequency: float | None, periods: int) -> tuple[float, float]:
    """Return the start and end of the part, s.

    Without forcing it is the tenth of the record with the largest int (x - median x)^2 dt, and a little before it: a
    shock is shown where it happens.

    Args:
        time: Time of the record, (n,), s.
        values: Measure of the activity, (n,), in any unit.
        frequency: Frequency of the forcing, Hz; None without forcing.
        periods: Number of forcing periods.
    """
    first, last = float(time[0]), float(time[-1])
    if frequency is not None:
        return last - min(last - first, periods / frequency), last
    width = SHARE * (last - first)
    power = (values - np.median(values)) ** 2
    energy = np.concatenate([[0.0], np.cumsum(0.5 * (power[1:] + power[:-1]) * np.diff(time))])
    starts = time[time <= last - width]
    if not starts.size or not energy[-1] > 0.0:
        return last - width, last
    found = np.interp(starts + width, time, energy) - np.interp(starts, time, energy)
    start = max(first, float(starts[np.argmax(found)]) - LEAD * width)
    return start, start + width


def unit_of_time(span: tuple[float, float]) -> tuple[str, float]:
    """Return the unit of the time axis of the part, and the number of these units in a second."""
    end = abs(span[1])
    return ("s", 1.0) if end >= 10.0 else ("ms", 1e3) if end >= 0.01 or end == 0.0 else ("µs", 1e6)
