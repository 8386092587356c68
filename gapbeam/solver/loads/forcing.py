"""What the loads of a case together drive a motion with: frequencies, and the weight."""

from __future__ import annotations

from collections.abc import Iterable

from gapbeam.solver.loads.load_choice import Load


def forcing_frequencies(loads: Iterable[Load]) -> list[float]:
    """Return the frequencies at which loads repeat, Hz, each once, ascending; none beside a load that never repeats."""
    loads = tuple(loads)
    if not all(load.repeats for load in loads):
        return []
    return sorted({load.forcing_frequency for load in loads if load.forcing_frequency is not None})
