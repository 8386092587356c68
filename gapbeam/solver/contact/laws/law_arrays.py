"""The contact law of `point_law` at many points: rows of m points, (r, m), filled in place."""

from __future__ import annotations

from gapbeam.solver.contact.laws.point_law import (
    LawTable,
    Point,
    StepNumbers,
    damping_at,
    endpoint_pressure,
    numbers_at,
    stage_pressure,
    touch_factor,
)
from gapbeam.solver.jit import entry
from gapbeam.solver.system.operators import Array


@entry
def fill_stage(step: StepNumbers, law: LawTable, old: Array, new: Array, found: Array) -> None:
    """Set pressure, slope and elastic part, (3, r, m), of a step between two depths; MEAN or IMPLICIT."""
    for row in range(new.shape[0]):
        for i in range(new.shape[1]):
            point = Point(law.stiffness[i], law.coefficient[i], old[row, i], 0.0, 0.0, 0.0)
            pressure, slope, elastic = stage_pressure(step, numbers_at(law, i), point, new[row, i])
            found[0, row, i], found[1, row, i], found[2, row, i] = pressure, slope, elastic


@entry
def fill_endpoint(law: LawTable, depth: Array, rate: Array, rate_slope: float, found: Array) -> None:
    """Set pressure, slope and elastic part, (3, r, m), at one instant."""
    for row in range(depth.shape[0]):
        for i in range(depth.shape[1]):
            pressure, slope, elastic = endpoint_pressure(
                numbers_at(law, i), law.stiffness[i], law.coefficient[i], depth[row, i], rate[row, i], rate_slope
            )
            found[0, row, i], found[1, row, i], found[2, row, i] = pressure, slope, elastic


@entry
def fill_damping(law: LawTable, depth: Array, found: Array) -> None:
    """Set c(d), (r, m)."""
    for row in range(depth.shape[0]):
        for i in range(depth.shape[1]):
            found[row, i] = damping_at(numbers_at(law, i), law.stiffness[i], law.coefficient[i], depth[row, i])[0]


@entry
def fill_damping_parts(law: LawTable, depth: Array, found: Array) -> None:
    """Set c(d), its slope and its integral, (3, r, m)."""
    for row in range(depth.shape[0]):
        for i in range(depth.shape[1]):
            value, slope, integral = damping_at(numbers_at(law, i), law.stiffness[i], law.coefficient[i], depth[row, i])
            found[0, row, i], found[1, row, i], found[2, row, i] = value, slope, integral


@entry
def fill_touch_factors(product: float, slowest: float, speed: Array, factor: Array) -> None:
    """Set chi, (m,), of contacts that began at these speeds, (m,)."""
    for i in range(len(speed)):
        factor[i] = touch_factor(product, slowest, speed[i])
