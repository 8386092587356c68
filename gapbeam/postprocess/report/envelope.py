"""Long records drawn with few points that hide nothing: the smallest and the largest value of every interval."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

FloatArray = np.ndarray

MOST = 1600  # points of a curve: twice as many as a figure has pixels


def envelope(x: FloatArray, y: FloatArray, most: int = MOST) -> tuple[FloatArray, FloatArray]:
    """Return the smallest and the largest value of each of `most`/2 intervals of a record, in their order.

    A record that is short enough is returned as it is. Every peak is drawn at its height; what is lost is what happens
    between them within an interval.

    Args:
        x: (n,), increasing.
        y: (n,).
        most: Points to return at most, at least 2.

    Returns:
        Both, with at most `most` entries.
    """
    if x.size <= most:
        return x, y
    edges = np.linspace(0, x.size, most // 2 + 1).astype(int)
    kept = []
    for start, stop in pairwise(edges):
        part = y[start:stop]
        kept += sorted({start + int(np.argmin(part)), start + int(np.argmax(part))})
    return x[kept], y[kept]


def thinning_words(size: int, most: int = MOST) -> str:
    """Return what a caption says of a record of a size; nothing where all of it is drawn."""
    if size <= most:
        return ""
    return f" Of every {round(2 * size / most)} values the smallest and the largest are drawn."
