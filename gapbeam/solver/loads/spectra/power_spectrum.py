"""Power spectrum: a one-sided density made of power laws between frequencies, and the power below a frequency.

    S(f) = S_i (f / f_i)^p_i,    p_i = ln(S_(i+1) / S_i) / ln(f_(i+1) / f_i),    f_i <= f <= f_(i+1)

A power law is a straight line where both axes are logarithmic. S is 0 below the first frequency and above the last.
Values on a grid of frequencies are smoothed over some of its intervals, so that filters made from them are short.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.special import exprel

from gapbeam.solver.system.operators import Array

HALVINGS = 60


@dataclass(frozen=True)
class PowerSpectrum:
    """A one-sided spectral density.

    Attributes:
        frequencies: Hz, ascending; the first may be 0 where the density does not change up to the second.
        densities: At these, positive, in the square of the unit of the load over Hz.
    """

    frequencies: tuple[float, ...]
    densities: tuple[float, ...]

    def __hash__(self) -> int:
        return self._hash

    @property
    def low(self) -> float:
        """Lowest frequency, Hz."""
        return self.frequencies[0]

    @property
    def high(self) -> float:
        """Highest frequency, Hz."""
        return self.frequencies[-1]

    @cached_property
    def total(self) -> float:
        """Integral over all frequencies: the mean square."""
        return float(self.power_below(np.array([self.high]))[0])

    @property
    def rms(self) -> float:
        """Root of the mean square, in the unit of the load."""
        return float(np.sqrt(self.total))

    def density(self, frequencies: Array) -> Array:
        """Return S at frequencies, Hz, (count,)."""
        inside = (frequencies >= self.low) & (frequencies <= self.high)
        place, first, slope = self._segment(np.clip(frequencies, self.low, self.high))
        return np.asarray(np.where(inside, np.array(self.densities)[place] * np.exp(slope * first), 0.0))

    def power_below(self, frequencies: Array) -> Array:
        """Return the integral of S from 0 to each of some frequencies, Hz, (count,)."""
        clipped = np.clip(frequencies, self.low, self.high)
        place, first, slope = self._segment(clipped)
        return np.asarray(self._sums[place] + self._gained(place, clipped, first, slope))

    def below(self, share: float) -> float:
        """Return the frequency below which a share of the power lies, Hz."""
        low, high = self.low, self.high
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            if float(self.power_below(np.array([middle]))[0]) < share * self.total:
                low = middle
            else:
                high = middle
        return high

    @cached_property
    def _hash(self) -> int:
        return hash((self.frequencies, self.densities))

    @cached_property
    def _logarithms(self) -> tuple[Array, Array, Array]:
        """Frequencies, (count,), ln(f_(i+1) / f_i) and slopes of the segments, (count - 1,)."""
        f, s = np.array(self.frequencies), np.array(self.densities)
        flat = f[:-1] == 0.0
        widths = np.log(f[1:] / np.where(flat, f[1:], f[:-1]))
        slopes = np.divide(np.log(s[1:] / s[:-1]), widths, out=np.zeros(len(widths)), where=~flat)
        return f, widths, slopes

    @cached_property
    def _sums(self) -> Array:
        """Power below the start of each segment, (count - 1,)."""
        f, widths, slopes = self._logarithms
        place = np.arange(len(widths))
        return np.concatenate([[0.0], np.cumsum(self._gained(place, f[1:], widths, slopes))[:-1]])

    def _segment(self, frequencies: Array) -> tuple[Any, Array, Array]:
        """Return segments, ln(f / f_i) in them and their slopes, each (count,)."""
        f, _, slopes = self._logarithms
        place = np.clip(np.searchsorted(f, frequencies, side="right") - 1, 0, len(f) - 2)
        starts = f[place]
        ratio = np.divide(frequencies, starts, out=np.ones(len(frequencies)), where=starts > 0.0)
        return place, np.asarray(np.log(ratio)), slopes[place]

    def _gained(self, place: Any, frequencies: Array, logarithm: Array, slope: Array) -> Array:
        """Return the integral from the start of a segment to a frequency in it, (count,)."""
        starts, heights = np.array(self.frequencies)[place], np.array(self.densities)[place]
        curved = starts * logarithm * exprel((slope + 1.0) * logarithm)
        return np.asarray(heights * np.where(starts > 0.0, curved, frequencies))


SMOOTHING = np.hanning(11)[1:-1] / np.sum(np.hanning(11))


def smoothed(values: Array) -> Array:
    """Return means over neighbors, (count,); below 0 Hz the values are conjugate complex, beyond the last they are 0.

    Args:
        values: At equal steps from 0 Hz, real or complex, (count,).
    """
    reach = len(SMOOTHING) // 2
    mirrored = np.concatenate([np.conj(values[reach:0:-1]), values])
    return np.asarray(np.convolve(mirrored, SMOOTHING)[2 * reach :][: len(values)])
