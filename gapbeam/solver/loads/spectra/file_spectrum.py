"""A density from a text file, such as that of a measurement: power laws between its rows."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Literal, Self

import numpy as np
from pydantic import Field

from gapbeam.solver.faults import Fault, Key
from gapbeam.solver.loads.record_file import RecordedRows, RecordError, RowKind, read_record
from gapbeam.solver.loads.recorded_table import Column
from gapbeam.solver.loads.spectra.spectrum_table import SpectrumTable

DENSITIES = RowKind("frequency", "density", 2)
MOST = 20_000  # rows


class FileSpectrum(SpectrumTable):
    """Densities at frequencies from the rows of a text file, with power laws in between, none beyond the ends."""

    type: Literal["file"] = Field(description="kind of spectrum")
    file: str = Field(
        min_length=1,
        description="a text file with a row for each frequency, its path relative to the case file",
        examples=["signals/profile.csv"],
    )
    frequency_column: Column = Field(
        default=1, description="column of the frequencies, in Hz: its number from 1, or its name in the line above"
    )
    density_column: Column = Field(
        default=2, description="column of the densities: its number from 1, or its name in the line above the rows"
    )
    checksum: str | None = Field(
        default=None,
        min_length=64,
        max_length=64,
        description="SHA-256 that the file must have; results write it into their case; default any",
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
        """Yield what is wrong with the file, and rows that are no spectrum."""
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
            yield Fault((*key, "file"), f"{len(read.times)} rows", f"at most {MOST}", "means over some rows")
        if not wrong:
            yield from self.size_faults((*key, "file"))

    def _read(self) -> RecordedRows:
        read = read_record(self.file, self.frequency_column, self.density_column, DENSITIES)
        if self.checksum is not None and self.checksum.lower() != read.checksum:
            found = f"a file with the SHA-256 {read.checksum}"
            hint = "the file has changed since; remove checksum to take it as it is"
            raise RecordError([Fault(("file",), found, f"{self.checksum}, as checksum says", hint)])
        return read
