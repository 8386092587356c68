"""Stiffness, damping and yield pressure that supports bring themselves, per area, also where a case gives whole ones.

What a case gives for a whole support, in N/m, N s/m and N, is divided by its nominal area, its length times the width
of the beam. The weights of its contact points add up to this area (`contact.formulations.contact_points`).
"""

from __future__ import annotations

from gapbeam.solver.case.case import Case
from gapbeam.solver.case.placed_support import law_at
from gapbeam.solver.supports.regions.around_face import WallsFace
from gapbeam.solver.supports.support_tables import OneSupport


def nominal_area(case: Case, support: OneSupport) -> float:
    """Return the length of a support times the smallest width of the beam in it, m^2."""
    return support.length * min(piece.beam.width for piece in case.profile.between(support.start, support.end))


def whole_areas(case: Case) -> tuple[float | None, ...]:
    """Return the nominal areas of faces whose support gives the stiffness of the whole; None for other faces."""
    return tuple(
        None if one.support_stiffness is None else nominal_area(case, one)
        for one in case.layout.supports
        for _ in one.faces
    )


def line_radii(case: Case) -> tuple[float | None, ...]:
    """Return the radius of the sections that meet flat walls along lines, face by face, m; None: contact has an area.

    Sections do so that keep their round shape at stations along a support, where the pressure follows a law per area
    whose resultant on a line is known.
    """
    return tuple(
        rolling_radius(case, one) if case.model.rings is not None else None
        for one in case.layout.supports
        for _ in one.faces
    )


def rolling_radius(case: Case, support: OneSupport) -> float | None:
    """Return the radius of a round beam in a support of flat walls that it can meet along lines, m; else None."""
    widths = {piece.beam.width for piece in case.profile.between(support.start, support.end)}
    lines = (
        all(isinstance(face, WallsFace) for face in support.faces)
        and len(widths) == 1
        and law_at(case.contact, support).rolls
        and case.contact.formulation.follows_the_law
        and support.support_stiffness is None
        and case.contact.points is None
    )
    return 0.5 * widths.pop() if lines else None


def own_stiffness(case: Case, support: OneSupport) -> float | None:
    """Return the stiffness of a support per area, Pa/m^n; None: that of [contact]."""
    whole = support.support_stiffness
    return support.stiffness if whole is None else whole / nominal_area(case, support)


def own_damping(case: Case, support: OneSupport) -> float | None:
    """Return the damping of a support per area, Pa s/m; None: that of [contact], or what a law asks for."""
    whole = support.support_damping
    return support.damping if whole is None else whole / nominal_area(case, support)
