"""The largest value of the loads that drive."""

from __future__ import annotations

from math import pi

from solver.case import OfSupport, Ramped
from solver.case_tables.recorded import Recorded
from solver.loads.recorded import signal_of


def peak(load: Ramped | Recorded) -> float:
    """Return the largest size of a force, N, or of the acceleration of the support, m/s^2.

    Raises:
        RecordError: The file of a recorded load cannot be used.
    """
    if isinstance(load, Recorded):
        return signal_of(load).peak
    power = load.derivative if isinstance(load, OfSupport) else 0
    return abs(load.amplitude) * float((2.0 * pi * load.frequency) ** power)
