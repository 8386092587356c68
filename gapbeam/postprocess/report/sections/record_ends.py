"""The part of a record that figures show enlarged, in words."""

from __future__ import annotations

import numpy as np

ZOOM = 3  # forcing periods


def end_words(frequency: float | None) -> str:
    """Return what captions call that part under a forcing of a frequency in Hz, or under none."""
    return f"the last {ZOOM} forcing periods" if frequency is not None else "the tenth of the record where most happens"


def is_long(time: np.ndarray, frequency: float | None) -> bool:
    """Return whether that part is less than the whole record.

    Args:
        time: (n,), s.
        frequency: Of the forcing, Hz.
    """
    return frequency is None or float(np.ptp(time)) > 1.2 * ZOOM / frequency
