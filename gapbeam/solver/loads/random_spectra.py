"""Spectra of random loads: one-sided densities made of power laws, and the tables that `spectrum` may be.

    S(f) = S_i (f / f_i)^p_i,    p_i = ln(S_(i+1) / S_i) / ln(f_(i+1) / f_i),    f_i <= f <= f_(i+1)

S is 0 below the first frequency and above the last. Values on a grid of frequencies are smoothed over some of its
intervals, so that filters made from them are short.

White noise in a band is S(f) = S0 for low <= f <= high, 0 elsewhere. A density from a text file, such as a measurement,
or given at some frequencies, such as the profile of a vibration test, has power laws in between. Turbulence in cross
flow has the envelope of measurements over the reduced frequency fr = f D / V,

    S(f) = scale * 5e-3 fr^-0.5    for fr <= 0.2
    S(f) = scale * 4e-5 fr^-3.5    above

Source: the spectrum that code_aster documents as SPEC_LONG_COR_3.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Annotated, Any, Literal, Self

import numpy as np
import scipy
from pydantic import Field

from gapbeam.solver.loads.load_table import Column
from gapbeam.solver.loads.record_file import RecordedRows, RecordError, RowKind, read_record
from gapbeam.solver.messages.errors import Fault, Key
from gapbeam.solver.messages.wording import counted
from gapbeam.solver.schema.table import OF_TYPE, NonNegative, Positive, Table
from gapbeam.solver.system.operators import Array

LARGEST, LEAST = 1.0e60, 1.0e-60
"""Densities beyond are no physics, and their squares no numbers."""


class SpectrumTable(Table, ABC):
    """A spectral density over frequency."""

    scale: Positive = Field(default=1.0, description="factor of all densities, 96.17 for densities in g^2/Hz, no unit")
    sides: Literal["one", "two"] = Field(
        default="one",
        description="one: positive frequencies hold all of the mean square; two: half of it",
    )

    def spectrum(self) -> PowerSpectrum:
        """Return the one-sided density in the unit of the load."""
        frequencies, densities = self.rows()
        factor = self.scale * (2.0 if self.sides == "two" else 1.0)
        return PowerSpectrum(frequencies, tuple(factor * density for density in densities))

    @abstractmethod
    def rows(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return ascending frequencies, Hz, and densities as they are given; power laws in between."""

    def with_checksum(self) -> Self:
        """Return the spectrum with the checksum of the file that it is read from; itself without a file.

        Raises:
            UserError: The file cannot be used, or is another one than its checksum says.
        """
        return self

    @abstractmethod
    def faults(self, key: Key) -> Iterator[Fault]:
        """Yield the faults of the spectrum beyond single values.

        Args:
            key: The way to its table in the case, to which a fault adds the key that it is about.
        """

    def size_faults(self, key: Key) -> Iterator[Fault]:
        """Yield densities that no computation can hold."""
        densities = self.spectrum().densities
        if not LEAST <= min(densities) <= max(densities) <= LARGEST:
            yield Fault(
                key,
                f"densities from {min(densities):.3g} to {max(densities):.3g}",
                f"densities from {LEAST:g} to {LARGEST:g}, in N^2/Hz or (m/s^2)^2/Hz",
                "are they in another unit?",
            )


DENSITIES = RowKind("frequency", "density", 2)
MOST = 20_000  # rows


