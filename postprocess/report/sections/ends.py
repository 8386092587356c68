"""The end of a record, which figures show enlarged."""

from __future__ import annotations

import numpy as np

ZOOM = 3  # forcing periods


def end_words(frequency: float | None) -> str:
    """Return what captions call the end of a record under a forcing of a frequency in Hz, or under none."""
    return f"the last {ZOOM} forcing periods" if frequency is not None else "the last tenth of the record"


def is_long(time: np.ndarray, frequency: float | None) -> bool:
    """Return whether the end of a record shows less than all of it.

    Args:
        time: (n,), s.
        frequency: Of the forcing, Hz.
    """
    return frequency is None or float(np.ptp(time)) > 1.2 * ZOOM / frequency
