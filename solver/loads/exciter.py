"""Modal exciters on the beam: the moving mass, the spring and the damper of each.

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

from solver.attached import attached
from solver.case import Case, Exciter, OfSupport
from solver.case import Load as CaseLoad
from solver.loads.patterns import load_direction, make_loads
from solver.operators import Array, Operators, RankOnes
from solver.system import ContactOperator, SemiDiscreteSystem


def assembled_system(
    case: Case,
    operators: Operators,
    contact: ContactOperator,
    patterns: Sequence[Array],
    dimension: int,
    rayleigh: tuple[float, float],
) -> SemiDiscreteSystem:
    """Return the system of a beam under its loads, with the exciters that are fixed to it.

    Args:
        case: The case.
        operators: M and K of the beam alone.
        contact: G, H, w and g0.
        patterns: Forces of each load of the case per unit factor, (n,), N.
        dimension: 2 or 3.
        rayleigh: c_M, 1/s, and c_K, s, of the beam.
    """
    loads = list(make_loads(case, patterns, dimension))
    coupled = [(load, row) for load, row in zip(case.load, patterns, strict=True) if _is_coupled(load)]
    if not coupled:
        return SemiDiscreteSystem(operators, contact, tuple(loads), *rayleigh)
    exciters = [load for load, _ in coupled if isinstance(load, Exciter)]
    rows = np.array([row for _, row in coupled])
    mass, stiffness, damping = np.array([[load.mass, load.stiffness, load.damping] for load in exciters]).T
    axes = np.array([load_direction(load, dimension) for load in exciters])
    for number, load in enumerate(case.load):
        if isinstance(load, OfSupport):
            along = axes @ load_direction(load, dimension)
            loads[number] = replace(loads[number], pattern=loads[number].pattern + (mass * along) @ rows)
    return SemiDiscreteSystem(
        attached(operators, RankOnes(rows, mass), RankOnes(rows, stiffness)),
        contact,
        tuple(loads),
        *rayleigh,
        RankOnes(rows, damping - rayleigh[0] * mass - rayleigh[1] * stiffness),
    )


def _is_coupled(load: CaseLoad) -> bool:
    """Return whether a load is an exciter that has a mass, a spring or a damper."""
    return isinstance(load, Exciter) and max(load.mass, load.stiffness, load.damping) > 0.0
