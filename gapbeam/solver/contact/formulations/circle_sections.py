"""The sections that are met as circles: which points belong to one, and by which motions they move together."""

from __future__ import annotations

import numpy as np

from gapbeam.solver.errors import UserError
from gapbeam.solver.system.operators import Array, Indices
from gapbeam.solver.system.semi_discrete import ContactOperator

SAME_PLACE = 1.0e-9  # of the length over which points stand: at one x
RIGID = 1.0e-8  # of the largest entry: what points of one section may move apart by round-off


def stations_of(points: ContactOperator, chosen: Indices) -> list[Indices]:
    """Return the points at one x of one face each."""
    found, length = list[Indices](), max(float(np.ptp(points.positions[:, 0])), np.finfo(float).tiny)
    for face in np.unique(points.faces[chosen]):
        here = chosen[points.faces[chosen] == face]
        here = here[np.argsort(points.positions[here, 0], kind="stable")]
        breaks = np.flatnonzero(np.diff(points.positions[here, 0]) > SAME_PLACE * length) + 1
        found += np.split(here, breaks)
    return found


def section_motions(points: ContactOperator, members: Indices, deforms: bool = False) -> tuple[Array, Array]:
    """Return the rows of a section: of its axis, (2, size), and of its surface, (4, size), if there are tangents.

    Args:
        points: The operator at points around sections.
        members: The points of the section.
        deforms: Whether points may move apart: the rows are then those of the best fit by least squares.
    """
    limit = np.inf if deforms else RIGID
    across, gaps = points.across[members], points.gap_matrix[members].toarray()
    plane = _fitted(across, gaps, points, members, limit)
    if points.tangents is None:
        return plane, np.zeros((0, plane.shape[1]))
    along, around = (points.tangents[2 * members + axis].toarray() for axis in (0, 1))
    spots = points.positions[members, 1:]
    axial = _fitted(np.column_stack([np.ones(len(members)), spots]), along, points, members, limit)
    sideways = np.stack([-across[:, 1], across[:, 0]], axis=1)
    arms = sideways[:, 1] * spots[:, 0] - sideways[:, 0] * spots[:, 1]
    turn = _fitted(arms[:, None], around - sideways @ plane, points, members, limit, float(np.abs(around).max()))
    return plane, np.concatenate([axial, turn])


def _fitted(
    basis: Array, rows: Array, points: ContactOperator, members: Indices, limit: float, largest: float = 0.0
) -> Array:
    """Return the rows, (b, size), of which all rows, (m, size), are combinations with `basis`, (m, b)."""
    found = np.linalg.lstsq(basis, rows)[0]
    if np.abs(basis @ found - rows).max() > limit * max(float(np.abs(rows).max()), largest):
        name, x = points.face_names[points.faces[members[0]]], points.positions[members[0], 0]
        raise UserError(
            f"{name} at x = {x:.4g} m is met as a circle, and the section there does not keep its shape\n"
            "  expected: a model whose sections keep it\n"
            '  try:      contact = "points" in the region of the support'
        )
    return np.asarray(found)
