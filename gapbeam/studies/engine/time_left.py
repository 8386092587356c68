"""How long a study still takes, from what it has done: nothing is said before anything is done."""

from __future__ import annotations

import time
from collections.abc import Callable
from math import sqrt


class TimeLeft:
    """Estimates the time left of work that several workers share.

    The points that are done and those that are under way count: the mean time of a point is estimated by the time that
    all workers have spent over the number of points that are done. It is the estimate of the mean of exponential times
    where some are cut off (Epstein and Sobel, J. Am. Stat. Assoc. 48 (1953), 486), so that quick points, which are
    done first, do not make the rest look quick. With n points done its standard deviation is 1/sqrt(n) of it.

    Args:
        clock: Returns the time, s.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._begin: tuple[float, int] | None = None

    def words(self, done: int, total: int | None) -> str:
        """Return the time left in words, or "" where nothing is known; the first call starts the clock.

        Args:
            done: Points that are done; those of the first call were done before.
            total: All points; None: nobody knows.
        """
        if self._begin is None:
            self._begin = self._clock(), done
        fresh = done - self._begin[1]
        if total is None or fresh < 1 or done >= total:
            return ""
        left = (self._clock() - self._begin[0]) * (total - done) / fresh
        spread = 1.0 / sqrt(fresh)
        if spread < 0.25:
            return f"about {duration_words(left)} left"
        return f"{duration_words(left / (1.0 + spread))} to {duration_words(left * (1.0 + spread))} left"


def duration_words(seconds: float) -> str:
    """Return a time with a unit that one reads: s, min or h."""
    if seconds < 100.0:
        return f"{max(seconds, 1.0):.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 6000.0 else f"{seconds / 3600.0:.1f} h"
