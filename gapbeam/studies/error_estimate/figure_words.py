"""Key figures with their errors in words, as the last line of a run has them."""

from __future__ import annotations

from collections.abc import Sequence

from gapbeam.postprocess.signals.figure_names import (
    AXIAL_STRESS,
    DISPLACEMENT,
    LARGEST_FORCE,
    MEAN_FORCE,
    VON_MISES_STRESS,
)
from gapbeam.solver.record_table import SUMMARY_FILE
from gapbeam.studies.error_estimate.figure_errors import FigureError
from gapbeam.studies.error_estimate.force_peaks import BEYOND_HORIZON, SETTLED, UP_TO_HORIZON, WHOLE_RUN

LEAST_SHOWN = 0.001  # %: what rounds a sum of steps is no error estimate
FORCES = (f" {LARGEST_FORCE}", f" {MEAN_FORCE}")
IN_THE_MESSAGE = (f" {DISPLACEMENT}", f" {AXIAL_STRESS}", f" {VON_MISES_STRESS}", *FORCES)
MOST_FORCES = 4  # in the last line
SHOWN = (SETTLED, WHOLE_RUN, "first part", BEYOND_HORIZON, UP_TO_HORIZON, "start-up")


def figures_in_words(figures: Sequence[FigureError], reached: float, whole: bool) -> str:
    """Return the main figures with their errors in one line; of many faces those with the largest forces.

    Args:
        figures: Of all parts of a run.
        reached: Up to where errors are known, s.
        whole: Whether that is the end of the run.
    """
    known = [one for one in figures if one.error is not None]
    span = next((name for name in SHOWN if any(one.span == name for one in known)), None)
    shown = [one for one in known if one.span == span and one.name.endswith(IN_THE_MESSAGE)]
    forces = sorted((one for one in shown if one.name.endswith(FORCES)), key=lambda one: -abs(one.value))
    smaller = [one for one in forces[MOST_FORCES:] if one.value or one.error]
    words = [
        f"{one.name} {with_unit(one.value, one.unit)} {_plus_minus(one)}"
        for one in shown
        if one not in forces[MOST_FORCES:]
    ]
    words += [f"{len(smaller)} smaller forces in {SUMMARY_FILE}"] if smaller else []
    until = "" if whole else f", up to t = {reached:.3g} s"
    return f"{span}{until}: {', '.join(words)}" if words else "no figure could be estimated"


def _plus_minus(one: FigureError) -> str:
    """Return an error in per cent of its figure, or in the unit of the figure where it is larger than that."""
    if one.relative is None:
        return f"+- {with_unit(one.error or 0.0, one.unit, 2)}"
    percent = 100.0 * one.relative
    if percent < LEAST_SHOWN:
        return f"+- less than {LEAST_SHOWN:g} %"
    return f"+- {percent:.0f} %" if percent >= 10.0 else f"+- {percent:.2g} %"


def with_unit(value: float, unit: str, digits: int = 3) -> str:
    """Return a value with its unit; lengths in mm."""
    if unit == "m" and abs(value) < 1.0:
        return f"{1e3 * value:.{digits}g} mm"
    return f"{value:.{digits}g} {unit}"
