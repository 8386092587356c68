"""Loads of a case: the tables [[load]], distinguished by `type`, with their directions, frequencies and weight."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated

import numpy as np

from gapbeam.solver.loads.load_table import Gravity, LoadTable
from gapbeam.solver.loads.places import SupportAcceleration
from gapbeam.solver.loads.point_load import ConstantForce, Exciter, HarmonicForce, RecordedForce
from gapbeam.solver.loads.random_line_load import RandomLineLoad
from gapbeam.solver.loads.random_load import RandomLoad
from gapbeam.solver.loads.step_force import StepForce, SweptSineLoad
from gapbeam.solver.loads.support_motion import (
    BaseMotion,
    ClearanceChange,
    HarmonicSupportMotion,
    RecordedMotion,
    RecordedSupportMotion,
)
from gapbeam.solver.schema.table import OF_TYPE
from gapbeam.solver.system.operators import Array

Load = Annotated[
    Gravity
    | HarmonicForce
    | ConstantForce
    | StepForce
    | Exciter
    | BaseMotion
    | RandomLoad
    | RandomLineLoad
    | SweptSineLoad
    | RecordedForce
    | RecordedMotion
    | HarmonicSupportMotion
    | RecordedSupportMotion
    | ClearanceChange,
    OF_TYPE,
]

NO_LOADS: tuple[Load, ...] = ()


def forcing_frequencies(loads: Iterable[LoadTable]) -> list[float]:
    """Return the frequencies at which loads repeat, Hz, each once, ascending; none with a load that never repeats."""
    loads = tuple(loads)
    if not all(load.repeats for load in loads):
        return []
    return sorted({load.forcing_frequency for load in loads if load.forcing_frequency is not None})


def load_direction(load: Load, dimension: int) -> Array:
    """Return the direction of the forces of a load, (dimension,): against that of a motion of the support."""
    along = unit_direction(load.direction, dimension, load.default_sense)
    return np.asarray(-along) if isinstance(load.place, SupportAcceleration) else along


def unit_direction(direction: tuple[float, ...] | None, dimension: int, sense: float) -> Array:
    """Return a unit vector; by default along the bending axis, upward for sense 1, downward for -1."""
    if direction is None:
        unit = np.zeros(dimension)
        unit[-1] = sense
        return unit
    given = np.array(direction, dtype=float)
    return np.asarray(given / np.linalg.norm(given))


def axis_point(point: float | tuple[float, ...]) -> Array:
    """Return a point as (3,): a number is a place on the beam axis."""
    given = np.atleast_1d(np.array(point, dtype=float))
    return np.pad(given, (0, 3 - len(given)))
