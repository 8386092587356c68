"""The envelope of measured turbulence in cross flow over the reduced frequency fr = f D / V.

    S(f) = scale * 5e-3 fr^-0.5    for fr <= 0.2
    S(f) = scale * 4e-5 fr^-3.5    above

Source: the spectrum that code_aster documents as SPEC_LONG_COR_3.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

from pydantic import Field

from gapbeam.solver.faults import Fault, Key
from gapbeam.solver.loads.spectra.spectrum_table import SpectrumTable
from gapbeam.solver.table import Positive

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
