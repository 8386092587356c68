"""The mean motions of cross-sections of a mesh, as rows of its DOFs, and the forces that work on these motions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from gapbeam.solver.assembly.point_rows import PointRow, point_row
from gapbeam.solver.attachments.mean_motion import MeanMotion
from gapbeam.solver.case.case import Case
from gapbeam.solver.errors import UserError
from gapbeam.solver.system.operators import Array

POINTS = 4  # Gauss points through the thickness and across the width
INSIDE = 1.0e-9  # of the length, by which a section at an end lies in the body
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
    sections = {x: _section(case, space, x) for x in dict.fromkeys(motion.x for motion in motions)}
    for motion in motions:
        section = sections[motion.x]
        found = np.zeros(size)
        for row, force in zip(section.rows, motion.weights(section.across, section.areas), strict=True):
            found += row.force(force, size)
        yield found


def _section(case: Case, space: Any, place: float) -> _Section:
    """Find the points of the cross-section at a place. Collective."""
    beam, dimension = case.beam, space.mesh.geometry.dim
    x = min(max(place, INSIDE * beam.length), (1.0 - INSIDE) * beam.length)
    places, weights = np.polynomial.legendre.leggauss(POINTS)
    sides = (beam.thickness,) if dimension == 2 else (beam.width, beam.thickness)
    across = np.array(list(product(*(0.5 * side * places for side in sides))))
    areas = np.prod(np.array(list(product(*(weights for _ in sides)))), axis=1)
    rows: dict[int, PointRow] = {}
    for number, away in enumerate(across):
        point = np.pad(np.array([x, *away]), (0, 2 - len(away)))
        with suppress(UserError):  # outside of the body
            rows[number] = point_row(space, point, f"the cross-section at x = {place:g} m")
    if not (len(rows) == len(across) or (case.mesh.file is not None and len(rows) >= FEWEST)):
        raise UserError(
            f"the cross-section at x = {place:g} m has {len(rows)} of {len(across)} points in the "
            "body; a joint or a mass needs a section that the body fills; move it along the beam"
        )
    return _Section(tuple(rows.values()), across[list(rows)], areas[list(rows)])
