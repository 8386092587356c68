"""Where a march starts: on the static seat or in the undeformed pose, with a rigid motion added on request."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, assert_never

import numpy as np

from gapbeam.solver.case.analysis_table import Periodic, StartMotion, Transient
from gapbeam.solver.case.case import Case
from gapbeam.solver.errors import UserError
from gapbeam.solver.system.semi_discrete import VALUE, SemiDiscreteSystem, State, imaged

if TYPE_CHECKING:
    from gapbeam.solver.models.body import Body

INSIDE = 1.0e-9  # m: round-off of a start that touches


def start_of_case(case: Case, body: Body, system: SemiDiscreteSystem, seat: State | None) -> State:
    """Return the state at t = 0 that a case asks for.

    Args:
        case: The case.
        body: Its body.
        system: Its system.
        seat: The static seat; None: there is none, and the case needs none.

    Raises:
        UserError: The motion at the start reaches into a face.

    Collective.
    """
    match case.analysis:
        case Transient(start="undeformed"):
            state = undeformed(system)
        case Transient() | Periodic():
            assert seat is not None
            state = seat
        case _:
            assert_never(case.analysis)
    motion = getattr(case.analysis, "motion", None)
    return state if motion is None else _moved(state, motion, case, body, system)


def undeformed(system: SemiDiscreteSystem) -> State:
    """Return the undeformed body at rest at t = 0, without contact pressure. Collective."""
    still = imaged(system.operators, np.zeros(system.operators.size))
    contact = system.contact
    return State(0.0, still, still.copy(), contact.depth(np.zeros(contact.interface.size)), np.zeros(contact.size))


def _moved(state: State, motion: StartMotion, case: Case, body: Body, system: SemiDiscreteSystem) -> State:
    """Return a state with a rigid motion added: x = M^-1 (M x), of the images that the body keeps. Collective."""
    factor = body.operators.factor(1.0, 0.0)
    heave, pitch = (factor.solve(row) for row in body.rigid)
    lift, velocity = motion.at(0.0, case.beam.length)
    contact, operators = system.contact, system.operators
    u = imaged(operators, state.u[VALUE] + lift * heave + motion.tilt * pitch)
    v = imaged(operators, state.v[VALUE] + velocity * heave + motion.spin * pitch)
    if lift == motion.tilt == 0.0:
        return replace(state, v=v, a=None)
    depth = contact.depth(contact.interface.trace(u[VALUE], operators))
    deeper = depth - np.maximum(state.depth, 0.0)
    worst = int(np.argmax(deeper))
    if deeper[worst] > INSIDE:
        raise UserError(
            f"[analysis.motion] moves the beam {depth[worst]:.3g} m into {contact.face_names[contact.faces[worst]]} at "
            f"x = {contact.positions[worst, 0]:.4g} m; expected a start between the faces; try less lift and tilt"
        )
    return replace(state, u=u, v=v, a=None, depth=depth, pressure=np.zeros(contact.size))
