"""The base of all spectra of random loads: what a load asks its spectrum."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import Literal, Self

from pydantic import Field

from gapbeam.solver.faults import Fault, Key
from gapbeam.solver.loads.spectra.power_spectrum import PowerSpectrum
from gapbeam.solver.table import Positive, Table

LARGEST, LEAST = 1.0e60, 1.0e-60
"""Densities beyond are no physics, and their squares no numbers."""


class SpectrumTable(Table, ABC):
    """A spectral density over frequency."""

    scale: Positive = Field(
        default=1.0, description="what all densities are multiplied by, 96.17 for densities in g^2/Hz, no unit"
    )
    sides: Literal["one", "two"] = Field(
        default="one",
        description="whether the density holds all of the mean square in positive frequencies, or half of it, the "
        "other half in negative ones",
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
        """Yield what is wrong with the spectrum beyond single values.

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
