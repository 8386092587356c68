"""Contact points that a reduced model keeps across the width, and a check of them against the mesh.

A model whose points are means over the points of a mesh is compared with that mesh where it lies undeformed, and where
it is seated: the deepest points of each face have to be as deep, or the beam rests elsewhere than its mesh would.
"""

from __future__ import annotations

from math import isclose
from typing import Literal

import numpy as np

from gapbeam.solver.case.case import Beam, Case
from gapbeam.solver.case.model_choice import line_radii
from gapbeam.solver.contact.formulations.contact_points import ResultantOperator
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.models.reduction.contact_lines import across_lines
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import ContactOperator

SPACING = 0.25  # of a facet, between lines of points that do not lie on lines
REACH = 0.05  # of the thickness: what lies higher touches only where displacements are not small
UNSYMMETRIC = 4  # times as many points across the width, where faces may close on one side alone


def gathered_points(
    case: Case, contact: ContactOperator, symmetric: bool, across: int | Literal["auto", "all"], facet_length: float
) -> ContactOperator:
    """Return the operator with few points on each line across the faces of a solid, and the mesh's points elsewhere.

    Lines of faces that are not flat across keep the points of the mesh that can touch.

    Args:
        case: The case.
        contact: Operator at the points of the mesh.
        symmetric: Whether all motion is symmetric about the bending plane.
        across: Points on a line, four times as many where the motion is not symmetric; "all": those of the mesh;
            "auto": 1 for solid rectangles, else all, as the pressure of a hollow section gathers under its webs.
        facet_length: Mean length of the contact facets along the beam, m.
    """
    if across == "auto":
        across = 1 if all(_is_filled(piece.beam) for piece in case.profile.supported(case.layout)) else "all"
    if case.mesh.dimension == 2 or across == "all" or case.contact.points is not None or contact.rubbed is not None:
        return contact
    count = across if symmetric else UNSYMMETRIC * across
    return across_lines(contact, count, symmetric, SPACING * facet_length, REACH * case.profile.thinnest)


def _is_filled(beam: Beam) -> bool:
    """Return whether a section is a solid rectangle, or round, whose lines are not flat."""
    return beam.section.round or isclose(beam.area, beam.thickness * beam.width, rel_tol=1e-9)


OF_CLEARANCE = 0.1
OF_THICKNESS = 1.0e-4


def refuse_other_faces(case: Case, contact: ContactOperator, interface_values: Array, pose: str) -> None:
    """Refuse a model whose faces are not where those of its mesh are.

    Args:
        case: The case.
        contact: The contact operator of the model.
        interface_values: The pose, (interface.size,), m.
        pose: Its name.

    Raises:
        UserError: The deepest points of a face differ by more than a tenth of the clearance and 1e-4 of the thickness.
    """
    if not isinstance(contact, ResultantOperator) or case.contact.points is not None:
        return
    own, mesh = contact.depth(interface_values), contact.distributed.depth(interface_values)
    allowed = OF_CLEARANCE * abs(case.layout.clearance) + OF_THICKNESS * case.profile.thinnest
    finer = "more stations" if case.model.rings else 'points_across = "all" (reduced)'
    for face, (name, radius) in enumerate(zip(contact.face_names, line_radii(case), strict=True)):
        if radius is not None:  # motion along a flat wall closes gaps of points around a section, but not of lines
            continue
        found = float(np.max(own[contact.faces == face], initial=-np.inf))
        there = float(np.max(mesh[contact.distributed.faces == face]))
        if not abs(found - there) <= allowed:
            raise UserError(
                f'[model] type = "{case.model.type}": its {name} differs from the mesh it comes from, {pose}\n'
                f"  found:    the deepest contact point {found:.3g} m deep, in the mesh {there:.3g} m\n"
                f"  expected: the same to {allowed:.2g} m, or the beam rests elsewhere than its mesh would\n"
                f'  try:      {finer} in [model], or type = "full"'
            )
