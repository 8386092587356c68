"""The contact stiffness of an interference fit in models whose sections keep their shape.

A solid rectangle that two planes squeeze by |c| has the pressure p = E' |c| / h, with its thickness h; E' = E where it
may expand sideways, E / (1 - nu^2) in plane strain. A beam of elements and a rigid body are not squeezed. The springs
of their contact stand for the section: each face sinks by |c| / 2, so that the stiffness per area is

    p / (|c| / 2) = 2 E' / h

Source: Hooke's law; the pressure is the same all along but for a thickness or so next to the edges of the support.
"""

from __future__ import annotations

from gapbeam.solver.case.case import Case
from gapbeam.solver.case.computed_defaults import Default
from gapbeam.solver.case.solution_tables import BeamModel, RigidModel
from gapbeam.solver.sections.section_table import RectangularSection

FACES = 2  # that squeeze a section


def squeezed_stiffness(case: Case) -> Default | None:
    """Return the stiffness per area of squeezed sections; None: the contact is no interference fit of such a model.

    It asks for a beam model or a rigid one, `contact.stiffness = "auto"` with linear springs over faces, and sections
    that are solid rectangles. Every support that brings no stiffness of its own has an interference.
    """
    contact, mesh = case.contact, case.mesh
    if not isinstance(case.model, BeamModel | RigidModel) or mesh.file is not None:
        return None
    if contact.stiffness != "auto" or contact.points is not None or contact.law.spring_exponent != 1.0:
        return None
    if contact.formulation.computed_stiffness is not None:
        return None
    shared = [one for one in case.layout.supports if not one.brings_stiffness]
    if not shared or any(one.around or len(one.faces) != FACES or one.clearance >= 0.0 for one in shared):
        return None
    pieces = [piece for one in shared for piece in case.profile.between(one.start, one.end)]
    if not all(isinstance(piece.beam.section, RectangularSection) for piece in pieces):
        return None
    plane_strain = mesh.dimension == 2 and mesh.plane == "strain"
    values = []
    for piece in pieces:
        held = 1.0 - piece.material.poisson_ratio**2 if plane_strain else 1.0
        values.append(FACES * piece.material.young_modulus / (held * piece.beam.thickness))
    name = "2 E / ((1 - nu^2) thickness)" if plane_strain else "2 E / thickness"
    reason = f"{name}: sections of this model keep their shape, so its contact is as soft as squeezed sections"
    consequence = "in proportion to it: the contact force of the interference, too"
    return Default("contact.stiffness", min(values), "Pa/m", reason, consequence)
