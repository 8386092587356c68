"""A random load: a force at a point or an acceleration of the support, Gaussian noise of a given spectrum."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from gapbeam.solver.loads.noise_load import PEAK
from gapbeam.solver.loads.paired_noise_load import PairedNoiseLoad
from gapbeam.solver.loads.point_or_support_load import PointOrSupportLoad
from gapbeam.solver.loads.spectra.spectrum_choice import SpectrumChoice


class RandomLoad(PairedNoiseLoad, PointOrSupportLoad):
    """Gaussian noise of a given spectrum as a force at a point or an acceleration of the support."""

    type: Literal["random"] = Field(description="kind of load")
    spectrum: SpectrumChoice = Field(
        description="spectral density of the load over frequency",
        examples=[{"type": "white", "density": 0.01, "high": 500.0}],
    )

    @property
    def peak(self) -> float:
        """Three times the rms, N or m/s^2."""
        return PEAK * self.signal.spectrum.rms
