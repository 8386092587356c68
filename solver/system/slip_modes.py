"""The work of sliding by the mode of motion: impact, sliding and sticking.

A face is pressed from the step in whose balance a force acts on it until the first step without one. Of this contact

    impact      the first T_i seconds; of a step that T_i ends in, the share before its end
    sticking    what follows, where a point moves along its face no faster than v_s in the step
    sliding     the rest

T_i is half a period of the contact: a contact that lasts no longer is an impact and nothing else. v_s is the slip
velocity of the friction law, below which its traction holds rather than slides; 0 without friction. A face that is
pressed when the march begins has not met an impact. The three parts add up to the whole.
"""

from __future__ import annotations

from typing import NamedTuple

from gapbeam.solver.jit import shared


class SlipModes(NamedTuple):
    """What separates the modes.

    Attributes:
        impact_time: T_i, s; 0: nothing is an impact.
        sticking_speed: v_s, m/s; 0: only what does not move sticks.
    """

    impact_time: float = 0.0
    sticking_speed: float = 0.0


ALL_SLIDES = SlipModes()


@shared
def impact_share(pressed_for: float, dt: float, modes: SlipModes) -> float:
    """Return the share of a step that belongs to the impact with which a contact of a face begins.

    Args:
        pressed_for: How long the face has been pressed at the start of the step, s; infinite: since the march began.
        dt: Size of the step, s.
        modes: What separates the modes.
    """
    return min(max((modes.impact_time - pressed_for) / dt, 0.0), 1.0)


@shared
def by_mode(work: float, speed: float, share: float, modes: SlipModes) -> tuple[float, float, float]:
    """Return the work of a point in a step as that of impact, sliding and sticking.

    Args:
        work: Of the point in the step, J.
        speed: Mean of |v_t| in it, m/s.
        share: Of `impact_share`.
        modes: What separates the modes.
    """
    struck = share * work
    if speed <= modes.sticking_speed:
        return struck, 0.0, work - struck
    return struck, work - struck, 0.0


@shared
def pressed_after(pressed_for: float, dt: float, pressed: bool) -> float:
    """Return how long a face has been pressed after a step, s."""
    return pressed_for + dt if pressed else 0.0
