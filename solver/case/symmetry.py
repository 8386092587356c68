"""Whether a case is symmetric about its bending plane, and what moves a beam out of it."""

from __future__ import annotations

from collections.abc import Iterable

from gapbeam.solver.case.case import Case
from gapbeam.solver.loads.load_choice import Load
from gapbeam.solver.supports.layout import Layout


def is_symmetric(case: Case) -> bool:
    """Return whether mesh and loads of a case are symmetric about the bending plane (3D), as far as its keys show."""
    if case.mesh.dimension == 2 or case.mesh.file is not None or case.mesh.cell not in (None, "hexahedron"):
        return False
    if case.layout.holes:  # the beam may roll to one side of a hole
        return False
    if case.contact.rubs is not None or case.contact.points is not None:
        return False
    points = [load.place.point for load in case.load]
    directions = [load.direction for load in case.load if load.direction is not None]
    return not any(isinstance(vector, tuple) and len(vector) > 1 and vector[1] != 0.0 for vector in points + directions)


def bends_in_two_planes(case: Case) -> bool:
    """Return whether something moves the beam out of its bending plane: a hole, or a load beside the bending axis."""
    return moves_in_space(case.mesh.dimension, case.layout, case.load)


def moves_in_space(dimension: int, layout: Layout, loads: Iterable[Load]) -> bool:
    """Return the same by the dimension of the mesh, the supports and the loads."""
    if dimension == 2:
        return False
    sideways = any(load.direction is not None and load.direction[1] != 0.0 for load in loads)
    return sideways or bool(layout.holes)
