"""Random functions of time: Gaussian noise of a given spectrum, with a smooth start.

    s(t) = r(t) sum_n c_n B(F t - n),    c = h * w

w are independent normal numbers, h is a filter of finite length, B the cubic B-spline, r the
ramp. s is twice continuously differentiable and defined at all times: steps of any length, their halves and the stages
of schemes take it where they need it, and nothing depends on what was asked for before.

The rate F is 8 times the highest frequency. A cubic B-spline multiplies the spectrum of c by sinc(f / F)^8; the filter
is made for S(f) / sinc(f / F)^8, so that the spectrum of s is S. The spectrum around F that sampling leaves is below
(1/7)^8 = 2e-7 of S, and the mean square depends on the place between samples by less than 1e-3.

The filter is a sum of cosines on a grid of frequencies, from the mean of S over each of its intervals, smoothed over
some of them: the mean square is exactly the integral of S, and the ends of a band are not sharper than that. The noise
is stationary and Gaussian and does not repeat. Blocks of it are filtered by fast Fourier transforms (overlap and save).

Source: Oppenheim and Schafer, Discrete-Time Signal Processing (2010), chapters 7 and 8.

The normal numbers are counted: any of them is known at any time, the same wherever it is asked for. A counter-based
generator turns a key and a counter into random bits without a state. The key is a hash of the seed and of a name, the
counter is the place in the sequence; pairs of uniform numbers become pairs of normal ones (Box and Muller), which takes
a fixed number of bits.

Source: Salmon, Moraes, Dror and Shaw, Parallel random numbers: as easy as 1, 2, 3 (2011); Philox4x64-10 of NumPy.

A signal may share the white noise of another one, with a coherence and a phase:

    X2 = S2^(1/2) (G W1 + (1 - |G|^2)^(1/2) W2),    X1 = S1^(1/2) W1,    G = gamma exp(i phi - 2 pi i f T)

W1 and W2 are independent white noises. The spectrum of X2 is S2 whatever G is; S12, the mean of conj(X1) X2, has the
coherence gamma = |S12| / (S1 S2)^(1/2) and the phase phi - 2 pi f T. gamma and phi are straight lines between rows,
constant beyond the first and the last. gamma exp(i phi) is smoothed over neighbors on the grid of the filter, which
lowers gamma where phi changes fast, as at 0 Hz. The whole samples of T shift the white noise, so that the filter does
not depend on how long the delay is.

Source: Shinozuka, J. Acoust. Soc. Am. 49 (1971), for the factors of a cross-spectral matrix; Bendat and Piersol, Random
Data (2010), chapter 5, for coherence and phase.

Spectrum and cross-spectrum of random signals as generated, against those asked for, with the scatter of chance.

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

import hashlib
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import pairwise
from math import atanh, ceil, log2, sqrt, tanh
from typing import Any

import numpy as np
import scipy

from gapbeam.solver.loads.random_spectra import PowerSpectrum, smoothed
from gapbeam.solver.loads.time_function import Times, piecewise_mean, ramped
from gapbeam.solver.system.operators import Array, Indices

WORDS = 4  # of 64 bits that a count of the generator gives
ORIGIN = 2**62  # counts before the first block: numbers before t = 0 are asked for as well
_UNIT = 2.0**-53


def noise_key(seed: int, name: str) -> int:
    """Return the key of a sequence, 128 bits: sequences of other seeds or names are independent."""
    return int.from_bytes(hashlib.sha256(f"{seed} {name}".encode()).digest()[:16], "little")


def normal_block(key: int, block: int, size: int) -> Array:
    """Return a block of independent normal numbers of mean 0 and variance 1, (size,).

    Args:
        key: Key of the sequence.
        block: Number of the block; it may be negative.
        size: A multiple of 4.
    """
    bits = np.random.Philox(key=key, counter=ORIGIN + block * (size // WORDS)).random_raw(size)
    first, second = (bits.reshape(-1, 2).T >> np.uint64(11)).astype(float) * _UNIT
    radius, angle = np.sqrt(-2.0 * np.log(first + _UNIT)), 2.0 * np.pi * second
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1).ravel()


ROUND_OFF = 1.0e-12  # of |G|^2 = 1


@dataclass(frozen=True)
class SharedNoise:
    """The noise that is shared.

    Attributes:
        key: Key of the white noise of the other signal.
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
            length: Length of a block.
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


