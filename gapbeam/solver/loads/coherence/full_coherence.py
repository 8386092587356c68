"""rho = 1: one force at all places, such as the sound of a long wave or the flow at the tip of a jet."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field

from gapbeam.solver.loads.coherence.coherence_table import CoherenceTable
from gapbeam.solver.system.operators import Array


class FullCoherence(CoherenceTable):
    """1 at all distances: the load is the same at all places, but for its velocity profile."""

    type: Literal["full"] = Field(description="kind of coherence")

    def at(self, distances: Array) -> Array:
        """Return 1."""
        return np.ones(np.shape(distances))

    def pieces(self, length: float) -> Array:
        """Return the whole length."""
        return np.array([0.0, length])
