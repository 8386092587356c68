"""Features of a motion that survive chaos: harmonics of the load, energies between them, quantiles of the values."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from gapbeam.solver.system.operators import Array
from gapbeam.studies.library.recording import lines

PROBABILITIES = (0.005, 0.05, 0.2, 0.5, 0.8, 0.95, 0.995)
HALVES = 3
"""Lines halfway between harmonics that have a feature of their own: of responses that repeat after two periods."""


@dataclass(frozen=True)
class FeatureKind:
    """Features of the amplitudes c_m at lines m / (periods * period), of a window of whole periods.

    With a_j = c_(j periods) the amplitude of harmonic j, r the root mean square, e = noise * r its noise, spread evenly
    over the lines: ln r; ln |a_j| / r; ln of the energy between harmonics j - 1/2 and j + 1/2 without that line, over
    r^2; the phases a_j / |a_j|; ln of lines halfway;
    quantiles, third and fourth moments of y / r, mean and scatter of its extremes in each period. Each logarithm ends
    at the noise, so that noise of that size and none look alike where there is no more. A shift in time changes none.

    Attributes:
        periods: In a window.
        harmonics: Of the period.
        noise: Largest noise over the root mean square.
    """

    periods: int
    harmonics: int
    noise: float

    def noisy(self, c: Any, level: Array, draw: np.random.Generator) -> Any:
        """Return amplitudes with white noise of `level` times their root mean square, (members,)."""
        r = np.sqrt(np.sum(np.abs(c) ** 2, axis=1) / 2.0)
        scale = (level * r / np.sqrt(c.shape[1] - 1))[:, None]
        found = c + scale * (draw.standard_normal(c.shape) + 1j * draw.standard_normal(c.shape))
        found[:, 0] = 0.0
        return found

    def of(self, c: Any) -> Array:
        """Return features of amplitudes, (members, lines) to (members, features)."""
        W, H = self.periods, self.harmonics
        c = c * np.exp(-1j * np.angle(c[:, W : W + 1]) / W * np.arange(c.shape[1]))
        P = np.abs(c) ** 2 / 2.0
        power = P.sum(axis=1, keepdims=True) + np.finfo(float).tiny
        level = self.noise**2 * power + np.finfo(float).tiny
        line = 4.0 * level / lines(W, H)
        r, a = np.sqrt(power), c[:, W::W][:, :H]
        harmonics = np.log((P[:, W::W][:, :H] + line) / power) / 2.0
        between = P.copy()
        between[:, W::W] = 0.0
        edges = [0, *((W * (2 * j + 1)) // 2 for j in range(H + 1))]
        bands = np.column_stack([between[:, i:k].sum(axis=1) for i, k in pairwise(edges)])
        bands = np.log((bands + level / (H + 0.5)) / power) / 2.0
        halves = np.log((P[:, W // 2 :: W][:, :HALVES] + line) / power) / 2.0
        phase = a / np.sqrt(np.abs(a) ** 2 + 2.0 * line)
        shape = self._shape(c / r)
        return np.column_stack([np.log(r), harmonics, bands, halves, phase[:, 1:].real, phase[:, 1:].imag, shape])

    def _shape(self, c: Any) -> Array:
        """Return features of the values themselves."""
        W, n = self.periods, 4 * self.harmonics
        whole = np.zeros((len(c), W * n // 2 + 1), dtype=complex)
        whole[:, : c.shape[1]] = c
        y = np.fft.irfft(whole, W * n, axis=1) * (W * n / 2.0)
        quantiles = np.quantile(y, PROBABILITIES, axis=1).T
        each = y.reshape(len(y), W, n)
        top, bottom = each.max(axis=2), each.min(axis=2)
        ends = [f(one, axis=1) for one in (top, bottom) for f in (np.mean, np.std)]
        return np.column_stack([quantiles, (y**3).mean(axis=1), np.log((y**4).mean(axis=1)), *ends])
