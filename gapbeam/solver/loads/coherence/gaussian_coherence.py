"""rho(d) = exp(-pi d^2 / (4 length^2)): forces that vary smoothly along the beam.

Its integral over d > 0 is the length, as that of exp(-d / length) is: both load waves that are long beside it alike.
"""

from __future__ import annotations

from math import pi
from typing import Literal

import numpy as np
from pydantic import Field

from gapbeam.solver.loads.coherence.coherence_table import CoherenceTable
from gapbeam.solver.system.operators import Array
from gapbeam.solver.table import Positive

REACH = 8.0  # lengths, over which it falls to 1e-22


class GaussianCoherence(CoherenceTable):
    """exp(-pi d^2 / (4 length^2)): of forces without a kink over distance."""

    type: Literal["gaussian"] = Field(description="kind of coherence")
    length: Positive = Field(description="coherence length: the integral of the coherence over distance, m")

    def at(self, distances: Array) -> Array:
        """Return exp(-pi d^2 / (4 length^2))."""
        return np.asarray(np.exp(-0.25 * pi * (distances / self.length) ** 2))

    def pieces(self, length: float) -> Array:
        """Return pieces of at most one coherence length."""
        end = min(length, REACH * self.length)
        return np.asarray(np.linspace(0.0, end, 1 + int(np.ceil(end / self.length))))
