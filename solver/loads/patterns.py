"""From the loads of a case to patterns times functions of time.

* gravity: f = M g e, with the consistent mass matrix; it also acts on the seat.
* harmonic_force: f = N(x_p)^T e s(t), s in N.
* exciter: the same, and its preload; what it adds to M, C and K is in `solver.loads.exciter`.
* recorded_force, recorded_motion: the same as harmonic_force and base_motion, with the course in time of a record.
* base_motion: the equations are solved in the frame of the support, where f = -M e a_b(t); a_b is the given
  acceleration, or the first or second derivative of the given velocity or displacement, ramp included.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from solver.case import AtPoint, Case, Exciter, Gravity, OfSupport, Ramped
from solver.case import Load as CaseLoad
from solver.case_tables.recorded import Recorded
from solver.loads.harmonic import Harmonic
from solver.loads.recorded import signal_of
from solver.operators import Array, Operators
from solver.points import point_row
from solver.system import Load


def load_patterns(case: Case, space: Any, operators: Operators) -> tuple[Array, ...]:
    """Return the forces of each load per unit factor on a vector space, (n,), N. Collective."""
    dimension = space.mesh.geometry.dim
    return tuple(_pattern(load, dimension, space, operators) for load in case.load)


def _pattern(load: CaseLoad, dimension: int, space: Any, operators: Operators) -> Array:
    direction = load_direction(load, dimension)
    if isinstance(load, AtPoint):
        row = point_row(space, axis_point(load.point), f"[[load]] {load.name}")
        return row.force(direction, operators.size)
    return _inertia(operators, direction)


def load_direction(load: CaseLoad, dimension: int) -> Array:
    """Return the direction of the forces of a load, (dimension,): against that of a base motion."""
    if isinstance(load, Gravity):
        return unit_direction(load.direction, dimension, -1.0)
    up = unit_direction(load.direction, dimension, 1.0)
    return np.asarray(-up) if isinstance(load, OfSupport) else up


def make_loads(case: Case, patterns: Sequence[Array], dimension: int) -> tuple[Load, ...]:
    """Return the loads of a case from their patterns, and after them the preloads of exciters."""
    made = [_make(load, pattern, dimension) for load, pattern in zip(case.load, patterns, strict=True)]
    for load, pattern in zip(case.load, patterns, strict=True):
        if isinstance(load, Exciter) and load.preload != 0.0:
            made.append(Load(load.preload_name, pattern, _constant(load.preload), static=True, of_arrays=True))
    return tuple(made)


def _make(load: CaseLoad, pattern: Array, dimension: int) -> Load:
    if isinstance(load, Gravity):
        return Load(load.name, pattern, _constant(load.acceleration), static=True, of_arrays=True)
    value, mean = _course(load)
    if isinstance(load, AtPoint):
        return Load(load.name, pattern, value, of_arrays=True)
    return Load(
        load.name,
        pattern,
        value,
        frame_direction=np.pad(-load_direction(load, dimension), (0, 3 - dimension)),
        frame_mean=mean,
        of_arrays=True,
    )


def _course(load: Ramped | Recorded) -> tuple[Callable[[Any], Any], Callable[[Array, Array], Array]]:
    """Return s of a load, and its mean over intervals."""
    if isinstance(load, Recorded):
        recorded = signal_of(load)
        return recorded.value, recorded.mean
    harmonic = Harmonic(load.amplitude, load.frequency, load.phase, load.ramp)
    derivative = load.derivative if isinstance(load, OfSupport) else 0
    return partial(harmonic.value, derivative=derivative), partial(harmonic.mean, derivative=derivative)


def unit_direction(direction: tuple[float, ...] | None, dimension: int, sign: float) -> Array:
    """Return a unit vector; by default along the bending axis, upward for sign 1, downward for -1."""
    if direction is None:
        unit = np.zeros(dimension)
        unit[-1] = sign
        return unit
    given = np.array(direction, dtype=float)
    return np.asarray(given / np.linalg.norm(given))


def axis_point(point: float | tuple[float, ...]) -> Array:
    """Return a point as (3,): a number is a place on the beam axis."""
    given = np.atleast_1d(np.array(point, dtype=float))
    return np.pad(given, (0, 3 - len(given)))


def _constant(value: float) -> Any:
    return lambda _time: value


def _inertia(operators: Operators, direction: Array) -> Array:
    """Return M e for a uniform unit acceleration e, (n,), kg."""
    return operators.apply_mass(np.tile(direction, operators.size // len(direction)))
