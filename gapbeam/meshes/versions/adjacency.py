"""DOLFINx's lists of lists, which partitioners return; its C++ names, which are not promised to stay."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
import numpy.typing as npt
from dolfinx.cpp.graph import AdjacencyList_int32

Adjacency: TypeAlias = AdjacencyList_int32


def adjacency(values: npt.NDArray[np.integer], starts: npt.NDArray[np.integer]) -> Adjacency:
    """Return a list of lists.

    Args:
        values: All lists, one after the other.
        starts: Where each list begins, and the end of the last one, (lists + 1,).
    """
    return AdjacencyList_int32(np.ascontiguousarray(values, np.int32), np.ascontiguousarray(starts, np.int32))
