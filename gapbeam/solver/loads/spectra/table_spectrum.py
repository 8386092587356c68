"""A density given at some frequencies, such as the profile of a vibration test: power laws in between."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field

from gapbeam.solver.faults import Fault, Key
from gapbeam.solver.loads.spectra.spectrum_table import SpectrumTable
from gapbeam.solver.table import Positive

MOST = 1000  # rows

Rows = Annotated[tuple[Positive, ...], Field(min_length=2, max_length=MOST)]


class TableSpectrum(SpectrumTable):
    """Densities at frequencies, straight lines between them where both axes are logarithmic, none beyond the ends."""

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
                f"{other} for {count} frequencies",
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
