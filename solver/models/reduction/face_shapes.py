"""Shapes of pressure on the contact faces: hat functions along the support times powers across it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import ContactOperator


def face_shapes(
    contact: ContactOperator, count: int, powers: tuple[int, ...], touching: NDArray[np.bool_] | None = None
) -> Array:
    """Return pressures of unit size at the contact points, (m, shapes): hat functions times y^k, face by face.

    Args:
        contact: The contact points.
        count: Number of hat functions along each face, at least 2.
        powers: The powers k; y is measured from the middle of the face over half its width.
        touching: Which points can touch, (m,); pressure is on them alone, and their width counts. None: all.
    """
    along, across = contact.positions[:, 0], contact.positions[:, 1]
    columns = []
    for face in range(len(contact.face_names)):
        here = contact.faces == face
        if touching is not None:
            here &= touching
        x, y = along[here], across[here]
        knots = np.linspace(x.min(), x.max(), count)
        span = knots[1] - knots[0]
        half = 0.5 * np.ptp(y)
        side = (y - 0.5 * (y.max() + y.min())) / half if half > 0.0 else np.zeros_like(y)
        for knot in knots:
            hat = np.maximum(1.0 - np.abs(x - knot) / span, 0.0)
            for power in powers:
                column = np.zeros(contact.size)
                column[here] = hat * side**power
                columns.append(column)
    return np.stack(columns, axis=1)
