"""The names of figures of a motion: each says how it is defined, and is the same in every table, message and file.

The closing table adds the width of a mean behind its name.
"""

from __future__ import annotations

DISPLACEMENT = "peak-to-peak displacement"
ACCELERATION = "peak-to-peak acceleration"
SMOOTHED_ACCELERATION = "peak-to-peak smoothed acceleration"
LARGEST_FORCE = "largest recorded force"
MEAN_FORCE = "largest mean force"
IMPULSE = "impulse"
AXIAL_STRESS = "peak-to-peak axial stress"
VON_MISES_STRESS = "largest von Mises stress"
NOT_SETTLED = "not settled"

PEAKS = (f" {LARGEST_FORCE}", f" {MEAN_FORCE}")
FORCES = (*PEAKS, f" {IMPULSE}")
"""Ends of the names of figures of a face."""

GOOD, ROUGH = 0.1, 0.5  # of a figure: the errors up to which it may be used, and used with care
USE, CARE, REFUSED = "good", "rough", "do not use"


def usable(relative: float | None) -> str:
    """Return whether a figure may be used.

    Args:
        relative: Its error over its value; None: the error is larger, or not known.
    """
    if relative is None or relative > ROUGH:
        return REFUSED
    return USE if relative <= GOOD else CARE
