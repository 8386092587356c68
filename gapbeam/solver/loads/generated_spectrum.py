"""Spectrum and cross-spectrum of random signals as generated, against those asked for, with the scatter of chance.

The bands hold equal shares of the power asked for. Their mean squares are sums over Welch's estimate with Hann windows
that overlap by half. Neighboring frequencies of one window are correlated with 4/9 and 1/36, neighboring windows with
1/36; so the relative variance of a sum over lines k of expected power E_k from K windows is

    (1 + (1 - 1/K) / 18) / K * sum_kl E_k E_l rho_|k-l| / (sum_k E_k)^2,    rho = 1, 4/9, 1/36, 0, ...

The sum is taken as chi-squared with that variance. E_k is the spectrum asked for as the window sees it.

Source: Welch, IEEE Trans. Audio Electroacoust. 15 (1967); Percival and Walden, Spectral Analysis (1993), chapter 6.

For the cross-spectrum, the other load is taken as much earlier as this one follows it. Each line f of the Fourier
transforms X1 and X2 of both, under a Hann window over the whole run, is divided by the root of its spectrum, and X2
turned back by the phase asked for: Y1 and Y2 are complex normal numbers then, of equal size, with the correlation
gamma(f). Over a band,

    r = Re sum conj(Y1) Y2 / (sum |Y1|^2 sum |Y2|^2)^(1/2)

estimates the mean of gamma; the angle of the sum is what the phase is off. Real and imaginary parts are real pairs with
the correlation gamma: atanh(r) is normal about atanh(gamma) with the variance 1 / (2 n - 3), for n independent lines
of the band. Lines of a Hann window are correlated with their neighbors, so that n is the number of lines over
1 + 2 (4/9 + 1/36).

Source: Bendat and Piersol, Random Data (2010), sections 5.2 and 9.2; Fisher, Metron 1 (1921) 3, for atanh(r).
"""

from __future__ import annotations

from itertools import pairwise
from math import atanh, sqrt, tanh
from typing import Any

import numpy as np
import scipy

from gapbeam.solver.loads.random_function import RandomSignal, SharedNoise, grid_densities
from gapbeam.solver.system.operators import Array

CONFIDENCE = 0.95
NUMBERS_OF_BANDS = (8, 4, 2, 1)
LEAST_PRODUCT = 50.0  # of the width of a band and the duration
LINES = 25.0  # of the estimate in the narrowest band
MOST_SAMPLES = 2**20
CORRELATION = (1.0, 4.0 / 9.0, 1.0 / 36.0)  # of powers at 0, 1 and 2 lines of a Hann window
HANN = np.array([1.0, 4.0, 1.0]) / 6.0  # of the power of a line in it and beside it


