"""One impact of a face, from the step in which it closes to the step in which it opens: loops measure, this counts.

Within a step the gap is taken as linear in time, so that instants and durations have an error of second order. The
approach speed is the rate at which the smallest gap of the face closes over the step in which it does: contact takes
part of it within that step, (w h)^2 / 24 of it on average, with w = pi / duration: 0.2 % where a contact has 16 steps,
2.6 % where it has 4.

The functions take and return plain numbers.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gapbeam.solver.jit import shared
from gapbeam.solver.system.slip_modes import closed_part

UNSEEN = -1.0  # speed of a contact that began before the march


class RunningImpact(NamedTuple):
    """A face between two steps.

    Attributes:
        depth: Its largest penetration, m; negative: its smallest gap.
        begun: Contact force over time since t = 0 when it was open last, N s.
        speed: Approach speed of the contact that has not ended, m/s; `UNSEEN`: it began before the march.
        duration: Its duration so far, s.
    """

    depth: float
    begun: float
    speed: float
    duration: float


class EndedImpact(NamedTuple):
    """End of an impact in a step: whether one ended, how long before the end of the step, s, and its impulse, N s."""

    ended: bool
    lag: float
    impulse: float


@shared
def approach_speed(before: float, depth: float, dt: float) -> float:
    """Return the rate at which a gap closed over a step, m/s; where it began is not known: the least that it can be.

    Args:
        before: Largest penetration at its start, m.
        depth: At its end, m.
        dt: Size of the step, s.
    """
    return max(depth - before, 0.0) / dt if np.isfinite(before) else max(depth, 0.0) / dt


@shared
def after_gap(
    before: RunningImpact, was_closed: bool, closed: bool, speed: float, depth: float, impulse: float, dt: float
) -> tuple[RunningImpact, EndedImpact]:
    """Return a face after a step, and the impact that ended in it.

    Args:
        before: The face before.
        was_closed: Whether it was in contact before.
        closed: Whether it is in contact at the end of the step.
        speed: Approach speed, if it closed in this step, m/s.
        depth: Largest penetration at the end, m.
        impulse: Contact force over time since t = 0, N s.
        dt: Size of the step, s.
    """
    if closed and was_closed:
        return RunningImpact(depth, before.begun, before.speed, before.duration + dt), EndedImpact(False, 0.0, 0.0)
    if closed:
        part = closed_part(before.depth, depth)
        return RunningImpact(depth, before.begun, speed, part * dt), EndedImpact(False, 0.0, 0.0)
    if not was_closed:
        return RunningImpact(depth, impulse, 0.0, 0.0), EndedImpact(False, 0.0, 0.0)
    part = closed_part(before.depth, depth)
    ended = EndedImpact(before.speed >= 0.0, (1.0 - part) * dt, impulse - before.begun)
    return RunningImpact(depth, impulse, 0.0, before.duration + part * dt), ended
