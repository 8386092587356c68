"""In which part of a step a face is closed that closes in it, or opens: the gap is linear in time within the step."""

from __future__ import annotations

import numpy as np

from gapbeam.solver.jit import shared


@shared
def closed_part(before: float, depth: float) -> float:
    """Return the part of a step in which a face was closed that closed in it, or opened, 0 to 1.

    Args:
        before: Largest penetration at its start, m.
        depth: At its end, m. Where no end has penetration, contact lasts over the step.
    """
    highest, lowest = max(before, depth), min(before, depth)
    if not (highest > 0.0 and lowest <= 0.0):
        return 1.0
    return highest / (highest - lowest) if np.isfinite(lowest) else 0.0
