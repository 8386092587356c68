"""Time up to which a motion can be predicted, and the test whether it has settled, from motions on the same times."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from gapbeam.solver.system.operators import Array
from gapbeam.studies.error_estimate.force_peaks import Span
from gapbeam.studies.error_estimate.motion_record import MotionRecord, window_means

STILL = 1.0e-6  # of the largest displacement: what moves less is at rest but for the residue of the seat
APART = 0.03  # of the range of the motion: beyond, two motions have parted
REPEATED = 0.01  # of the range of the motion: two cycles that differ by less are the same
CYCLES = 3  # in a row that a periodic motion repeats


def horizon_of(motion: MotionRecord, others: Iterable[tuple[MotionRecord, float]], smoothing: float) -> float | None:
    """Return the first time at which another motion has left a motion by 3 % of its range, s; None: none does.

    The displacements of the probes are compared, without those of the start; without probes means of the contact
    forces are. Motions that part multiply small differences, which only contacts that open or close do: where none
    does, a motion is linear, and its errors are those of its figures.

    Args:
        motion: The motion.
        others: Each other motion on the same times, and which part of the difference to it counts.
        smoothing: Width of the means of the forces, s.
    """
    if not motion.contact_changes:
        return None
    found = []
    mine = _waves(motion, smoothing)
    spans = motion.spans if motion.probes else np.ptp(mine, axis=0)
    moves = spans > (STILL * np.abs(motion.displacement).max(axis=0) if motion.probes else 0.0)
    for other, share in others:
        theirs = _waves(other, smoothing)
        count = min(len(mine), len(theirs))
        apart = share * np.abs(theirs[:count] - mine[:count]) > APART * spans
        parted = np.flatnonzero(np.any(apart & moves, axis=1))
        if parted.size:
            found.append(float(motion.times[parted[0]]))
    return min(found, default=None)


def repeats(motion: MotionRecord, spans: Iterable[Span], smoothing: float) -> bool:
    """Return whether the second half of a forced motion has settled: whether it is periodic.

    That is so where its last displacements are, within 1 % of their range, those of p forcing periods earlier, three
    cycles of p periods in a row; without probes means of the contact forces are compared.

    Args:
        motion: The motion.
        spans: Its parts; without a second half it has not settled.
        smoothing: Width of the means of the forces, s.
    """
    late = next((one for one in spans if one.frequency is not None), None)
    if late is None:
        return False
    part = motion.between(late.start, late.end)
    waves = _waves(part, smoothing)
    times = part.times[: len(waves)] - part.times[0]
    ranges = np.ptp(waves, axis=0)
    assert late.frequency is not None
    period = 1.0 / late.frequency
    for cycle in range(1, int(times[-1] / ((CYCLES + 1) * period) + REPEATED) + 1):
        last = times >= times[-1] - CYCLES * cycle * period
        earlier = np.stack([np.interp(times[last] - cycle * period, times, wave) for wave in waves.T], axis=1)
        if np.all(np.abs(waves[last] - earlier) <= REPEATED * ranges):
            return True
    return False


def _waves(motion: MotionRecord, smoothing: float) -> Array:
    if not motion.probes:
        return window_means(motion.impulse, motion.interval, smoothing)
    return np.asarray(motion.displacement - motion.displacement[0])
