"""The choice of coherences: `coherence` of a distributed random load, a table with its `type`."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from gapbeam.solver.loads.coherence.exponential_coherence import ExponentialCoherence
from gapbeam.solver.loads.coherence.full_coherence import FullCoherence
from gapbeam.solver.loads.coherence.gaussian_coherence import GaussianCoherence
from gapbeam.solver.loads.coherence.measured_coherence import MeasuredCoherence

CoherenceChoice = Annotated[
    ExponentialCoherence | GaussianCoherence | MeasuredCoherence | FullCoherence, Field(discriminator="type")
]
