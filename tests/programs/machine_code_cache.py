"""Compile an entry; reports where it is kept, and what it computed."""

from __future__ import annotations

import numpy as np

from gapbeam.solver.compilation.jit import cache_folder, entry
from gapbeam.solver.system.operators import Array


@entry
def total(x: Array) -> float:
    """Return the sum of some numbers."""
    found = 0.0
    for one in x:
        found += one
    return found


print(cache_folder(), total(np.full(3, 2.0)))
