"""The forces of loads on a finite element space per unit factor, by where they act.

* A force at a point: f = N(x_p)^T e.
* A uniform acceleration of all mass, such as gravity: f = M e, with the consistent mass matrix.
* An acceleration of the support: the equations are solved in its frame, where f = -M e.
* A motion of the walls of one support: no force but that of contact.
"""

from __future__ import annotations

from typing import Any, assert_never

import numpy as np

from gapbeam.solver.assembly.attached_motions import attached_motions
from gapbeam.solver.assembly.section_rows import row_at, section_rows
from gapbeam.solver.case.case import Case
from gapbeam.solver.loads.load_choice import Load
from gapbeam.solver.loads.load_directions import load_direction
from gapbeam.solver.loads.places import BodyForce, PointForce, SupportAcceleration, SupportWalls
from gapbeam.solver.system.operators import Array, Operators


def load_patterns(case: Case, space: Any, operators: Operators) -> tuple[Array, ...]:
    """Return the forces of each load per unit factor on a vector space, (n,), N, and those of `attached_motions`.

    Raises:
        UserError: A point or a section lies outside the mesh.

    Collective.
    """
    return (
        *(_pattern(case, load, space, operators) for load in case.load),
        *section_rows(case, space, operators.size, [one.motion for one in attached_motions(case)]),
    )


def _pattern(case: Case, load: Load, space: Any, operators: Operators) -> Array:
    """Return the forces of one load; `load_direction` has the sign of the inertia in a moving frame."""
    dimension = space.mesh.geometry.dim
    direction = load_direction(load, dimension)
    match load.place:
        case PointForce(point):
            return row_at(case, space, point, f"[[load]] {load.name}").force(direction, operators.size)
        case BodyForce() | SupportAcceleration():
            return operators.apply_mass(np.tile(direction, operators.size // dimension))
        case SupportWalls():
            return np.zeros(operators.size)
        case unknown:
            assert_never(unknown)
