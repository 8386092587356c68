"""The choice of spectra: `spectrum` of a random load, a table with its `type`."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from gapbeam.solver.loads.spectra.file_spectrum import FileSpectrum
from gapbeam.solver.loads.spectra.table_spectrum import TableSpectrum
from gapbeam.solver.loads.spectra.turbulence_spectrum import TurbulenceSpectrum
from gapbeam.solver.loads.spectra.white_spectrum import WhiteSpectrum

SpectrumChoice = Annotated[
    WhiteSpectrum | TableSpectrum | FileSpectrum | TurbulenceSpectrum, Field(discriminator="type")
]
