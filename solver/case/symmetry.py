"""Whether a case is symmetric about its bending plane."""

from __future__ import annotations

from gapbeam.solver.case.case import Case


def is_symmetric(case: Case) -> bool:
    """Return whether mesh and loads of a case are symmetric about the bending plane (3D), as far as its keys show."""
    if case.mesh.dimension == 2 or case.mesh.file is not None or case.mesh.cell not in (None, "hexahedron"):
        return False
    if any(face.around for face in case.layout.faces):  # the beam may roll to one side of a hole
        return False
    if case.contact.rubs is not None or case.contact.points is not None:
        return False
    points = [load.place.point for load in case.load]
    directions = [load.direction for load in case.load if load.direction is not None]
    return not any(isinstance(vector, tuple) and len(vector) > 1 and vector[1] != 0.0 for vector in points + directions)
