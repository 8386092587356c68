"""Work of sliding by the mode of motion: impact, sliding and sticking.

A face is pressed from the step in whose balance a force acts on it until the first step without one; in the first of
them from the instant in which its gap closes, taken as linear in time. Of this contact

    impact      the first T_i seconds; of a step that T_i ends in, the share before its end
    sticking    what follows, where a point moves along its face no faster than v_s in the step
    sliding     the rest

T_i is half a period of the contact: a contact that lasts no longer is an impact and nothing else. v_s is the slip
velocity of the friction law, below which its traction holds rather than slides; 0 without friction. A face that is
pressed when the march begins has not met an impact. The three parts add up to the whole.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gapbeam.solver.compilation.jit import shared


@shared
def closed_part(before: float, depth: float) -> float:
    """Return the part of a step in which a face was closed that closed in it, or opened, 0 to 1.

    Args:
        before: Largest penetration at its start, m.
        depth: Penetration at the end of the step, m. Where no end has penetration, contact lasts over the step.
    """
    highest, lowest = max(before, depth), min(before, depth)
    if not (highest > 0.0 and lowest <= 0.0):
        return 1.0
    return highest / (highest - lowest) if np.isfinite(lowest) else 0.0


class SlipModes(NamedTuple):
    """Limits between the modes of sliding.

    Attributes:
        impact_time: T_i, s; 0: nothing is an impact.
        sticking_speed: v_s, m/s; 0: only what does not move sticks.
    """

    impact_time: float = 0.0
    sticking_speed: float = 0.0


ALL_SLIDES = SlipModes()


@shared
def pressed_span(pressed_for: float, before: float, depth: float, dt: float) -> float:
    """Return the time that a face is pressed in a step in which a force acts on it, s; half of a step if unknown.

    Args:
        pressed_for: Time that the face has been pressed at the start of the step, s.
        before: Penetration at the start of the step of the point that is deepest at its end, m.
        depth: Penetration of the same point at the end, m.
        dt: Size of the step, s.
    """
    if pressed_for > 0.0:
        return dt
    return closed_part(before, depth) * dt if np.isfinite(before) else 0.5 * dt


@shared
def impact_share(pressed_for: float, span: float, modes: SlipModes) -> float:
    """Return the share of the work in a step that belongs to the impact with which a contact of a face begins.

    Args:
        pressed_for: Time that the face has been pressed at the start of the step, s; infinite: since the march began.
        span: Time that it is pressed in the step, s, more than 0.
        modes: Limits between the modes.
    """
    return min(max((modes.impact_time - pressed_for) / span, 0.0), 1.0)


@shared
def by_mode(work: float, speed: float, share: float, modes: SlipModes) -> tuple[float, float, float]:
    """Return the work of a point in a step as that of impact, sliding and sticking.

    Args:
        work: Work of the point in the step, J.
        speed: Mean of |v_t| in it, m/s.
        share: Result of `impact_share`.
        modes: Limits between the modes.
    """
    struck = share * work
    if speed <= modes.sticking_speed:
        return struck, 0.0, work - struck
    return struck, work - struck, 0.0


@shared
def pressed_after(pressed_for: float, span: float, pressed: bool) -> float:
    """Return the time that a face has been pressed after a step in which it was for a span, s."""
    return pressed_for + span if pressed else 0.0
