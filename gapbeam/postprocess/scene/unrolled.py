"""The surface of a beam in a hole, unrolled: x along it, the angle around it."""

from __future__ import annotations

import numpy as np

_TOP = 179.99  # degrees


def unrolled(numbers: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return points around a beam with x, m, and the angle from its lowest line, degrees; those at the top twice.

    Args:
        numbers: Of the points around the beam, (p,).
        points: Of the mesh, (n, 3), m.

    Returns:
        Numbers, x and angle of each, positive toward +y; the points at the top are at 180 degrees and again at -180.
    """
    x, y, z = points[numbers].T
    angles = np.degrees(np.arctan2(y, -(z - 0.5 * (z.max() + z.min()))))
    top = np.flatnonzero(np.abs(angles) > _TOP)
    angles[top] = 180.0
    return np.r_[numbers, numbers[top]], np.r_[x, x[top]], np.r_[angles, np.full(len(top), -180.0)]
