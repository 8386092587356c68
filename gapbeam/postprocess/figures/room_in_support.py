"""Room of the axis of a beam in a support around it, in which orbits are drawn."""

from __future__ import annotations

import numpy as np

from gapbeam.postprocess.results.supports_of_run import RunFace

BEYOND = 3.0  # an open polygon is cut off at this many times the farthest wall
MARGIN = 1.2  # or at this many times the largest motion


def room_of(met: RunFace, motion: float = 0.0) -> np.ndarray:
    """Return the outline of the region d . (r - o) <= c + p(d) that the axis of a rigid beam keeps to, (n, 2), m.

    Args:
        met: A face around the beam.
        motion: The largest distance of the axis from its place, m.

    Returns:
        The corners (y, z) in order, the first one at the end again, a row of NaN where the region is open; nothing
        where the play is negative.
    """
    angles, distances = met.walls()
    reach = max(MARGIN * motion, BEYOND * float(np.abs(distances).max()))
    room = reach * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    for turn, distance in zip(np.radians(angles), distances, strict=True):
        room = _cut(room, np.array([np.sin(turn), -np.cos(turn)]), float(distance))
    if not len(room):
        return room
    closed = np.vstack([room, room[:1]])
    cut = np.isclose(np.abs(closed), reach, rtol=1.0e-9)
    open_after = np.flatnonzero(np.any(cut[:-1] & cut[1:], axis=1)) + 1
    return np.asarray(np.insert(closed, open_after, np.nan, axis=0) + np.array([met.lateral, met.offset]))


def _cut(room: np.ndarray, normal: np.ndarray, distance: float) -> np.ndarray:
    """Return the part of a convex polygon with n . r <= distance."""
    excess = room @ normal - distance
    kept = list[np.ndarray]()
    for here, there, one, other in zip(room, np.roll(room, -1, axis=0), excess, np.roll(excess, -1), strict=True):
        if one <= 0.0:
            kept.append(here)
        if one * other < 0.0:
            kept.append(here + (there - here) * (one / (one - other)))
    return np.array(kept).reshape(-1, 2)
