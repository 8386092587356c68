"""Symmetry of a case about its bending plane, and causes of motion out of it."""

from __future__ import annotations

from collections.abc import Iterable

from gapbeam.solver.attachments.attachment_tables import PointMass
from gapbeam.solver.attachments.mean_motion import SIDEWAYS
from gapbeam.solver.case.analysis_table import Analysis
from gapbeam.solver.case.case import Case
from gapbeam.solver.loads.load_choice import Load
from gapbeam.solver.supports.layout import Layout


def is_symmetric(case: Case) -> bool:
    """Return whether mesh, loads and start are symmetric about the bending plane (3D), as far as the case shows.

    A start along the beam counts as one that is not: of symmetric bodies only those motions are kept that contact or
    loads cause.
    """
    if case.mesh.dimension == 2 or case.mesh.file is not None or case.mesh.cell not in (None, "hexahedron"):
        return False
    if not all(piece.beam.section.mirrored for piece in case.profile.pieces):
        return False
    if case.layout.holes:  # the beam may roll to one side of a hole
        return False
    if case.contact.rubs is not None or case.contact.points is not None or case.analysis.moves_aside:
        return False
    if any(mass.away[1] != 0.0 for mass in case.mass):
        return False
    points = [load.place.point for load in case.load]
    directions = [load.direction for load in case.load if load.direction is not None]
    return not any(isinstance(vector, tuple) and len(vector) > 1 and vector[1] != 0.0 for vector in points + directions)


def bends_in_two_planes(case: Case) -> bool:
    """Return whether a hole, or a load or mass off its plane, or a start moves the beam out of its bending plane."""
    return moves_in_space(case.mesh.dimension, case.layout, case.load, case.mass, case.analysis)


def moves_in_space(
    dimension: int, layout: Layout, loads: Iterable[Load], masses: Iterable[PointMass], analysis: Analysis
) -> bool:
    """Return the same by the dimension of the mesh, the supports, the loads, the masses and the start."""
    if dimension == 2:
        return False
    if any(mass.away[1] != 0.0 for mass in masses):
        return True
    starts = not analysis.moves_aside.isdisjoint(SIDEWAYS)
    return starts or bool(layout.holes) or any(bends_sideways(load) for load in loads)


def bends_sideways(load: Load) -> bool:
    """Return whether a load in 3D acts sideways, or along the beam off its bending plane."""
    if load.direction is None:
        return False
    point = load.place.point
    beside = isinstance(point, tuple) and len(point) > 1 and point[1] != 0.0
    return load.direction[1] != 0.0 or (beside and load.direction[0] != 0.0)
