"""State that a compiled loop carries from step to step, as plain arrays.

The state in modal coordinates, and the factor of the active block: its rows stand in an order that follows from the
contacts before, and the order of a sum decides on its last bits.
"""

from __future__ import annotations

import numpy as np

from gapbeam.solver.march.compiled.kernel_tables import KernelState
from gapbeam.solver.march.compiled.lanes import widened
from gapbeam.solver.march.compiled.ordered_cholesky import OrderedFactor
from gapbeam.solver.system.operators import Array

Carried = tuple[Array, ...]
STATE = len(KernelState._fields)
IN_LANES = 3  # of them, the first: q, v and a


def carried(motion: KernelState, factor: OrderedFactor, size: int) -> Carried:
    """Return copies of the fields of `KernelState`, and of what holds of the factor: order, c and L.

    Args:
        motion: The state, in whole lanes.
        factor: The factor.
        size: n, how many of these are modal coordinates.
    """
    filled = int(factor.filled[0])
    order = factor.order[:filled].astype(float)
    held = (order, factor.compliance[:filled].copy(), factor.rows[:filled, :filled].copy())
    coordinates = (array[:size].copy() for array in motion[:IN_LANES])
    return (*coordinates, *(array.copy() for array in motion[IN_LANES:]), *held)


def taken_up(arrays: Carried, factor: OrderedFactor) -> KernelState:
    """Return the state that was carried along, and bring the factor to what it was."""
    order, compliance, rows = arrays[STATE:]
    filled = len(order)
    factor.order[:filled] = order
    factor.compliance[:filled] = compliance
    factor.rows[:filled, :filled] = rows
    factor.filled[0] = filled
    lanes = (widened(array) for array in arrays[:IN_LANES])
    return KernelState._make([*lanes, *(array.copy() for array in arrays[IN_LANES:STATE])])


def misfit(arrays: Carried, size: int, points: int) -> str:
    """Return the fault of arrays of n = `size` DOFs and m = `points` points, in words; empty where there is none."""
    if len(arrays) != STATE + 3:
        return f"{len(arrays)} arrays of a compiled loop, expected {STATE + 3}"
    filled = len(np.atleast_1d(arrays[STATE]))
    shapes = [(size,)] * 3 + [(points,)] * 3 + [(filled,)] * 2 + [(filled, filled)]
    if filled > points or [array.shape for array in arrays] != shapes:
        return f"arrays of a compiled loop of shapes {[array.shape for array in arrays]}, expected {shapes}"
    order = arrays[STATE]
    if np.any(order != np.floor(order)) or np.any(order < 0) or len(set(order) - set(range(points))):
        return "an order of contact points that are not there"
    return ""