OVERSAMPLING = 8.0  # samples in a period of the highest frequency
IN_BAND, BELOW_LOWEST, IN_GAP = 256.0, 16.0, 4.0
"""Intervals of the grid in the band, below its lowest frequency, and between two rows of a spectrum."""
LEAST_LENGTH, MOST_LENGTH = 2**10, 2**20  # of a filter
SUPPORT = 4  # samples that a cubic B-spline reaches
FEW = 16  # times at which dense sums cost less than sparse products
BLOCKS_KEPT = 3  # of each signal
SIGNALS_KEPT = 128  # such as the patterns of a load along the beam


@dataclass(frozen=True)
class RandomSignal:
    """A random function of time.

    Attributes:
        spectrum: One-sided.
        seed: Seed of the noise.
        name: Name of the load; loads of other names are independent.
        ramp: Duration of the smooth start, s.
        shared: Correlation with another signal of the same rate and filter length.
    """

    spectrum: PowerSpectrum
    seed: int
    name: str
    ramp: float
    shared: SharedNoise | None = None

    @property
    def rate(self) -> float:
        """F, samples in a second."""
        return sample_rate(self.spectrum)

    def value(self, time: Times) -> Times:
        """Return s at a time, or at each of an array of times."""
        times = np.asarray(time, dtype=float)
        values = ramped(times, self.ramp, (_stationary_rows((self,), times.ravel()).reshape(times.shape),))
        found: Times = values if isinstance(time, np.ndarray) else float(values)
        return found

    def mean(self, starts: Array, ends: Array) -> Array:
        """Return the mean of s over intervals, (times,); exact, as s is made of polynomials between samples.

        Args:
            starts: (times,), s.
            ends: (times,), s, none before its start.
        """
        first, last = np.floor(float(np.min(starts)) * self.rate), np.ceil(float(np.max(ends)) * self.rate)
        knots = np.append(np.arange(first, last + 1.0) / self.rate, self.ramp)
        return piecewise_mean(self.value, knots, starts, ends)

    @cached_property
    def kind(self) -> Hashable:
        """Signals of one kind have their samples at the same times: their values are computed together."""
        return type(self), self.rate, filter_length(self.spectrum), self.ramp

    def rows(self, signals: Sequence[RandomSignal], times: Array) -> Array:
        """Return s of signals of this kind at many times, (times, signals): the sums of splines of all of them at once.

        Places and weights of the splines are the same for all signals, and most of the work of a single one.
        """
        if len(times) == 0:
            return np.zeros((0, len(signals)))
        return np.asarray(ramped(times[:, None], self.ramp, (_stationary_rows(signals, times),)))

    def window(self, block: int) -> Array:
        """Return a block of samples and those behind it that its last splines reach."""
        return _blocks_of(self.spectrum, noise_key(self.seed, self.name), self.shared).with_following(block)


def sample_rate(spectrum: PowerSpectrum) -> float:
    """Return the samples in a second that noise of a spectrum is made of, 1/s."""
    return OVERSAMPLING * spectrum.high


def filter_length(spectrum: PowerSpectrum) -> int:
    """Return the length of the filter in samples: a power of two."""
    wanted = [(spectrum.high - spectrum.low) / IN_BAND, *(np.diff(spectrum.frequencies) / IN_GAP)]
    if spectrum.low > 0.0:
        wanted.append(spectrum.low / BELOW_LOWEST)
    return max(LEAST_LENGTH, 1 << ceil(log2(sample_rate(spectrum) / min(wanted))))


def grid_densities(spectrum: PowerSpectrum, frequencies: Array, width: float) -> Array:
    """Return the mean of S over an interval around each frequency, of its two-sided half around 0, (count,)."""
    edges = np.concatenate([[max(frequencies[0] - 0.5 * width, 0.0)], frequencies + 0.5 * width])
    means = np.diff(spectrum.power_below(edges)) / width
    if frequencies[0] == 0.0:
        means[0] *= 2.0
    return means


def _stationary_rows(signals: Sequence[RandomSignal], times: Array) -> Array:
    """Return s of signals of one kind without its ramp, (times, signals)."""
    length = filter_length(signals[0].spectrum)
    places = times * signals[0].rate
    samples = np.floor(places)
    u = places - samples
    numbers = samples.astype(np.int64)
    blocks = numbers // length
    several = np.unique(blocks)
    if len(several) == 1:
        return _within_block(signals, int(several[0]), numbers - several[0] * length, u)
    values = np.empty((len(times), len(signals)))
    for block in several:
        here = blocks == block
        values[here] = _within_block(signals, int(block), numbers[here] - block * length, u[here])
    return values


