"""Where a march starts: on the static seat, or in the undeformed pose."""

from __future__ import annotations

import numpy as np

from solver.case import Case
from solver.case_tables.analysis import Transient
from solver.system import SemiDiscreteSystem, State, imaged


def start_of_case(case: Case, system: SemiDiscreteSystem, seat: State) -> State:
    """Return the state at t = 0 that a case asks for.

    Args:
        case: The case.
        system: Its system.
        seat: The static seat.

    Collective.
    """
    if isinstance(case.analysis, Transient) and case.analysis.start == "undeformed":
        return undeformed(system)
    return seat


def undeformed(system: SemiDiscreteSystem) -> State:
    """Return the undeformed body at rest at t = 0, without contact pressure. Collective."""
    still = imaged(system.operators, np.zeros(system.operators.size))
    contact = system.contact
    return State(0.0, still, still.copy(), contact.depth(np.zeros(contact.interface.size)), np.zeros(contact.size))
