"""Places in another order: meshes are numbered anew for every number of ranks."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from gapbeam.solver.system.operators import Array, Indices

SAME_PLACE = 1.0e-9  # of the extent of all places


def matching(places: Array, wanted: Array) -> Indices:
    """Return the numbers of the wanted places, (n,), so that `places[matching(places, wanted)]` is `wanted`.

    Args:
        places: (n, d), m.
        wanted: The same places in another order, up to round-off, (n, d), m.

    Raises:
        ValueError: They are not the same places, or some are there twice.
    """
    if places.shape != wanted.shape:
        raise ValueError(f"{places.shape[0]} places, expected {wanted.shape[0]}")
    if np.array_equal(places, wanted):
        return np.arange(len(places))
    near, found = cKDTree(places).query(wanted)
    farthest = float(np.max(near, initial=0.0))
    if farthest > SAME_PLACE * float(np.max(np.ptp(wanted, axis=0))):
        raise ValueError(f"places that lie {farthest:.3g} m apart")
    if len(np.unique(found)) < len(found):
        raise ValueError("places that are there twice")
    return np.asarray(found)
