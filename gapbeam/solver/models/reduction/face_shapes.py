"""Shapes of pressure on the contact faces: hat functions along the support times powers across it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import ContactOperator

SAME_PLACE = 1.0e-6  # of the length of a face
HARMONICS = 4  # around a hole


def face_shapes(
    contact: ContactOperator, count: int, powers: tuple[int, ...], touching: NDArray[np.bool_] | None = None
) -> Array:
    """Return pressures of unit size at the contact points, (m, shapes): hat functions times y^k, face by face.

    In holes they are hat functions times cos(k t) and sin(k t), with t the angle about the axis.

    Args:
        contact: The contact points.
        count: Number of hat functions along each face, at least 2.
        powers: The powers k; y is measured from the middle of the face over half its width.
        touching: Which points can touch, (m,); pressure is on them alone, and their width counts. None: all.
    """
    along, across = contact.positions[:, 0], contact.positions[:, 1]
    columns = []
    for face, met in enumerate(contact.support.faces):
        here = contact.faces == face
        if met.around:
            columns += _around(contact, here, count)
            continue
        if touching is not None:
            here &= touching
        x, y = along[here], across[here]
        knots = np.linspace(x.min(), x.max(), count)
        span = knots[1] - knots[0]
        half = 0.5 * np.ptp(y)
        side = (y - 0.5 * (y.max() + y.min())) / half if half > 0.0 else np.zeros_like(y)
        for knot in knots:
            hat = np.maximum(1.0 - np.abs(x - knot) / span, 0.0)
            for power in powers if half > 0.0 else (0,):
                column = np.zeros(contact.size)
                column[here] = hat * side**power
                columns.append(column)
    return np.stack(columns, axis=1)


def _around(contact: ContactOperator, here: NDArray[np.bool_], count: int) -> list[Array]:
    """Return the pressures of a hole; along it no more hat functions than places, two for three of them."""
    x, y, z = contact.positions[here].T
    places = 1 + int(np.sum(np.diff(np.sort(x)) > SAME_PLACE * np.ptp(x)))
    knots = np.linspace(x.min(), x.max(), max(2, min(count, 2 * places // 3)))
    angles = np.arctan2(z, y)
    waves = [np.ones_like(angles)]
    for number in range(1, HARMONICS + 1):
        waves += [np.cos(number * angles), np.sin(number * angles)]
    found = list[Array]()
    for knot in knots:
        hat = np.maximum(1.0 - np.abs(x - knot) / (knots[1] - knots[0]), 0.0)
        for wave in waves:
            column = np.zeros(contact.size)
            column[here] = hat * wave
            found.append(column)
    return found
