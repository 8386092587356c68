"""Places of contact points along and around a beam: the different ones, and means over the points at each."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

_DIGITS = 9  # of the largest place: places that differ by less count as one


def distinct(places: Sequence[float] | np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the different places, ascending, and the number of its place for each point.

    Args:
        places: Places of the points, (m,), m or degrees.
    """
    scale = float(np.abs(places).max(initial=0.0)) or 1.0
    found, owners = np.unique(np.round(np.asarray(places) / scale, _DIGITS), return_inverse=True)
    return scale * found, owners


def means_by_place(places: np.ndarray, sums: np.ndarray, areas: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the different places, ascending, and the sum per area of the points at each.

    Args:
        places: Places of the points, (m,), m or degrees.
        sums: Values of the points, (m,).
        areas: Area that belongs to each point, (m,), m^2.
    """
    found, owners = distinct(places)
    return found, np.bincount(owners, sums) / np.bincount(owners, areas)
