"""The mean motion of a cross-section of a mesh, as a row of its DOFs, and the forces that work on that motion."""

from __future__ import annotations

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


def section_row(case: Case, space: Any, size: int, motion: MeanMotion) -> Array:
    """Return the row of a mean motion: the motion is the scalar product of row and displacements, over all ranks.

    Args:
        case: The case; its beam gives the box of the section.
        space: Blocked Lagrange space.
        size: Number of DOFs that this rank owns.
        motion: The motion.

    Returns:
        (size,).

    Raises:
        UserError: The section has hardly any points in the body; on all ranks.

    Collective.
    """
    beam, dimension = case.beam, space.mesh.geometry.dim
    x = min(max(motion.x, INSIDE * beam.length), (1.0 - INSIDE) * beam.length)
    places, weights = np.polynomial.legendre.leggauss(POINTS)
    sides = (beam.thickness,) if dimension == 2 else (beam.width, beam.thickness)
    across = np.array(list(product(*(0.5 * side * places for side in sides))))
    areas = np.prod(np.array(list(product(*(weights for _ in sides)))), axis=1)
    rows: list[PointRow | None] = []
    for place in across:
        point = np.pad(np.array([x, *place]), (0, 2 - len(place)))
        try:
            rows.append(point_row(space, point, f"the cross-section at x = {motion.x:g} m"))
        except UserError:
            rows.append(None)
    inside = np.array([row is not None for row in rows])
    if not (np.all(inside) or (case.mesh.file is not None and np.count_nonzero(inside) >= FEWEST)):
        raise UserError(
            f"the cross-section at x = {motion.x:g} m has {np.count_nonzero(inside)} of {len(inside)} points in the "
            "body; a joint or a mass needs a section that the body fills; move it along the beam"
        )
    factors = motion.weights(across[inside], areas[inside])
    found = np.zeros(size)
    for row, force in zip([row for row in rows if row is not None], factors, strict=True):
        found += row.force(force, size)
    return found
