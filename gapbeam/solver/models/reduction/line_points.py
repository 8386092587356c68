"""The contact points that a reduced model keeps across the width."""

from __future__ import annotations

from typing import Literal

from gapbeam.solver.case.case import Case
from gapbeam.solver.models.reduction.contact_lines import across_lines
from gapbeam.solver.system.semi_discrete import ContactOperator

SPACING = 0.25  # of a facet, between lines of points that do not lie on lines
REACH = 0.05  # of the thickness: what lies higher touches only where displacements are not small
UNSYMMETRIC = 4  # times as many points across the width, where faces may close on one side alone


def gathered_points(
    case: Case, contact: ContactOperator, symmetric: bool, across: int | Literal["all"], facet_length: float
) -> ContactOperator:
    """Return the operator with few points on each line across the faces of a solid; that of the mesh elsewhere.

    Lines of faces that are not flat across keep the points of the mesh that can touch.

    Args:
        case: The case.
        contact: Operator at the points of the mesh.
        symmetric: Whether all motion is symmetric about the bending plane.
        across: Points on a line, four times as many where the motion is not symmetric; "all": those of the mesh.
        facet_length: Mean length of the contact facets along the beam, m.
    """
    if case.mesh.dimension == 2 or across == "all" or case.contact.points is not None or contact.rubbed is not None:
        return contact
    count = across if symmetric else UNSYMMETRIC * across
    return across_lines(contact, count, symmetric, SPACING * facet_length, REACH * case.profile.thinnest)
