"""Branches of periodic responses that together cover a range of a parameter, as far as they can be followed.

The first branch goes through the response of the case. Where it cannot be followed to an end of the range, a second one
starts at that end, from a march there, and is followed up to where the first one ended.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from gapbeam.solver.errors import NotConverged
from gapbeam.solver.periodic.continuation import END_OF_RANGE, CurveSettings, ResponseCurve, follow
from gapbeam.solver.periodic.shooting import PeriodMap
from gapbeam.solver.system.operators import Array

NOT_COVERED = 1.0e-3  # of the range; smaller gaps are the length of a step


@dataclass(frozen=True)
class Branches:
    """What was found of the periodic responses over a range.

    Attributes:
        curves: The branches; the first goes through the response of the case.
        missing: Intervals of the range where no branch was found, and why, in the order of the parameter.
    """

    curves: tuple[ResponseCurve, ...]
    missing: tuple[tuple[float, float, str], ...]


def follow_branches(
    map_at: Callable[[float], PeriodMap],
    value: float,
    start: Array,
    settings: CurveSettings,
    start_at: Callable[[float], Array],
) -> Branches:
    """Follow the branch through a response, and others from those ends of the range that it cannot be followed to.

    Args:
        map_at: The period map for a value of the parameter.
        value: Value to start from.
        start: State near the periodic response there, (2n,).
        settings: Range and steps.
        start_at: Returns a state near a periodic response for a value of the parameter, (2n,), by a march.

    Raises:
        NotConverged: There is no periodic response near the start.
    """
    first = follow(map_at, value, start, settings)
    curves, missing = [first], list[tuple[float, float, str]]()
    for low, high, why in _not_reached(first, settings):
        end = low if low == settings.low else high
        within = replace(settings, low=low, high=high, first_step=_scaled(settings.first_step, settings, high - low))
        try:
            branch = follow(map_at, end, start_at(end), within)
        except NotConverged:
            missing.append((low, high, f"{why}, and no periodic response was found at the end of the range"))
            continue
        curves.append(branch)
        covered = [point.value for point in branch.points]
        left = (max(covered), high) if end == low else (low, min(covered))
        if left[1] - left[0] > NOT_COVERED * settings.range:
            missing.append((*left, f"{why}, from both sides"))
    return Branches(tuple(curves), tuple(missing))


def _not_reached(curve: ResponseCurve, settings: CurveSettings) -> list[tuple[float, float, str]]:
    """Return the intervals at the ends of the range that a curve ends before; none where it turns back at a fold."""
    stopped = [ending for ending in curve.endings if ending != END_OF_RANGE]
    if not stopped:
        return []
    values = [point.value for point in curve.points]
    ends = (settings.low, min(values)), (max(values), settings.high)
    return [(low, high, stopped[0]) for low, high in ends if high - low > NOT_COVERED * settings.range]


def _scaled(share: float, settings: CurveSettings, length: float) -> float:
    """Return a share of the whole range as one of a part of it, at most a tenth."""
    return min(0.1, share * settings.range / length)
