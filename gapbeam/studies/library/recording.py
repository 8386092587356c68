"""Recordings of a motion from CSV, WAV and universal files, in SI units, and features of a motion that survive chaos.

Features are harmonics of the load, energies between them, and quantiles of the values.

Time responses in universal files: data sets 58 as text, with real values that are evenly spaced.

In data set 58 five lines of text come first, then one each of the function, of its values, and of the axes; then the
values themselves.

Source: SDRC, Universal dataset number 58, Function at nodal DOF.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import make_interp_spline
from scipy.io import wavfile

from gapbeam.solver.loads.record_file import Column, RecordError, read_record
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.messages.wording import LOG, either, near
from gapbeam.solver.scene.argument_checks import checked, positive, reals
from gapbeam.solver.scene.printed_values import result_words
from gapbeam.solver.scene.universal_file import UNIVERSAL, DataSet, UniversalFile
from gapbeam.solver.system.operators import Array

HEADER = 11
"""Lines of a data set 58 above its values."""
FUNCTION, FORM, ABSCISSA, ORDINATE = 5, 6, 7, 8
TIME, UNKNOWN = 17, 0
WIDTHS = {2: (6, 13), 4: (4, 20)}
"""Values of a line and characters of a value, by the type of real values: of single and of double precision."""
FUNCTIONS = {
    2: "an auto spectrum", 3: "a cross spectrum", 4: "a frequency response function", 5: "a transmissibility",
    6: "a coherence", 7: "an auto correlation", 8: "a cross correlation", 9: "a power spectral density",
}  # fmt: skip
UNIVERSAL_QUANTITIES = {
    8: "displacement",
    11: "velocity",
    12: "acceleration",
    9: "reaction force",
    13: "excitation force",
}


def samples(one: DataSet, quantity: str) -> tuple[Array, Array]:
    """Return times, s, and values of a data set 58.

    Args:
        one: The data set.
        quantity: Expected quantity.

    Raises:
        UserError: The file is no time response of that quantity, or its values are complex, uneven or cut off.
    """
    (function,) = one.numbers(FUNCTION, (5,))
    if function not in (0, 1):
        raise one.fault(FUNCTIONS.get(int(function), f"function type {function:g}"), "a time response")
    kind, count, even, begin, interval = one.numbers(FORM, (10, 10, 10, 13, 13))
    if kind not in WIDTHS:
        raise one.fault("complex values" if kind in (5, 6) else f"values of type {kind:g}", "real values")
    if even != 1:
        raise one.fault("values that are not evenly spaced", "evenly spaced ones; resample the recording")
    if not interval > 0.0:
        raise one.fault(f"an interval of {interval:g} s", "one above 0")
    (abscissa,), (ordinate,) = one.numbers(ABSCISSA, (10,)), one.numbers(ORDINATE, (10,))
    if abscissa not in (UNKNOWN, TIME):
        raise one.fault(f"an abscissa of type {abscissa:g}", f"the time, which is {TIME}")
    if ordinate != UNKNOWN and UNIVERSAL_QUANTITIES.get(int(ordinate)) != quantity:
        what = UNIVERSAL_QUANTITIES.get(int(ordinate), f"an ordinate of type {ordinate:g}")
        raise one.fault(what, f"{quantity}, as the unit says")
    each, width = WIDTHS[int(kind)]
    rows = -(-int(count) // each)
    if len(one.lines) != HEADER + rows:
        raise one.fault(f"{len(one.lines) - HEADER} lines of values", f"{rows} for {count:g} values: was it cut?")
    values = list[float]()
    for row in range(rows):
        values += one.numbers(HEADER + row, (width,) * min(each, int(count) - len(values)))
    return begin + interval * np.arange(len(values)), np.array(values)


def read_universal(path: Path, channel: int) -> DataSet:
    """Return a data set 58 of a universal file; other data sets are passed over.

    Args:
        path: The file.
        channel: Its number among the data sets 58, from 1.

    Raises:
        UserError: There is no such file or data set, or it is binary or too large.
    """
    found = UniversalFile.read(path).of_kind("58", "function at a point")
    if not 1 <= channel <= len(found):
        raise UserError(f"{path}: channel: found {channel}, expected 1 to {len(found)}: its data sets 58")
    one = found[channel - 1]
    if len(one.lines) < HEADER:
        raise one.fault(f"{len(one.lines)} lines", f"{HEADER} of header and then values")
    return one


Quantity = Literal["displacement", "velocity", "acceleration"]
QUANTITIES: tuple[Quantity, ...] = get_args(Quantity)
"""Quantities, each the derivative of the one before it."""
UNITS: dict[str, tuple[Quantity, float]] = {
    "m": ("displacement", 1.0), "mm": ("displacement", 1e-3), "um": ("displacement", 1e-6),
    "m/s": ("velocity", 1.0), "mm/s": ("velocity", 1e-3), "um/s": ("velocity", 1e-6),
    "m/s2": ("acceleration", 1.0), "mm/s2": ("acceleration", 1e-3), "g": ("acceleration", 9.80665),
}  # fmt: skip
SAMPLES = 4
"""Least number of samples in the period of the highest harmonic: splines of degree 5 then err by 1 % there."""
DEGREE = 5
CLIPPED = 10
"""Samples at an end of the values, over those at the next value: above it, the sensor or the recorder was too small."""
EVEN = 0.5
"""Largest gap between two samples, over the mean interval, above 1: beyond it samples are missing."""


@dataclass(frozen=True, eq=False)
class Recording:
    """A recorded motion of one point.

    Attributes:
        times: Increasing, (samples,), s.
        values: (samples,), in SI units of the quantity.
        quantity: "displacement", "velocity" or "acceleration".
        name: Name in messages and tables.

    Raises:
        UserError: Something is not finite, times do not increase, or lengths differ.
    """

    __repr__ = result_words

    times: ArrayLike
    values: ArrayLike
    quantity: Quantity
    name: str = "recording"

    def __post_init__(self) -> None:
        t, y = (reals(one, f"{self.name}: {word}") for word, one in (("times", self.times), ("values", self.values)))
        object.__setattr__(self, "times", t)
        object.__setattr__(self, "values", y)
        if self.quantity not in QUANTITIES:
            raise UserError(f"{self.name}: quantity: found {self.quantity!r}, expected {either(QUANTITIES)}")
        if t.ndim != 1 or t.shape != y.shape or len(t) < DEGREE + 1:
            raise UserError(
                f"{self.name}: found times of shape {t.shape} and values of shape {y.shape}; expected one value for "
                f"each time, and {DEGREE + 1} at least"
            )
        for word, one in (("time", t), ("value", y)):
            if not np.all(np.isfinite(one)):
                row = int(np.flatnonzero(~np.isfinite(one))[0])
                raise UserError(f"{self.name}: the {word} of sample {row + 1} is {one[row]}; expected finite numbers")
        gaps = np.diff(t)
        if not gaps.min() > 0.0:
            raise UserError(f"{self.name}: the times do not increase after sample {int(gaps.argmin()) + 1}")
        if gaps.max() > (1.0 + EVEN) * gaps.mean():
            raise UserError(
                f"{self.name}: samples are missing after {t[gaps.argmax()]:.6g} s: an interval of {gaps.max():.3g} s, "
                f"{gaps.mean():.3g} s on average; record without gaps, or cut the recording there"
            )
        levels, counts = np.unique(y, return_counts=True)
        for end, beside, word in ((-1, -2, "largest"), (0, 1, "least")):
            if len(levels) > 2 and counts[end] > CLIPPED * counts[beside]:
                LOG.warning(
                    "%s: %.2g %% of the samples have the %s value: is it clipped? Estimates from clipped recordings "
                    "are wrong", self.name, 100.0 * counts[end] / len(y), word,
                )  # fmt: skip

    def spectra(self, period: float, periods: int, harmonics: int) -> Any:
        """Return complex amplitudes at the lines m / (periods * period), of each window of so many periods.

        y(t) = sum_m Re(c_m exp(2 pi i m t / (periods * period))), with t from the start of the window; the mean is
        left out, and lines above harmonic + 1/2 are, too.

        Returns:
            (windows, lines).

        Raises:
            UserError: The recording is shorter than a window, or sampled too slowly for the harmonics.
        """
        t, y = np.asarray(self.times), np.asarray(self.values)
        window, rate = periods * period, (len(t) - 1) / (t[-1] - t[0])
        least = SAMPLES * harmonics / period
        hint = "are the times in seconds?" if rate * period < 1.0 else "record faster, or march a library of fewer"
        if rate < least * (1.0 - 1e-6):
            raise UserError(
                f"{self.name}: sampled {rate:.6g} times a second; expected {least:.6g} or more: {SAMPLES} in a period "
                f"of harmonic {harmonics} of {1.0 / period:.6g} Hz; {hint}"
            )
        count = int((t[-1] - t[0] + 1.0 / rate) / window * (1.0 + 1e-9))
        if count < 1:
            raise UserError(
                f"{self.name}: {t[-1] - t[0]:.6g} s long; expected {window:.6g} s or more: {periods} periods of the "
                "load; record longer, or march a library of fewer `periods`"
            )
        samples = max(2 * SAMPLES * harmonics, 2 * int(np.ceil(rate * period))) * periods
        spline = make_interp_spline(t, y - y.mean(), k=DEGREE)
        grid = np.minimum(t[0] + window / samples * np.arange(count * samples), t[-1])
        return lines_of(spline(grid).reshape(count, samples), periods, harmonics)


def lines_of(y: Array, periods: int, harmonics: int) -> Any:
    """Return complex amplitudes c_m of evenly spaced samples over whole periods, (members, lines); c_0 = 0."""
    found = np.fft.rfft(y, axis=1)[:, : lines(periods, harmonics)] * (2.0 / y.shape[1])
    found[:, 0] = 0.0
    return found


def lines(periods: int, harmonics: int) -> int:
    """Return the number of lines from 0 to harmonic + 1/2."""
    return periods * harmonics + periods // 2 + 1


@checked
def read_recording(
    file: str | Path, unit: str, *, column: Column = 2, time_column: Column = 1, channel: int = 1,
    full_scale: float | None = None,
) -> Recording:  # fmt: skip
    """Read a recording from a text file with a column of times, s, from a WAV file, or from a universal file.

    Args:
        file: Its path; a name that ends in ".wav" is a WAV file, in ".uff" or ".unv" a universal file.
        unit: Unit of the values: m, mm, um, m/s, mm/s, um/s, m/s2, mm/s2 or g.
        column: Column of a text file, number from 1 or name.
        time_column: Column of times of a text file, number from 1 or name.
        channel: Channel of a WAV file, or the data set 58 of a universal file, from 1.
        full_scale: Value of full scale of a WAV file, in the unit.

    Raises:
        UserError: The unit, a column or a channel is unknown, or the file holds no such numbers.
    """
    path = Path(file)
    if unit not in UNITS:
        close = near(unit, UNITS)
        raise UserError(
            f"{path}: unit: found {unit!r}, expected {either(UNITS)}" + (f"; did you mean {close!r}?" if close else "")
        )
    quantity, factor = UNITS[unit]
    if path.suffix.lower() == ".wav":
        times, values = _wave(path, channel, full_scale)
    elif full_scale is not None:
        raise UserError(f"{path}: full scale is of WAV files; the values of other files are in the unit")
    elif path.suffix.lower() in UNIVERSAL:
        times, values = samples(read_universal(path, channel), quantity)
    else:
        try:
            rows = read_record(str(path), time_column, column)
        except RecordError as error:
            text = "\n\n".join(
                f"{path}: {_option(str(fault.key[-1]))}\n{str(fault).strip(chr(10))}" for fault in error.faults
            )
            raise UserError(text.replace("relative to the case file", "relative to the current folder")) from error
        times, values = rows.times, rows.values
    return Recording(times, values * factor, quantity, path.name)


def _option(key: str) -> str:
    return {"value_column": "column", "file": "the file"}.get(key, key.replace("_", " "))


def _wave(path: Path, channel: int, full_scale: float | None) -> tuple[Array, Array]:
    """Return times and values of a channel of a WAV file."""
    if full_scale is None:
        raise UserError(
            f"{path}: full scale: found none, expected the value of full scale in the unit: a WAV file has no unit"
        )
    scale = float(positive(full_scale, f"{path}: full scale"))
    try:
        rate, data = wavfile.read(path)
    except (OSError, ValueError) as error:
        raise UserError(f"{path}: expected a WAV file of numbers; {error}") from error
    table = data[:, None] if data.ndim == 1 else data
    if not 1 <= channel <= table.shape[1]:
        raise UserError(f"{path}: channel: found {channel}, expected 1 to {table.shape[1]}")
    values = table[:, channel - 1].astype(float)
    if data.dtype.kind == "u":
        values -= 128.0
    if data.dtype.kind in "iu":
        values /= 2.0 ** (8 * data.dtype.itemsize - 1)
    return np.arange(len(values)) / rate, values * scale


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
        periods: Periods in a window.
        harmonics: Harmonics of the period.
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
