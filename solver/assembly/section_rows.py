"""The mean motions of cross-sections of a mesh, as rows of its DOFs, and the forces that work on these motions.

A point on the axis of a hollow beam stands for its whole cross-section: it moves as the section does on average, and a
force there is spread over the section.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from gapbeam.solver.assembly.case_mesh import geometry_of
from gapbeam.solver.assembly.point_rows import PointFinder, PointRow, point_row
from gapbeam.solver.attachments.mean_motion import MeanMotion
from gapbeam.solver.case.case import Case
from gapbeam.solver.errors import UserError
from gapbeam.solver.loads.load_directions import axis_point
from gapbeam.solver.system.operators import Array

POINTS = 4  # Gauss points through the thickness and across the width, or along each side of a patch
INSIDE = 1.0e-9  # of the length, by which a section at an end lies in the body
BEYOND = 0.2  # of a curved cell: how far coarse cells leave an arc
FEWEST = 3  # points of a user's mesh that a section has to have


@dataclass(frozen=True)
class _Section:
    """Points of a cross-section that lie in the body.

    Attributes:
        rows: Basis functions at the points.
        across: Their coordinates across the axis, (k, dimension - 1), m.
        areas: Their weights, (k,).
    """

    rows: tuple[PointRow, ...]
    across: Array
    areas: Array


def section_rows(case: Case, space: Any, size: int, motions: Sequence[MeanMotion]) -> Iterator[Array]:
    """Yield the row of each mean motion: the motion is the scalar product of row and displacements, over all ranks.

    Args:
        case: The case; its beam gives the box of the sections.
        space: Blocked Lagrange space.
        size: Number of DOFs that this rank owns.
        motions: The motions.

    Yields:
        (size,).

    Raises:
        UserError: A section has hardly any points in the body; on all ranks.

    Collective.
    """
    if not motions:
        return
    finder = PointFinder(space)
    sections = {x: _section(case, finder, x) for x in dict.fromkeys(motion.x for motion in motions)}
    for motion in motions:
        section = sections[motion.x]
        found = np.zeros(size)
        for row, force in zip(section.rows, motion.weights(section.across, section.areas), strict=True):
            found += row.force(force, size)
        yield found


def row_at(case: Case, space: Any, point: float | tuple[float, ...], name: str) -> PointRow:
    """Return the row of a point of the body, or of the cross-section for a point on the axis of a hollow beam.

    Args:
        case: The case.
        space: Blocked Lagrange space.
        point: x on the axis, or all coordinates, m.
        name: What to call the point in an error.

    Raises:
        UserError: The point, or the section, lies outside the mesh; on all ranks.

    Collective.
    """
    place = axis_point(point)
    hollow = case.profile.at(float(place[0])).beam.hollow
    if not (hollow and case.mesh.file is None) or np.any(place[1:]):
        return point_row(space, place, name)
    section = _section(case, PointFinder(space), float(place[0]))
    shares = section.areas / section.areas.sum()
    nodes = np.concatenate([row.nodes for row in section.rows])
    values = np.concatenate([share * row.values for share, row in zip(shares, section.rows, strict=True)])
    found, slots = np.unique(nodes, return_inverse=True)
    return PointRow(
        found, np.bincount(slots, weights=values, minlength=len(found)).astype(float), section.rows[0].components
    )


def _section(case: Case, finder: PointFinder, place: float) -> _Section:
    """Find the points of the cross-section at a place. Collective."""
    beam, dimension = case.beam, finder.space.mesh.geometry.dim
    x = min(max(place, INSIDE * beam.length), (1.0 - INSIDE) * beam.length)
    across, areas = _quadrature(case, x, dimension)
    rows = dict[int, PointRow]()
    for number, away in enumerate(across):
        point = np.pad(np.array([x, *away]), (0, 2 - len(away)))
        with suppress(UserError):  # outside of the body
            rows[number] = finder.row(point, f"the cross-section at x = {place:g} m", BEYOND)
    if not (len(rows) == len(across) or (case.mesh.file is not None and len(rows) >= FEWEST)):
        raise UserError(
            f"the cross-section at x = {place:g} m has {len(rows)} of {len(across)} points in the "
            "body; a joint or a mass needs a section that the body fills; move it along the beam"
        )
    return _Section(tuple(rows.values()), across[list(rows)], areas[list(rows)])


def _quadrature(case: Case, x: float, dimension: int) -> tuple[Array, Array]:
    """Return points of the cross-section at a place, (k, dimension - 1), m, and their weights, (k,)."""
    beam = case.profile.at(x).beam
    if (patches := geometry_of(case).at(x).section) is not None:
        return patches.quadrature(POINTS)
    places, weights = np.polynomial.legendre.leggauss(POINTS)
    sides = (beam.thickness,) if dimension == 2 else (beam.width, beam.thickness)
    across = np.array(list(product(*(0.5 * side * places for side in sides))))
    return across, np.prod(np.array(list(product(*(weights for _ in sides)))), axis=1)
