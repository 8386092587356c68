"""Recordings of a motion: from CSV and WAV files, in SI units, and their spectra at lines of a load's period."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import make_interp_spline
from scipy.io import wavfile

from gapbeam.solver.errors import UserError
from gapbeam.solver.loads.record_file import Column, RecordError, read_record
from gapbeam.solver.scene.argument_checks import positive
from gapbeam.solver.system.operators import Array
from gapbeam.solver.wording.short_words import either, near

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
EVEN = 0.5
"""Largest gap between two samples, over the mean interval, above 1: beyond it samples are missing."""


@dataclass(frozen=True, eq=False)
class Recording:
    """A recorded motion of one point.

    Attributes:
        times: Increasing, (samples,), s.
        values: (samples,), in SI units of the quantity.
        quantity: "displacement", "velocity" or "acceleration".
        name: For messages and tables.

    Raises:
        UserError: Something is not finite, times do not increase, or lengths differ.
    """

    times: ArrayLike
    values: ArrayLike
    quantity: Quantity
    name: str = "recording"

    def __post_init__(self) -> None:
        t, y = (np.asarray(one, dtype=float) for one in (self.times, self.values))
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


def read_recording(
    file: str | Path, unit: str, *, column: Column = 2, time_column: Column = 1, channel: int = 1,
    full_scale: float | None = None,
) -> Recording:  # fmt: skip
    """Read a recording from a text file with a column of times, s, or from a WAV file.

    Args:
        file: Its path; a name that ends in ".wav" is a WAV file.
        unit: Of the values: m, mm, um, m/s, mm/s, um/s, m/s2, mm/s2 or g.
        column: Of a text file, number from 1 or name.
        time_column: Likewise.
        channel: Of a WAV file, from 1.
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
    else:
        if full_scale is not None:
            raise UserError(f"{path}: full scale is of WAV files; the values of a text file are in the unit")
        try:
            rows = read_record(str(path), time_column, column)
        except RecordError as error:
            text = "\n\n".join(
                f"{path}: {_option(str(fault.key[-1]))}\n{str(fault).lstrip()}" for fault in error.faults
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
