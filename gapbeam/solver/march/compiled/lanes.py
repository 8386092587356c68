"""Rows of whole SIMD lanes: the modal coordinates of a kernel, filled up with coordinates that never move.

Loops over rows are compiled to work on 16 numbers at a time, and what is left of a row is worked on one by one: rows
of 64 numbers take less time than those of 59.
"""

from __future__ import annotations

import numpy as np

from gapbeam.solver.system.operators import Array

LANES = 16  # numbers that a compiled loop works on at a time
MOST_ADDED = 0.2  # of the numbers that there are


def lanes_for(size: int) -> int:
    """Return the length of a kernel's rows for `size` coordinates."""
    whole = -(-size // LANES) * LANES
    return whole if whole <= (1.0 + MOST_ADDED) * size else size


def widened(x: Array) -> Array:
    """Return an array whose last axis, of coordinates, is filled up with zeros to whole lanes."""
    wide = np.zeros((*x.shape[:-1], lanes_for(x.shape[-1])))
    wide[..., : x.shape[-1]] = x
    return wide
