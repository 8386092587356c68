"""How long a motion remembers, and how many independent samples it holds: the integrated autocorrelation time.

    tau = h (1/2 + sum_{k >= 1} rho_k),    n_eff = T / (2 tau)

The sum ends where k reaches 5 times what it has come to. A process whose correlation is exp(-t / tau), such as that of
Ornstein and Uhlenbeck, has the relaxation time tau.

Source: Sokal, Monte Carlo Methods in Statistical Mechanics (1997), section 3, for the window.
"""

from __future__ import annotations

import numpy as np

Array = np.ndarray

WINDOW = 5.0


def correlation_time(series: Array, interval: float = 1.0) -> float:
    """Return the integrated autocorrelation time of a series, s; at least half an interval.

    Args:
        series: Values at even distances in time, or their means over blocks, (n,).
        interval: Distance in time, s.
    """
    parts = series - np.mean(series)
    count = len(parts)
    size = 1 << (2 * count - 1).bit_length()
    spectrum = np.fft.rfft(parts, size)
    correlation = np.fft.irfft(spectrum * np.conj(spectrum), size)[:count]
    if correlation[0] <= 0.0:
        return 0.5 * interval
    sums = np.cumsum(correlation / correlation[0]) - 0.5
    wide = np.flatnonzero(np.arange(count) >= WINDOW * sums)
    found = sums[wide[0]] if len(wide) else sums[-1]
    return float(max(found, 0.5)) * interval


def effective_samples(series: Array) -> float:
    """Return how many independent samples have the same uncertainty of the mean as a series, (n,); at most n."""
    return len(series) / (2.0 * correlation_time(series))
