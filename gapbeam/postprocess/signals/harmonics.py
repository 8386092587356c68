"""The table of harmonics: what a spectrum shows at multiples and fractions of the forcing frequency."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from gapbeam.postprocess.signals.signal import SignalError
from gapbeam.postprocess.signals.spectra import Spectrum

SUBHARMONICS = (Fraction(1, 3), Fraction(1, 2))


@dataclass(frozen=True)
class HarmonicLine:
    """One line of the table.

    Attributes:
        order: Frequency over forcing frequency.
        frequency: Hz.
        amplitude: In the unit of the spectrum.
        phase: rad, of amplitude * sin(2 pi f t + phase).
    """

    order: Fraction
    frequency: float
    amplitude: float
    phase: float


def harmonics(spectrum: Spectrum, highest: int = 10) -> tuple[HarmonicLine, ...]:
    """Read the subharmonics 1/3 and 1/2 and the harmonics 1 to n of the forcing.

    Orders that fall between the lines of the spectrum or above half the sampling rate are left out.

    Args:
        spectrum: Over a whole number of forcing periods.
        highest: n.

    Raises:
        SignalError: The spectrum has no forcing periods.
    """
    if spectrum.periods is None:
        raise SignalError("no harmonics without a forcing period")
    rows = []
    for order in (*SUBHARMONICS, *(Fraction(n) for n in range(1, highest + 1))):
        line = order * spectrum.periods
        if line.denominator == 1 and line < spectrum.frequency.size:
            k = int(line)
            rows.append(
                HarmonicLine(
                    order,
                    float(spectrum.frequency[k]),
                    float(spectrum.amplitude[k]),
                    float(spectrum.phase[k]),
                )
            )
    return tuple(rows)


def distortion(table: tuple[HarmonicLine, ...]) -> float:
    """Root of the sum of squares of the higher harmonics over the first; inf where the first is 0."""
    first = sum(row.amplitude for row in table if row.order == 1)
    higher = float(np.sqrt(sum(row.amplitude**2 for row in table if row.order > 1)))
    return higher / first if first > 0.0 else float("inf")
