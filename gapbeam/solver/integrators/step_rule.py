"""The time step that a frequency of interest and contacts ask for.

    h = 1 / (50 f),    and at most T_c / 20 where 1 / (2 T_c) < 10 f

f is the highest frequency of interest, T_c the duration of a contact. A contact whose frequency is ten times f is rigid
on the time scale of interest, and not resolved. Without a frequency of interest all contacts are resolved.

Source: at n steps in a period the midpoint rule makes it (2 pi / n)^2 / 12 too long, 0.13 % at 50; 20 steps in a
contact are the least that peak forces ask for.
"""

from __future__ import annotations

from math import inf

STEPS_PER_PERIOD = 50  # of the highest frequency of interest
STEPS_PER_CONTACT = 20  # for peak forces
RIGID_RATIO = 10.0  # of contact frequency to frequency of interest; a stiffer contact is rigid on that time scale


def step_of_period(frequency: float) -> float:
    """Return 1 / (50 f), s; infinite for 0 Hz."""
    return 1.0 / (STEPS_PER_PERIOD * frequency) if frequency > 0.0 else inf


def is_rigid(duration: float, frequency: float) -> bool:
    """Return whether a contact of a duration, s, is rigid on the time scale of a frequency, Hz."""
    return 0.0 < RIGID_RATIO * frequency <= 0.5 / duration
