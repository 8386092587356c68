"""Directions of loads as unit vectors, and points on the beam axis as coordinates."""

from __future__ import annotations

import numpy as np

from gapbeam.solver.loads.load_choice import Load
from gapbeam.solver.loads.places import SupportAcceleration
from gapbeam.solver.system.operators import Array


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
