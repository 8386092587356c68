"""White noise in a band: S(f) = S0 for low <= f <= high, 0 elsewhere."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

from pydantic import Field

from gapbeam.solver.faults import Fault, Key
from gapbeam.solver.loads.spectra.spectrum_table import SpectrumTable
from gapbeam.solver.table import NonNegative, Positive


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
