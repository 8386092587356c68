"""Where a march starts: on the static seat, or in the undeformed pose."""

from __future__ import annotations

from typing import assert_never

import numpy as np

from gapbeam.solver.case.analysis_table import Periodic, Transient
from gapbeam.solver.case.case import Case
from gapbeam.solver.system.semi_discrete import SemiDiscreteSystem, State, imaged


def start_of_case(case: Case, system: SemiDiscreteSystem, seat: State | None) -> State:
    """Return the state at t = 0 that a case asks for.

    Args:
        case: The case.
        system: Its system.
        seat: The static seat; None: there is none, and the case needs none.

    Collective.
    """
    match case.analysis:
        case Transient(start="undeformed"):
            return undeformed(system)
        case Transient() | Periodic():
            assert seat is not None
            return seat
        case _:
            assert_never(case.analysis)


def undeformed(system: SemiDiscreteSystem) -> State:
    """Return the undeformed body at rest at t = 0, without contact pressure. Collective."""
    still = imaged(system.operators, np.zeros(system.operators.size))
    contact = system.contact
    return State(0.0, still, still.copy(), contact.depth(np.zeros(contact.interface.size)), np.zeros(contact.size))
