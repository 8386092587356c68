"""The contact of a body at stations in round holes, where supports ask for circles."""

from __future__ import annotations

from dataclasses import replace

from gapbeam.solver.case.case import Case
from gapbeam.solver.contact.formulations.circle_contact import CircleOperator, circle_contact
from gapbeam.solver.loads.support_walls import hole_shifts
from gapbeam.solver.models.body import Body
from gapbeam.solver.models.joint_reactions import reactions_of
from gapbeam.solver.system.reactions import Reactions
from gapbeam.solver.system.semi_discrete import ContactOperator, SemiDiscreteSystem


def met_as_circles(body: Body) -> Body:
    """Return a body with stations instead of the points around its sections where a support is met as a circle.

    Raises:
        UserError: The sections there do not keep their shape.
    """
    exact = [face.circle for face in body.contact.support.faces]
    if not any(exact):
        return body
    return replace(body, contact=circle_contact(body.contact, exact, not body.case.model.keeps_sections))


def with_moving_holes(case: Case, contact: ContactOperator, dimension: int) -> ContactOperator:
    """Return an operator whose stations know how loads of a case move and open their holes: itself without stations."""
    if not isinstance(contact, CircleOperator) or not contact.walls.motions:
        return contact
    shifts = hole_shifts(case.load, case.layout, contact, dimension)
    return replace(contact, circles=replace(contact.circles, shifts=shifts))


def station_reactions(case: Case, body: Body, system: SemiDiscreteSystem) -> Reactions | None:
    """Return the reactions of all joints as `reactions_of` does, for contact at stations as well.

    Args:
        case: The case.
        body: Its body, with contact points around its sections.
        system: Its system.
    """
    contact = system.contact
    if not isinstance(contact, CircleOperator):
        return reactions_of(case, body, system)
    found = reactions_of(case, body, replace(system, contact=contact.around))
    if found is None:
        return None
    return replace(
        found,
        pressure=contact.at_stations(found.pressure),
        friction=found.friction[:, : contact.friction_resultants.shape[1]],
        turning=contact.folded(found.pressure),
    )
