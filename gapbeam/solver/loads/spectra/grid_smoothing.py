"""Values on a grid of frequencies, smoothed over some of its intervals, so that filters made from them are short."""

from __future__ import annotations

import numpy as np

from gapbeam.solver.system.operators import Array

SMOOTHING = np.hanning(11)[1:-1] / np.sum(np.hanning(11))


def smoothed(values: Array) -> Array:
    """Return means over neighbors, (count,); below 0 Hz the values are conjugate complex, beyond the last they are 0.

    Args:
        values: At equal steps from 0 Hz, real or complex, (count,).
    """
    reach = len(SMOOTHING) // 2
    mirrored = np.concatenate([np.conj(values[reach:0:-1]), values])
    return np.asarray(np.convolve(mirrored, SMOOTHING)[2 * reach :][: len(values)])
