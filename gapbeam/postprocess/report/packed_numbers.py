"""Numbers as a page holds them: bytes in base64, a few times shorter than digits."""

from __future__ import annotations

import base64

import numpy as np

SHORTEST = 32767  # largest number of 16 bits


def packed(values: np.ndarray) -> dict[str, str]:
    """Return numbers as 32 bits each, row by row, as plotly packs them too: `dtype` and `bdata`."""
    return {"dtype": "f4", "bdata": _text(np.asarray(values, dtype="<f4"))}


def packed_shorts(values: np.ndarray) -> dict[str, str | float]:
    """Return numbers as 16 bits each, to 1/32767 of the largest, which times `unit` are the numbers."""
    largest = float(np.abs(values).max(initial=0.0)) or 1.0
    steps = np.round(np.asarray(values, dtype=float) / largest * SHORTEST)
    return {"dtype": "i2", "bdata": _text(steps.astype("<i2")), "unit": largest / SHORTEST}


def _text(values: np.ndarray) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode("ascii")
