"""The straight line that follows the supports: what motion relative to supports that move is counted from.

    r(x, t) = sum_k (w_k(t) - w_k(0)) L_k(x),    u_rel = u - r

L_k(x) is the line of least squares, at x, through the middles of all supports and joints, where the support that the
motion w_k moves is displaced by a unit along its direction and all others are at rest. Supports that move alike give
r = w; a support alone gives r = w, too. A body without inertia that touches two supports follows r.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gapbeam.solver.case.case import Case
from gapbeam.solver.loads.load_directions import load_direction
from gapbeam.solver.loads.places import SupportWalls
from gapbeam.solver.loads.support_walls import moved_by
from gapbeam.solver.system.operators import Array

NEAR = 1.0e-9  # of the length of the beam: supports at one place


def supports_move(case: Case) -> bool:
    """Return whether a load moves a support, beyond the change of a clearance."""
    return any(isinstance(load.place, SupportWalls) and not load.place.opens for load in case.load)


def support_line(case: Case, places: Sequence[float]) -> Array:
    """Return L, by how much a unit of each motion of walls moves the line at places along the beam, (k, places, d).

    Args:
        case: The case, whose loads are in the order of its motions of walls; d is the dimension of its mesh.
        places: x, m.
    """
    supports, dimension = case.layout.supports, case.mesh.dimension
    x = np.array([*(0.5 * (one.start + one.end) for one in supports), *(joint.point for joint in case.joint)])
    length = case.beam.length
    degree = 1 if np.ptp(x) > NEAR * length else 0
    middle = float(np.mean(x))
    fit = np.linalg.pinv(np.vander((x - middle) / length, degree + 1, increasing=True))
    powers = np.vander((np.asarray(places, dtype=float) - middle) / length, degree + 1, increasing=True)
    follows: Array = np.asarray(powers @ fit, dtype=np.float64)
    found = list[Array]()
    for load in case.load:
        if isinstance(load.place, SupportWalls):
            moved = moved_by(load.place, case.layout)
            share: Array = np.zeros(len(places))
            if moved is not None and not load.place.opens:
                share = follows[:, [one.name for one in supports].index(moved.name)]
            found.append(share[:, None] * np.asarray(load_direction(load, dimension)))
    return np.array(found).reshape(len(found), len(places), dimension)
