"""A period of a dense system marched step by step, for laws that kernels do not take."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gapbeam.solver.errors import NotConverged
from gapbeam.solver.march.python.march import March, march
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import VALUE, State


class PassedPeriod(NamedTuple):
    """A period.

    Attributes:
        end: Its end.
        places: DOFs at the start and the ends of all steps, (steps + 1, n), m.
        forces: Contact force of each face at these ends, (steps, faces), N.
        halved: Steps that converged only in parts.
    """

    end: State
    places: Array
    forces: Array
    halved: int


def passed_period(plan: March, start: State) -> PassedPeriod:
    """March all steps of a plan in Python.

    Raises:
        NotConverged: A step did not converge at the smallest size.
    """
    contact, end, halved = plan.system.contact, start, 0
    places, forces = [start.u[VALUE]], list[Array]()
    for step in march(plan, start):
        halved += step.failures
        end = step.refreshed or step.new
        if step.completes:
            places.append(end.u[VALUE])
            point_forces = contact.weights * step.new.pressure
            found = np.bincount(contact.faces, point_forces, minlength=len(contact.face_names))
            forces.append(found.astype(float))
    return PassedPeriod(end, np.array(places), np.array(forces), halved)


def refuse_parts(passed: PassedPeriod, dt: float) -> None:
    """Refuse a period along which no derivative is taken.

    Raises:
        NotConverged: Steps converged only in parts.
    """
    if passed.halved:
        raise NotConverged(
            f"{passed.halved} steps of {dt:.3g} s up to t = {passed.end.time:.6g} s converged only in parts, along "
            "which no derivative is taken; take more steps or a softer contact"
        )
