"""What a random signal shares with another one: the white noise of the other one, and how much of it at which phase.

    X2 = S2^(1/2) (G W1 + (1 - |G|^2)^(1/2) W2),    X1 = S1^(1/2) W1,    G = gamma exp(i phi - 2 pi i f T)

W1 and W2 are independent white noises. The spectrum of X2 is S2 whatever G is; S12, the mean of conj(X1) X2, has the
coherence gamma = |S12| / (S1 S2)^(1/2) and the phase phi - 2 pi f T. gamma and phi are straight lines between rows,
constant beyond the first and the last. gamma exp(i phi) is smoothed over neighbors on the grid of the filter, which
lowers gamma where phi changes fast, as at 0 Hz. The whole samples of T shift the white noise, so that the filter does
not depend on how long the delay is.

Source: Shinozuka, J. Acoust. Soc. Am. 49 (1971), for the factors of a cross-spectral matrix; Bendat and Piersol, Random
Data (2010), chapter 5, for coherence and phase.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gapbeam.solver.loads.counted_noise import normal_block
from gapbeam.solver.loads.spectra.grid_smoothing import smoothed
from gapbeam.solver.system.operators import Array

ROUND_OFF = 1.0e-12  # of |G|^2 = 1


@dataclass(frozen=True)
class SharedNoise:
    """The noise that is shared.

    Attributes:
        key: Of the white noise of the other signal.
        frequencies: Ascending, Hz.
        coherences: gamma at each, from 0 to 1.
        phases: phi at each, rad: how far this signal is ahead of the other one.
        delay: T, by which this signal follows the other one, s.
    """

    key: int
    frequencies: tuple[float, ...]
    coherences: tuple[float, ...]
    phases: tuple[float, ...]
    delay: float

    def white(self, block: int, length: int, rate: float) -> Array:
        """Return two blocks of the delayed white noise, the last of them this one, (2 length,).

        Args:
            block: Number of the block; it may be negative.
            length: Of a block.
            rate: Samples in a second.
        """
        first = (block - 1) * length - self._whole(rate)
        start = first // length
        numbers = np.concatenate([normal_block(self.key, start + number, length) for number in range(3)])
        return numbers[first - start * length :][: 2 * length]

    def factors(self, frequencies: Array, rate: float) -> tuple[Array, Array]:
        """Return G without the delay of whole samples, and the share of the own noise, (count,) each.

        Args:
            frequencies: A grid from 0 Hz to half the rate.
            rate: Samples in a second.
        """
        gamma = np.interp(frequencies, self.frequencies, self.coherences)
        phase = np.interp(frequencies, self.frequencies, self.phases)
        shared = smoothed(np.asarray(gamma * np.exp(1j * phase)))
        rest = 1.0 - np.abs(shared) ** 2
        own = np.sqrt(np.where(rest < ROUND_OFF, 0.0, rest))
        part = self.delay - self._whole(rate) / rate
        return np.asarray(shared * np.exp(-2j * np.pi * frequencies * part)), np.asarray(own)

    def _whole(self, rate: float) -> int:
        """Return the whole samples of the delay."""
        return round(self.delay * rate)
