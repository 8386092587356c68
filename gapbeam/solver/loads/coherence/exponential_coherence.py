"""rho(d) = exp(-d / length): what tubes in cross flow are computed with.

Source: Axisa, Antunes and Villard, Journal of Fluids and Structures 4 (1990), 321-341.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field

from gapbeam.solver.loads.coherence.coherence_table import CoherenceTable
from gapbeam.solver.system.operators import Array
from gapbeam.solver.table import Positive

REACH = 40.0  # lengths, over which it falls to 4e-18


class ExponentialCoherence(CoherenceTable):
    """exp(-d / length): of cross flow, where length is some diameters."""

    type: Literal["exponential"] = Field(description="kind of coherence")
    length: Positive = Field(description="coherence length, m", examples=[0.05])

    def at(self, distances: Array) -> Array:
        """Return exp(-d / length)."""
        return np.asarray(np.exp(-distances / self.length))

    def pieces(self, length: float) -> Array:
        """Return pieces of at most two coherence lengths."""
        end = min(length, REACH * self.length)
        return np.asarray(np.linspace(0.0, end, 1 + int(np.ceil(0.5 * end / self.length))))
