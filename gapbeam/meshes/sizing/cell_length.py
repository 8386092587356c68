"""The cell length along the beam that is wanted at x: small where contact carries, larger away from it."""

from __future__ import annotations

import math
from bisect import bisect_left
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

GROWTH = 1.25
"""Ratio of the lengths of two neighboring cells while they grow."""

SLOPE = math.log(GROWTH)


@dataclass(frozen=True)
class CellLength:
    """Wanted cell length h(x), continuous and with a slope of at most log(GROWTH).

    h(x) is the smallest of the region's length and of size + log(GROWTH) |x - position| over all sources.

    Attributes:
        regions: (end, length) of consecutive regions from x = 0 on.
        sources: (position, size): at the position the length is at most this size.
    """

    regions: tuple[tuple[float, float], ...]
    sources: tuple[tuple[float, float], ...] = ()

    def __call__(self, x: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """The length wanted at each x, shape of x."""
        positions = np.asarray(x, dtype=np.float64)
        ends, lengths = np.array(self.regions).T
        region = np.minimum(np.searchsorted(ends, positions), len(ends) - 1)
        wanted = lengths[region]
        if positions.ndim == 0 and self.sources:
            places, sizes = np.array(self.sources).T
            return np.asarray(np.minimum(wanted, np.min(sizes + SLOPE * np.abs(positions - places))))
        for position, size in self.sources:
            wanted = np.minimum(wanted, size + SLOPE * np.abs(positions - position))
        return np.asarray(wanted, dtype=np.float64)

    def between(self, low: float, high: float) -> CellLength:
        """The same from one place to another, without the regions and sources that say nothing there."""
        ends = [end for end, _ in self.regions]
        first, last = (min(bisect_left(ends, x), len(ends) - 1) for x in (low, high))
        regions = self.regions[first : last + 1]
        longest = max(length for _, length in regions)
        near = [
            (position, size)
            for position, size in self.sources
            if size + SLOPE * max(low - position, position - high, 0.0) < longest
        ]
        return CellLength(regions, tuple(near))

    @property
    def smallest(self) -> float:
        """The smallest length that is wanted anywhere."""
        return min(size for _, size in (*self.regions, *self.sources))

    def ending_at(self, breakpoints: npt.ArrayLike) -> CellLength:
        """The same, no longer at a breakpoint than the distance to the next one."""
        x = [float(end) for end in np.asarray(breakpoints, dtype=np.float64)]
        return self.with_sources([(end, b - a) for a, b in pairwise(x) for end in (a, b)])

    def with_sources(self, sources: list[tuple[float, float]]) -> CellLength:
        """The same with further sources."""
        return CellLength(self.regions, (*self.sources, *sources))