def compared(signal: RandomSignal, end: float) -> dict[str, Any]:
    """Return the comparison of what was generated up to a time with what was asked for.

    Args:
        signal: Without its smooth start.
        end: s.

    Returns:
        rms asked for, in the unit of the load; `bands` with the limits, Hz, the mean squares asked for and generated,
        and the 95 % interval of their ratio; none where the run is too short. `seconds` of the signal were compared.
    """
    asked, rate = signal.spectrum, signal.rate
    count = min(int(end * rate), MOST_SAMPLES)
    found: dict[str, Any] = {"rms": asked.rms, "seconds": count / rate, "confidence": CONFIDENCE, "bands": []}
    edges = next(
        (
            edges
            for bands in NUMBERS_OF_BANDS
            if _narrowest(edges := _edges(signal, bands)) * found["seconds"] >= LEAST_PRODUCT
        ),
        None,
    )
    if edges is None:
        return found
    values = signal.value(np.arange(count) / rate)
    length = 2 * int(0.5 * rate * LINES / _narrowest(edges))
    lines, generated = scipy.signal.welch(values, rate, "hann", length, length // 2, detrend=False)
    width, windows = rate / length, 2 * count // length - 1
    seen = np.convolve(_mirrored(grid_densities(asked, lines, width)), HANN, mode="valid")
    expected = np.asarray(seen, dtype=float)
    generated[0] *= 2.0  # one-sided as the other lines are
    for low, high in pairwise(edges):
        lowest, highest = np.rint(np.array([low, high]) / width).astype(int)
        found["bands"].append(_band(expected, generated, lowest, highest, width, windows))
    return found


def _edges(signal: RandomSignal, bands: int) -> Array:
    """Return the limits of bands of equal power, Hz, (bands + 1,)."""
    asked = signal.spectrum
    return np.array([asked.low, *(asked.below(number / bands) for number in range(1, bands)), asked.high])


def _narrowest(edges: Array) -> float:
    return float(np.min(np.diff(edges)))


def _mirrored(densities: Array) -> Array:
    """Return densities on a grid from 0 with one more below 0 and one above the highest."""
    return np.concatenate([densities[1:2], densities, [0.0]])


def _band(expected: Array, generated: Any, first: int, last: int, width: float, windows: int) -> dict[str, Any]:
    """Return a band from a line up to another one, without the latter."""
    parts = expected[first:last]
    power = float(np.sum(parts)) * width
    pairs = sum(
        (1.0 if lag == 0 else 2.0) * rho * float(parts[lag:] @ parts[: len(parts) - lag])
        for lag, rho in enumerate(CORRELATION)
    )
    variance = (1.0 + (1.0 - 1.0 / windows) / 18.0) / windows * pairs / float(np.sum(parts)) ** 2
    freedom = 2.0 / variance
    least, most = (
        float(scipy.stats.chi2.ppf(share, freedom)) / freedom
        for share in (0.5 - 0.5 * CONFIDENCE, 0.5 + 0.5 * CONFIDENCE)
    )
    return {
        "from": first * width,
        "to": last * width,
        "asked": power,
        "generated": float(np.sum(generated[first:last])) * width,
        "least_ratio": least,
        "most_ratio": most,
    }


FEWEST_LINES = 30.0  # independent ones in a band
CERTAIN = 1.0 - 1.0e-3  # of a coherence: beyond, it is the window that decides and not chance
DEPENDENT = 1.0 + 2.0 * sum(CORRELATION[1:])  # lines of a Hann window that stand for one


def compared_cross_spectrum(signal: RandomSignal, other: RandomSignal, shared: SharedNoise, end: float) -> list[Any]:
    """Return the coherence of two signals in bands, as generated up to a time and as asked for.

    Args:
        signal: Signal of the load with the cross-spectrum, without its smooth start.
        other: Signal of the load that it names, of the same rate.
        shared: The requested correlation.
        end: s.

    Returns:
        Bands of equal width where both have power, each with its limits `from` and `to`, Hz, the coherence `asked` and
        `generated` in phase, the 95 % interval `low` to `high` of what was to be generated, and by how many degrees the
        phase is off (`phase_error`), None where the interval of the coherence reaches 0. None at all where the run is
        too short.
    """
    rate = signal.rate
    count = min(int(end * rate), MOST_SAMPLES)
    low, high = max(signal.spectrum.low, other.spectrum.low), min(signal.spectrum.high, other.spectrum.high)
    independent = (high - low) * count / rate / DEPENDENT
    bands = next((bands for bands in NUMBERS_OF_BANDS if independent >= FEWEST_LINES * bands), 0)
    if not bands:
        return []
    times, window = np.arange(count) / rate, np.hanning(count)
    lines: Array = np.asarray(np.arange(count // 2 + 1) * (rate / count), dtype=float)
    ours = np.fft.rfft(window * signal.value(times)) / _roots(signal, lines)
    theirs = np.fft.rfft(window * other.value(times - shared.delay)) / _roots(other, lines)
    gamma = np.interp(lines, shared.frequencies, shared.coherences)
    products = np.conj(theirs) * ours * np.exp(-1j * np.interp(lines, shared.frequencies, shared.phases))
    found = []
    for first, last in pairwise(np.rint(np.linspace(low, high, bands + 1) * count / rate).astype(int)):
        here = slice(max(first, 1), last)
        size = sqrt(float(np.sum(np.abs(ours[here]) ** 2) * np.sum(np.abs(theirs[here]) ** 2)))
        total = complex(np.sum(products[here])) / size
        found.append({"from": first * rate / count, "to": last * rate / count, **_judged(total, gamma[here])})
    return found


def _judged(total: complex, gamma: Array) -> dict[str, float | None]:
    """Return the coherence of a band with its interval, and by how much its phase is off, degrees."""
    asked = float(np.mean(gamma))
    center = atanh(min(asked, CERTAIN))
    reach = float(scipy.stats.norm.ppf(0.5 + 0.5 * CONFIDENCE)) / sqrt(2.0 * len(gamma) / DEPENDENT - 3.0)
    low = tanh(center - reach)
    return {
        "asked": asked,
        "generated": total.real,
        "low": low,
        "high": 1.0 if asked >= CERTAIN else tanh(center + reach),
        "phase_error": float(np.degrees(np.angle(total))) if low > 0.0 else None,
    }


def _roots(signal: RandomSignal, lines: Array) -> Array:
    """Return the root of the spectrum at each line; infinite where there is none, so that the line counts nothing."""
    densities = grid_densities(signal.spectrum, lines, float(lines[1]))
    return np.asarray(np.sqrt(np.where(densities > 0.0, densities, np.inf)))
