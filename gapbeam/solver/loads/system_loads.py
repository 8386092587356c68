"""Loads of a semi-discrete system, from the loads of a case and their patterns.

    f(t) = sum_k s_k(t) f_k

A pattern f_k follows from place and direction of a load alone; s_k is its function of time.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gapbeam.solver.loads.load_choice import Load as CaseLoad
from gapbeam.solver.loads.load_choice import load_direction
from gapbeam.solver.loads.places import LoadPart, SupportAcceleration, SupportWalls, patterned
from gapbeam.solver.loads.time_function import constant
from gapbeam.solver.system.operators import Array, Load


def make_loads(loads: Sequence[CaseLoad], patterns: Sequence[Array], dimension: int) -> tuple[Load, ...]:
    """Return the loads of a system, and after them the static forces that loads add, such as preloads.

    Args:
        loads: Loads of a case.
        patterns: Forces of each part of `load_parts.patterned` per unit factor, (n,), N.
        dimension: 2 or 3.
    """
    parts = patterned(loads)
    made = [_make(load, part, pattern, dimension) for (load, part), pattern in zip(parts, patterns, strict=True)]
    for load, pattern in zip(loads, patterns, strict=False):
        if (added := load.static_force) is not None:
            made.append(Load(added.name, pattern, constant(added.force).value, static=True, of_arrays=True))
    return tuple(made)


def _make(load: CaseLoad, part: LoadPart, pattern: Array, dimension: int) -> Load:
    """Return a part of a load; of moving supports with the motion of their frame, of one support without force."""
    s = constant(0.0) if isinstance(part.place, SupportWalls) else part.time_function()
    if not isinstance(part.place, SupportAcceleration):
        return Load(
            part.name, pattern, s.value, static=load.static, of_arrays=True, signal=s.signal, unit=part.place.unit
        )
    return Load(
        part.name,
        pattern,
        s.value,
        static=load.static,
        frame_direction=np.pad(-load_direction(load, dimension), (0, 3 - dimension)),
        frame_mean=s.mean,
        of_arrays=True,
        signal=s.signal,
        unit=part.place.unit,
    )