class FileSpectrum(SpectrumTable):
    """Densities at frequencies from the rows of a text file."""

    type: Literal["file"] = Field(description="kind of spectrum")
    file: str = Field(
        min_length=1,
        description="text file with a row for each frequency, relative to the case file",
        examples=["signals/profile.csv"],
    )
    frequency_column: Column = Field(
        default=1, description="column of the frequencies, Hz: number from 1, or name in the line above"
    )
    density_column: Column = Field(default=2, description="column of the densities: number, or name")
    checksum: str | None = Field(
        default=None,
        min_length=64,
        max_length=64,
        description="SHA-256 of the file; results write it into their case; default any",
    )

    def rows(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return the rows of the file.

        Raises:
            RecordError: The file cannot be used, or is another one than its checksum says.
        """
        read = self._read()
        return tuple(map(float, read.times)), tuple(map(float, read.values))

    def with_checksum(self) -> Self:
        """Return the spectrum with the checksum of its file.

        Raises:
            RecordError: The file cannot be used, or is another one than its checksum says.
        """
        return self.model_copy(update={"checksum": self._read().checksum})

    def faults(self, key: Key) -> Iterator[Fault]:
        """Yield the faults of the file, and of rows that are no spectrum."""
        try:
            read = self._read()
        except RecordError as error:
            yield from (replace(fault, key=(*key, *fault.key)) for fault in error.faults)
            return
        wrong = False
        for name, numbers in (("frequency", read.times), ("density", read.values)):
            below = np.flatnonzero(numbers <= 0.0)
            if len(below):
                wrong = True
                yield Fault(
                    (*key, f"{name}_column"),
                    f"the {name} {numbers[below[0]]:g} in row {below[0] + 1}",
                    "numbers above 0: axes are logarithmic between the rows",
                    "leave such rows out",
                )
        if len(read.times) > MOST:
            wrong = True
            yield Fault((*key, "file"), f"{counted(len(read.times), 'row')}", f"at most {MOST}", "means over some rows")
        if not wrong:
            yield from self.size_faults((*key, "file"))

    def _read(self) -> RecordedRows:
        read = read_record(self.file, self.frequency_column, self.density_column, DENSITIES)
        if self.checksum is not None and self.checksum.lower() != read.checksum:
            found = f"a file with the SHA-256 {read.checksum}"
            hint = "the file has changed since; remove checksum to accept the new one"
            raise RecordError([Fault(("file",), found, f"{self.checksum}, as checksum says", hint)])
        return read


KNEE, BELOW, ABOVE = 0.2, (5.0e-3, -0.5), (4.0e-5, -3.5)
"""Reduced frequency where the power laws meet; factor and exponent of each."""
LOWEST, HIGHEST = 0.01, 2.0
"""Reduced frequencies at which the envelope ends where nothing is given: a sixth of its power lies below."""


class TurbulenceSpectrum(SpectrumTable):
    """The envelope of turbulence in cross flow over reduced frequency."""

    type: Literal["turbulence"] = Field(description="kind of spectrum")
    velocity: Positive = Field(description="velocity V of the flow, m/s", examples=[2.0])
    length: Positive = Field(description="length scale D, mostly the outer diameter of the tube, m", examples=[0.02])
    low: Positive | None = Field(default=None, description="lowest frequency, Hz; default 0.01 V / D")
    high: Positive | None = Field(default=None, description="highest frequency, Hz; default 2 V / D")

    @property
    def ends(self) -> tuple[float, float]:
        """Lowest and highest frequency, Hz."""
        unit = self.velocity / self.length
        return (
            LOWEST * unit if self.low is None else self.low,
            HIGHEST * unit if self.high is None else self.high,
        )

    def rows(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return the ends, and where the power laws meet."""
        (low, high), unit = self.ends, self.velocity / self.length
        knee = KNEE * unit
        frequencies = (low, knee, high) if low < knee < high else (low, high)
        return frequencies, tuple(_envelope(frequency / unit) for frequency in frequencies)

    def faults(self, key: Key) -> Iterator[Fault]:
        """Yield a band without a width."""
        low, high = self.ends
        if low >= high:
            yield Fault(
                (*key, "low" if self.low is not None else "high"),
                f"from {low:g} to {high:g} Hz",
                "a lowest frequency below the highest",
                f"without low and high it goes from {LOWEST:g} to {HIGHEST:g} times velocity / length",
            )
        else:
            yield from self.size_faults((*key, "scale"))


def _envelope(reduced: float) -> float:
    factor, exponent = BELOW if reduced <= KNEE else ABOVE
    return float(factor * reduced**exponent)


TABLE_SPECTRUM_MOST = 1000  # rows

Rows = Annotated[tuple[Positive, ...], Field(min_length=2, max_length=TABLE_SPECTRUM_MOST)]


class TableSpectrum(SpectrumTable):
    """Densities at frequencies, power laws in between, none beyond the ends."""

    type: Literal["table"] = Field(description="kind of spectrum")
    frequencies: Rows = Field(description="ascending frequencies above 0, Hz", examples=[[20.0, 80.0, 350.0, 2000.0]])
    densities: Rows = Field(
        description="density above 0 at each frequency, N^2/Hz or (m/s^2)^2/Hz", examples=[[0.01, 0.04, 0.04, 0.007]]
    )

    def rows(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return the table."""
        return self.frequencies, self.densities

    def faults(self, key: Key) -> Iterator[Fault]:
        """Yield columns of different lengths, and frequencies that do not ascend."""
        count, other = len(self.frequencies), len(self.densities)
        found = [(one, following) for one, following in pairwise(self.frequencies) if one >= following]
        if count != other:
            yield Fault(
                (*key, "densities"),
                f"{other} for {counted(count, 'frequency')}",
                "one density for each frequency",
                related=((*key, "frequencies"),),
            )
        if found:
            one, following = found[0]
            yield Fault(
                (*key, "frequencies"),
                f"{following:g} Hz after {one:g} Hz",
                "frequencies that ascend",
                f"for a step, {one:g} and {1.001 * one:g}" if one == following else "sort the rows",
            )
        if count == other and not found:
            yield from self.size_faults((*key, "densities"))


class WhiteSpectrum(SpectrumTable):
    """The same density at all frequencies of a band."""

    type: Literal["white"] = Field(description="kind of spectrum")
    density: Positive = Field(description="density in the band, N^2/Hz or (m/s^2)^2/Hz", examples=[0.01])
    low: NonNegative = Field(default=0.0, description="lowest frequency of the band, Hz")
    high: Positive = Field(description="highest frequency of the band, Hz", examples=[500.0])

    def rows(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return the ends of the band."""
        return (self.low, self.high), (self.density, self.density)

    def faults(self, key: Key) -> Iterator[Fault]:
        """Yield a band without a width."""
        if self.low >= self.high:
            yield Fault(
                (*key, "low"),
                f"{self.low:g} Hz, with high = {self.high:g} Hz",
                "a lowest frequency below the highest",
                f"low = {self.high:g} and high = {self.low:g}" if self.low > self.high else "a band of some width",
                ((*key, "high"),),
            )
        else:
            yield from self.size_faults((*key, "density"))


SpectrumChoice = Annotated[WhiteSpectrum | TableSpectrum | FileSpectrum | TurbulenceSpectrum, OF_TYPE]


HALVINGS = 60


@dataclass(frozen=True)
class PowerSpectrum:
    """A one-sided spectral density.

    Attributes:
        frequencies: Hz, ascending; the first may be 0 where the density does not change up to the second.
        densities: Densities at these frequencies, positive, in the square of the unit of the load over Hz.
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
        curved = starts * logarithm * scipy.special.exprel((slope + 1.0) * logarithm)
        return np.asarray(heights * np.where(starts > 0.0, curved, frequencies))


SMOOTHING = np.hanning(11)[1:-1] / np.sum(np.hanning(11))


def smoothed(values: Array) -> Array:
    """Return means over neighbors, (count,); below 0 Hz the values are conjugate complex, beyond the last they are 0.

    Args:
        values: Values at equal steps from 0 Hz, real or complex, (count,).
    """
    reach = len(SMOOTHING) // 2
    mirrored = np.concatenate([np.conj(values[reach:0:-1]), values])
    return np.asarray(np.convolve(mirrored, SMOOTHING)[2 * reach :][: len(values)])
