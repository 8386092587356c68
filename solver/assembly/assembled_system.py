"""A beam under its loads, with the mass, spring and damper that loads such as exciters attach to it.

An exciter pulls with s(t) + preload along its direction e at a point x_p, and moves with the beam there. With
b = N(x_p)^T e,

    M = M_beam + m b b^T,    K = K_beam + k b b^T,    C = c_M M_beam + c_K K_beam + c b b^T,

since Rayleigh damping is that of the beam alone: what c_M M + c_K K holds beside it goes off the dashpot again,
c' = c - c_M m - c_K k. The frame of the suspension is that of the support. Base motion a_b(t) along e_b therefore
pushes the moving mass too, by -m (e . e_b) b a_b; gravity does not: the suspension carries its weight.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gapbeam.solver.case.case import Case
from gapbeam.solver.loads.attachment import Attachment
from gapbeam.solver.loads.load_choice import Load
from gapbeam.solver.loads.load_directions import load_direction
from gapbeam.solver.loads.places import PointForce, SupportAcceleration
from gapbeam.solver.loads.system_loads import make_loads
from gapbeam.solver.system.operators import Array, Operators, RankOnes
from gapbeam.solver.system.rank_one_update import attached
from gapbeam.solver.system.semi_discrete import ContactOperator, SemiDiscreteSystem


def assembled_system(
    case: Case,
    operators: Operators,
    contact: ContactOperator,
    patterns: Sequence[Array],
    dimension: int,
    rayleigh: tuple[float, float],
) -> SemiDiscreteSystem:
    """Return the system of a beam under its loads, with what they attach to it.

    Args:
        case: The case.
        operators: M and K of the beam alone.
        contact: G, H, w and g0.
        patterns: Forces of each load of the case per unit factor, (n,), N.
        dimension: 2 or 3.
        rayleigh: c_M, 1/s, and c_K, s, of the beam.
    """
    loads = list(make_loads(case.load, patterns, dimension))
    fixed = [(load, row, added) for load, row in zip(case.load, patterns, strict=True) if (added := _added(load))]
    if not fixed:
        return SemiDiscreteSystem(operators, contact, tuple(loads), *rayleigh)
    rows = np.array([row for _, row, _ in fixed])
    mass, stiffness, damping = np.array([[added.mass, added.stiffness, added.damping] for *_, added in fixed]).T
    axes = np.array([load_direction(load, dimension) for load, *_ in fixed])
    for number, load in enumerate(case.load):
        if isinstance(load.place, SupportAcceleration):
            along = axes @ load_direction(load, dimension)
            loads[number] = replace(loads[number], pattern=loads[number].pattern + (mass * along) @ rows)
    return SemiDiscreteSystem(
        attached(operators, RankOnes(rows, mass), RankOnes(rows, stiffness)),
        contact,
        tuple(loads),
        *rayleigh,
        RankOnes(rows, damping - rayleigh[0] * mass - rayleigh[1] * stiffness),
    )


def _added(load: Load) -> Attachment | None:
    """Return what a load attaches to the beam; None for nothing.

    Raises:
        TypeError: The load does not act at a point, where alone something can be attached.
    """
    added = load.attachment
    if added is None or not added.acts:
        return None
    if not isinstance(load.place, PointForce):
        raise TypeError(f"the load {load.name} attaches a mass, a spring or a damper, but acts at no point")
    return added
