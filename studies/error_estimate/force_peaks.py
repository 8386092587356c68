"""The largest contact forces of a run: means over stated windows, and beside them the largest of a single record.

The force of one step has no limit at an impact: it grows as the step shrinks, and follows the formulation. Its mean
over a window is a difference of impulses, which converges.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from gapbeam.solver.case.case import Case
from gapbeam.studies.error_estimate.horizon import spans_of
from gapbeam.studies.error_estimate.key_figures import FORCE_WINDOW
from gapbeam.studies.error_estimate.motion_record import MotionRecord, window_means

WINDOWS = (0.5 * FORCE_WINDOW, FORCE_WINDOW, 2.0 * FORCE_WINDOW)  # s
NOTABLE = 1.3  # of the mean: a larger force of one record is not a force of the structure

ForcePeaks = dict[str, dict[str, dict[str, float]]]


def force_peaks(run: MotionRecord, case: Case) -> ForcePeaks:
    """Return the largest contact forces, N, by part of the run, face and window.

    The windows are "0.25 ms mean", "0.5 ms mean" and "1 ms mean", at least one interval between records long; "one
    record" is the largest value on record.
    """
    found: ForcePeaks = {}
    for span in spans_of(case, run.end, run.interval, None):
        part = run.between(span.start, span.end)
        means = {
            f"{1e3 * max(width, run.interval):.3g} ms mean": window_means(part.impulse, run.interval, width).max(axis=0)
            for width in WINDOWS
        }
        means["one record"] = part.force.max(axis=0)
        found[span.name] = {
            face: {name: float(peaks[number]) for name, peaks in means.items()} for number, face in enumerate(run.faces)
        }
    return found


def doubtful_peaks(found: Mapping[str, Mapping[str, Mapping[str, float]]]) -> Iterator[str]:
    """Yield which largest forces of one record are far above their means, one sentence a face."""
    usual = f"{1e3 * FORCE_WINDOW:g} ms mean"
    worst: dict[str, tuple[float, float]] = {}
    for faces in found.values():
        for face, peaks in faces.items():
            mean, single = peaks.get(usual, 0.0), peaks["one record"]
            if single > NOTABLE * mean > 0.0 and single > worst.get(face, (0.0, 0.0))[0]:
                worst[face] = single, mean
    for face, (single, mean) in worst.items():
        yield (
            f"the largest contact force of one record on {face}, {single:.4g} N, is {single / mean:.2g} times the "
            f"largest {usual}, {mean:.4g} N: the force of one step follows the step and the formulation; use the mean"
        )
