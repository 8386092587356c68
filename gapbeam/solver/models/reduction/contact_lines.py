"""Fewer contact points across the width: a Gauss rule on each line of contact points across a face.

The contact points (x, y_j) with weights w_j of one line make a discrete measure. Its Gauss rule has k nodes y_i, and
the gap at a node is that of the polynomial of degree k - 1 that fits the gaps of the line best, g_i = sum_j P_ij g_j
(`assembly.gauss_rule`). Motions that are symmetric about the bending plane are polynomials in y^2: the measure is then
that of y^2, and k nodes integrate twice the degree.

A mean over points with other initial gaps is the gap of no place: the lowest point of a round face touches long before.
Lines whose initial gaps differ keep the points of the mesh, those within reach of the face that they are met by; where
all motion is symmetric, the points at y and -y are one. Holes keep all points of the mesh.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from gapbeam.solver.assembly.gauss_rule import gauss_rule
from gapbeam.solver.contact.formulations.contact_points import ResultantOperator, mean_tangents
from gapbeam.solver.system.operators import Array, Indices
from gapbeam.solver.system.semi_discrete import ContactOperator

SAME_PLACE = 1.0e-6  # of the length of a face
EVEN = 1.0e-6  # of the size of a face; initial gaps of a line that differ by less are one
FEWEST = 3  # points on a line for each node


def within_reach(contact: ContactOperator, reach: float) -> NDArray[np.bool_]:
    """Return the points that lie less than a distance, m, above the lowest point of their face, (m,)."""
    lowest = np.full(len(contact.face_names), np.inf)
    np.minimum.at(lowest, contact.faces, contact.initial_gap)
    return np.asarray(contact.initial_gap - lowest[contact.faces] <= reach)


def across_lines(
    contact: ContactOperator, count: int, symmetric: bool, spacing: float, reach: float = np.inf
) -> ContactOperator:
    """Return the operator with `count` points on each line across the faces; the same where lines have no more.

    Args:
        contact: Operator at the points of the mesh.
        count: k.
        symmetric: Whether all motion is symmetric about the bending plane.
        spacing: Length along x that is taken for one line where the points do not lie on lines, m.
        reach: Points of uneven lines that lie higher above the lowest point of their face never touch, m.
    """
    touching = within_reach(contact, reach)
    length = float(np.ptp(contact.positions[:, 0]))
    rows: list[tuple[Indices, Array]] = []
    areas: list[float] = []
    owners: list[int] = []
    for face, met in enumerate(contact.support.faces):
        here = np.flatnonzero(contact.faces == face)
        for line in [here] if met.around else _lines(contact, here, count, spacing):
            if met.around or np.ptp(contact.initial_gap[line]) > EVEN * length:
                kept = line if met.around else line[touching[line]]
                for points in _mirrored(contact, kept, symmetric and not met.around):
                    rows.append((points, np.full(len(points), 1.0 / len(points))))
                    areas.append(float(contact.weights[points].sum()))
                    owners.append(face)
                continue
            y, weights = contact.positions[line, 1], contact.weights[line]
            if symmetric:
                y = (y - 0.5 * (y.max() + y.min())) ** 2
            rule = gauss_rule(y, weights, count)
            for area, row in zip(rule.areas, rule.rows, strict=True):
                rows.append((line, row))
                areas.append(area)
                owners.append(face)
    if len(rows) >= contact.size:
        return contact
    shares = csr_matrix(
        (
            np.concatenate([row for _, row in rows]),
            np.concatenate([line for line, _ in rows]),
            np.cumsum([0, *(len(line) for line, _ in rows)]),
        ),
        (len(rows), contact.size),
    )
    return ResultantOperator(
        interface=contact.interface,
        gap_matrix=csr_matrix(shares @ contact.gap_matrix),
        weights=np.array(areas),
        initial_gap=np.asarray(shares @ contact.initial_gap),
        faces=np.array(owners),
        support=contact.support,
        positions=np.asarray(shares @ contact.positions),
        tangents=mean_tangents(contact, shares),
        frictionless=contact.frictionless,
        distributed=contact,
        shares=shares,
    )


def _lines(contact: ContactOperator, points: Indices, count: int, spacing: float) -> list[Indices]:
    """Return the points of a face line by line: by equal x, or in strips where hardly any x is equal."""
    points = points[np.argsort(contact.positions[points, 0], kind="stable")]
    x = contact.positions[points, 0]
    breaks = np.flatnonzero(np.diff(x) > SAME_PLACE * np.ptp(x)) + 1
    if len(points) < FEWEST * count * (len(breaks) + 1):
        strip = np.floor((x - x[0]) / spacing * (1.0 - SAME_PLACE))
        breaks = np.flatnonzero(np.diff(strip) > 0.0) + 1
    return np.split(points, breaks)


def _mirrored(contact: ContactOperator, line: Indices, symmetric: bool) -> list[Indices]:
    """Return the points of a line one by one, or in pairs at y and -y, where symmetric motion moves both alike."""
    if not symmetric:
        return list(line[:, None])
    away = np.abs(contact.positions[line, 1])
    order = np.argsort(away, kind="stable")
    breaks = np.flatnonzero(np.diff(away[order]) > SAME_PLACE * away.max(initial=0.0)) + 1
    return [points for points in np.split(line[order], breaks) if len(points)]
