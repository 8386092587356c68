"""The forces of loads on a finite element space per unit factor, by where they act.

* A force at a point: f = N(x_p)^T e; on the axis it is distributed over the section (`assembly.section_rows`).
* Forces along the axis: the sum of such forces.
* A uniform acceleration of all mass, such as gravity: f = M e, with the consistent mass matrix.
* An acceleration of the support: the equations are solved in its frame, where f = -M e.
* A motion of the walls of one support: no force but that of contact.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import assert_never

import numpy as np

from gapbeam.solver.assembly.assembled_system import attached_motions
from gapbeam.solver.assembly.point_rows import PointRow
from gapbeam.solver.assembly.section_rows import MotionRow, SectionRows, row_at
from gapbeam.solver.case.case import Case
from gapbeam.solver.loads.load_choice import Load, load_direction
from gapbeam.solver.loads.places import (
    BodyForce,
    LineForce,
    LoadPart,
    PointForce,
    SupportAcceleration,
    SupportWalls,
    patterned,
)
from gapbeam.solver.system.operators import Array, Operators


def load_patterns(case: Case, sections: SectionRows, operators: Operators) -> tuple[Array, ...]:
    """Return the forces of each load per unit factor on a vector space, (n,), N, and those of `attached_motions`.

    Args:
        case: The case.
        sections: On its vector space.
        operators: On the same space.

    Raises:
        UserError: A point or a section lies outside the mesh.

    Collective.
    """
    rows: dict[float | tuple[float, ...], PointRow | MotionRow] = {}  # many parts of a load act at the same places

    def row(point: float | tuple[float, ...], name: str) -> PointRow | MotionRow:
        if point not in rows:
            rows[point] = row_at(sections, point, f"[[load]] {name}")
        return rows[point]

    return (
        *(
            _pattern(load, part, sections.space.mesh.geometry.dim, operators, row)
            for load, part in patterned(case.load)
        ),
        *sections.of_motions([one.motion for one in attached_motions(case)], operators.size),
    )


def _pattern(
    load: Load,
    part: LoadPart,
    dimension: int,
    operators: Operators,
    row: Callable[[float | tuple[float, ...], str], PointRow | MotionRow],
) -> Array:
    """Return the forces of a part of a load; `load_direction` has the sign of the inertia in a moving frame."""
    direction = load_direction(load, dimension)
    match part.place:
        case PointForce(point):
            return row(point, load.name).force(direction, operators.size)
        case LineForce(places, weights):
            total = np.zeros(operators.size)
            for place, weight in zip(places, weights, strict=True):
                total += row(place, load.name).force(weight * direction, operators.size)
            return total
        case BodyForce() | SupportAcceleration():
            return operators.apply_mass(np.tile(direction, operators.size // dimension))
        case SupportWalls():
            return np.zeros(operators.size)
        case unknown:
            assert_never(unknown)
