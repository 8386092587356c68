"""The largest contact force of each face: on record where the contact is resolved, else the mean over the contact.

The largest force on record means something where records resolve the contact that carries it. Elsewhere it follows the
step and the formulation and has no limit as the step shrinks. The mean over the contact is an impulse over a time,
which converges.

The duration of a contact is

    T = min(time with force about the peak, 2 x time with more than half of the peak about it)

where the force is a line between records, so that T does not jump where a record is half of the peak. For half a sine T
is the contact itself; of a face that stays closed while a short blow meets it, T is the blow.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np

from gapbeam.postprocess.signals.figure_names import LARGEST_FORCE, MEAN_FORCE
from gapbeam.solver.diagnostics.face_updates import RESOLVING_STEPS
from gapbeam.solver.system.operators import Array
from gapbeam.studies.error_estimate.motion_record import MotionRecord, window_means
from gapbeam.studies.error_estimate.spans import Span

DURATION = "contact_duration"
NOTABLE = 1.3  # of the mean: a larger force of one record is not a force of the structure

OF_MOTION = ""

ForcePeaks = dict[str, dict[str, dict[str, float]]]


def contact_records(force: Array) -> int:
    """Return the duration of the contact that carries the largest force, in records; 0 without contact.

    Args:
        force: Contact force of a face, (n,), N.
    """
    peak = int(np.argmax(force))
    if not force[peak] > 0.0:
        return 0

    half = 0.5 * float(force[peak])
    around = _reach(force[peak:], 0.0) + _reach(force[peak::-1], 0.0)
    return min(round(around) - 1, round(2.0 * (_reach(force[peak:], half) + _reach(force[peak::-1], half))))


def lost_in_steps(motion: MotionRecord, step: float) -> dict[str, float]:
    """Return by how much the step may falsify the contact of each face, as a share of its figures.

    A midpoint or trapezoidal rule makes a half period pi / w of d steps longer by (w h)^2 / 12 = (pi / d)^2 / 12: 20 %
    of a contact of two steps, .8 % of one of ten. Twice the step shows this error only where contacts are resolved.

    Args:
        motion: Of the run, over a part of it.
        step: Time step h, s.

    Returns:
        By face, and of the face with the largest impulse by OF_MOTION; at most 1, 0 without contact.
    """
    found = dict.fromkeys((*motion.faces, OF_MOTION), 0.0)
    for number, face in enumerate(motion.faces):
        steps = contact_records(motion.force[:, number]) * motion.interval / step
        found[face] = min(1.0, (np.pi / steps) ** 2 / 12.0) if steps > 0.0 else 0.0
    if motion.faces:
        strongest = int(np.argmax(motion.impulse[-1] - motion.impulse[0]))
        found[OF_MOTION] = found[motion.faces[strongest]]
    return found


def _reach(force: Array, level: float) -> float:
    """Return after how many records a force, given from its peak on, has fallen to a level."""
    below = np.flatnonzero(force <= level)
    if not below.size:
        return float(force.size)
    place = int(below[0])
    if level == 0.0:
        return float(place)
    high, low = force[place - 1], force[place]
    return place - 1 + float((high - level) / (high - low))


def contact_windows(motion: MotionRecord) -> dict[str, float | None]:
    """Return what the peak force of each face is: None, the largest on record, or a mean over so many s.

    Records resolve a contact of more than ten of them.

    Args:
        motion: Of the run, over the part whose peaks are asked for.
    """
    counts = [contact_records(motion.force[:, face]) for face in range(len(motion.faces))]
    return {
        face: motion.interval * count if 0 < count <= RESOLVING_STEPS else None
        for face, count in zip(motion.faces, counts, strict=True)
    }


def peak_forces(motion: MotionRecord, windows: Sequence[float | None]) -> Array:
    """Return the largest force of each face, (faces,), N.

    Args:
        motion: The records.
        windows: Of each face: None for the largest on record, else the width of the mean, s.
    """
    found = [
        motion.force[:, face].max()
        if width is None
        else window_means(motion.impulse[:, face : face + 1], motion.interval, width).max()
        for face, width in enumerate(windows)
    ]
    return np.array(found, dtype=float)


def force_peaks(run: MotionRecord, spans: Iterable[Span]) -> ForcePeaks:
    """Return the largest force on record, the mean over its contact, N, and the duration of that, s.

    Args:
        run: The motion.
        spans: Its parts.

    Returns:
        By part of the run and face: LARGEST_FORCE, MEAN_FORCE and DURATION.
    """
    found: ForcePeaks = {}
    for span in spans:
        part = run.between(span.start, span.end)
        durations = [run.interval * contact_records(part.force[:, face]) for face in range(len(run.faces))]
        largest, means = part.force.max(axis=0), peak_forces(part, [max(one, run.interval) for one in durations])
        found[span.name] = {
            face: {LARGEST_FORCE: float(largest[number]), MEAN_FORCE: float(means[number]), DURATION: durations[number]}
            for number, face in enumerate(run.faces)
        }
    return found


def doubtful_peaks(found: Mapping[str, Mapping[str, Mapping[str, float]]], interval: float) -> Iterator[str]:
    """Yield which largest forces belong to contacts that records do not resolve, one sentence a face.

    Args:
        found: As `force_peaks` returns them.
        interval: Between records, s.
    """
    worst: dict[str, Mapping[str, float]] = {}
    for faces in found.values():
        for face, peaks in faces.items():
            short = peaks[DURATION] < (RESOLVING_STEPS + 0.5) * interval
            if short and peaks[LARGEST_FORCE] > NOTABLE * peaks[MEAN_FORCE] > 0.0:
                worst[face] = max(peaks, worst.get(face, peaks), key=lambda one: one[LARGEST_FORCE])
    for face, peaks in worst.items():
        count = round(peaks[DURATION] / interval)
        largest, mean = peaks[LARGEST_FORCE], peaks[MEAN_FORCE]
        yield (
            f"the {LARGEST_FORCE} on {face}, {largest:.4g} N, is {largest / mean:.2g} times the {MEAN_FORCE}, "
            f"{mean:.4g} N: a contact of {count} records is not resolved, and the force of one record follows the "
            "step; use the mean, or a smaller time.step"
        )
