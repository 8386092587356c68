"""Means of values of contact points over those at one place along the beam, or in one direction."""

from __future__ import annotations

import numpy as np

_DIGITS = 9  # of places that count as one


def means_by_place(places: np.ndarray, sums: np.ndarray, areas: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the different places, ascending, and the sum per area of the points at each.

    Args:
        places: Of the points, (m,), m or degrees.
        sums: What each point has, (m,).
        areas: That belong to them, (m,), m^2.
    """
    found, owners = np.unique(np.round(places, _DIGITS), return_inverse=True)
    return found, np.bincount(owners, sums) / np.bincount(owners, areas)