def _within_block(signals: Sequence[RandomSignal], block: int, places: Indices, u: Array) -> Array:
    """Return s of signals at places in a block, and shares u of an interval behind them, (times, signals)."""
    first, last = int(places.min()), int(places.max()) + SUPPORT
    windows = np.stack([signal.window(block)[first:last] for signal in signals], axis=1)
    return _splines(windows, places - first, u)


def _splines(windows: Array, places: Indices, u: Array) -> Array:
    """Return the sums of four cubic B-splines at places and shares u of an interval behind them, (times, signals)."""
    v = 1.0 - u
    weights = np.stack([v * v * v, 4.0 - 3.0 * u * u * (2.0 - u), 4.0 - 3.0 * v * v * (2.0 - v), u * u * u], axis=1)
    weights /= 6.0
    columns = places[:, None] + np.arange(SUPPORT)
    if len(u) < FEW:
        return np.asarray(np.sum(weights[:, :, None] * windows[columns], axis=1))
    starts = np.arange(0, SUPPORT * len(u) + 1, SUPPORT)
    return np.asarray(
        scipy.sparse.csr_matrix((weights.ravel(), columns.ravel(), starts), shape=(len(u), len(windows))) @ windows
    )


@lru_cache(maxsize=8)
def _responses(spectrum: PowerSpectrum, shared: SharedNoise | None) -> tuple[Array, ...]:
    """Return the Fourier transforms of the filters of the own noise and of the shared one, (length + 1,) each."""
    length, rate = filter_length(spectrum), sample_rate(spectrum)
    frequencies = np.asarray(np.arange(length // 2 + 1) * (rate / length), dtype=float)
    densities = smoothed(grid_densities(spectrum, frequencies, rate / length))
    gains = np.sqrt(0.5 * rate * densities) / np.sinc(frequencies / rate) ** SUPPORT
    if shared is None:
        return (_response(gains, length),)
    factor, own = shared.factors(frequencies, rate)
    return _response(gains * own, length), _response(gains * factor, length)


def _response(gains: Array, length: int) -> Array:
    """Return the Fourier transform over twice the length of the filter with these gains, (length + 1,)."""
    taps = np.roll(np.fft.irfft(gains, length), length // 2)
    return np.asarray(np.fft.rfft(taps, 2 * length))


class _Blocks:
    """The last blocks of the noise of one load, which steps in their order ask for again and again."""

    def __init__(self, spectrum: PowerSpectrum, key: int, shared: SharedNoise | None) -> None:
        self._spectrum, self._key, self._shared = spectrum, key, shared
        self._form = None if shared is None else replace(shared, key=0)  # filters do not depend on it
        self._white = lru_cache(maxsize=2)(self._normal)
        self._kept = lru_cache(maxsize=BLOCKS_KEPT)(self._samples)
        self.with_following = lru_cache(maxsize=BLOCKS_KEPT)(self._with_following)

    def _normal(self, block: int) -> Array:
        """Return a block of w; each is filtered twice, with the one before it and with the one behind it."""
        return normal_block(self._key, block, filter_length(self._spectrum))

    def _samples(self, block: int) -> Array:
        """Return a block of c, as long as the filter; always computed from the same numbers in the same way."""
        length = filter_length(self._spectrum)
        white = [np.concatenate([self._white(block - 1), self._white(block)])]
        if self._shared is not None:
            white.append(self._shared.white(block, length, sample_rate(self._spectrum)))
        lines = [np.fft.rfft(one) * by for one, by in zip(white, _responses(self._spectrum, self._form), strict=True)]
        return np.asarray(np.fft.irfft(sum(lines[1:], lines[0]), 2 * length)[length:])

    def _with_following(self, block: int) -> Array:
        """Return a block of c and the samples behind it that its last splines reach."""
        return np.concatenate([self._kept(block), self._kept(block + 1)[: SUPPORT - 1]])


_blocks_of = lru_cache(maxsize=SIGNALS_KEPT)(_Blocks)


CONFIDENCE = 0.95
NUMBERS_OF_BANDS = (8, 4, 2, 1)
LEAST_PRODUCT = 50.0  # of the width of a band and the duration
LINES = 25.0  # of the estimate in the narrowest band
MOST_SAMPLES = 2**20
CORRELATION = (1.0, 4.0 / 9.0, 1.0 / 36.0)  # of powers at 0, 1 and 2 lines of a Hann window
HANN = np.array([1.0, 4.0, 1.0]) / 6.0  # of the power of a line in it and beside it


def compared(signal: RandomSignal, end: float) -> dict[str, Any]:
    """Return the comparison of the signal generated up to a time with the requested one.

    Args:
        signal: Signal without its smooth start.
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
