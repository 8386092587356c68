"""The error of each key figure, from the differences between a run and its companions.

    E = max(2 |f(same) - f(finest)|, |f(same) - f(coarser mesh)|, 4/3 |f(same) - f(half step)|)
        + |f(run) - f(same)| + 2 |f(same) - f(stiffer)|

The last two terms belong to full models, and to a contact stiffness that was computed. Where plane companions stand for
a solid, differences are taken relative to the figures of the plane and enlarged by a tenth, and the second line falls
away. A span that the horizon ends is where motions are about to part: E is twice as large there. Beyond the
horizon figures are means over windows; the terms are draws of the same statistics there, so that the
largest of them stands for their sum, and the error is the larger of 2 E and of 2.83 standard errors, those of the
difference of two means of which each has 2 standard errors.

The factors were found by comparing estimates with converged marches, not derived; benchmarks.error_estimates
compares them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from gapbeam.studies.error_estimate.companions import COARSER, FINEST, HALF_STEP, SAME, STIFFER
from gapbeam.studies.error_estimate.horizon import FEWEST_WINDOWS
from gapbeam.studies.error_estimate.key_figures import UP_TO_HORIZON, KeyFigure, Span, key_figures
from gapbeam.studies.error_estimate.motion_record import MotionRecord

FACTORS = {FINEST: 2.0, COARSER: 1.0, HALF_STEP: 4.0 / 3.0}
RIGID_FACTOR = 2.0  # the distance from rigid contact goes as 1 / stiffness: twice that from twice the stiffness
OF_A_SOLID = 1.1  # differences of a solid over those of its plane slice
STANDARD_ERRORS = 2.83
PARTED = 2.0  # E is so much larger where motions are about to part, and where they have


@dataclass(frozen=True)
class FigureError:
    """A key figure of a run with its error.

    Attributes:
        name: Such as "tip displacement".
        unit: SI unit.
        span: Part of the run.
        value: Mean over the windows of the span.
        error: Estimate of its error; None: not known.
        scale: What errors are judged relative to: the value, or the largest of its group.
        parts: Differences from each companion, in the unit of the figure, by name.
        standard_error: Of the mean over windows.
    """

    name: str
    unit: str
    span: str
    value: float
    error: float | None
    scale: float
    parts: Mapping[str, float]
    standard_error: float

    @property
    def relative(self) -> float | None:
        """The error relative to the scale; None: not known."""
        return None if self.error is None or self.scale == 0.0 else self.error / self.scale


def figure_errors(
    run: MotionRecord, companions: Mapping[str, MotionRecord], span: Span, in_plane: bool
) -> list[FigureError]:
    """Return the key figures of a run over a span, with their errors.

    Args:
        run: The motion of the run.
        companions: Those of its companions, by name; without `same`, the run is that itself.
        span: Part of the run.
        in_plane: Whether plane companions stand for a solid.
    """
    mine = key_figures(run, span)
    theirs = {name: key_figures(motion, span) for name, motion in companions.items()}
    same = theirs.get(SAME, mine)
    scales, plane_scales = _scales(mine), _scales(same)
    found = []
    for name, figure in mine.items():
        usual = same[name].mean
        ratio = OF_A_SOLID * scales[name] / (plane_scales[name] or 1.0) if in_plane else 1.0
        parts = {other: ratio * abs(usual - theirs[other][name].mean) for other in theirs if other != SAME}
        if SAME in theirs and not in_plane:
            parts["model"] = abs(figure.mean - usual)
        error = _error(parts, figure, span)
        found.append(
            FigureError(
                name, figure.unit, span.name, figure.mean, error, scales[name], parts, figure.uncertainty
            )
        )  # fmt: skip
    return found


def _error(parts: Mapping[str, float], figure: KeyFigure, span: Span) -> float | None:
    error = max(factor * parts[name] for name, factor in FACTORS.items() if name in parts)
    beside = parts.get("model", 0.0), RIGID_FACTOR * parts.get(STIFFER, 0.0)
    if span.predictable:
        return (PARTED if span.name == UP_TO_HORIZON else 1.0) * (error + sum(beside))
    if figure.values.size < FEWEST_WINDOWS:
        return None
    return max(PARTED * max(error, *beside), STANDARD_ERRORS * figure.uncertainty)


def _scales(figures: Mapping[str, KeyFigure]) -> dict[str, float]:
    """Return what errors are judged relative to, by name."""
    largest: dict[str, float] = {}
    for figure in figures.values():
        if figure.group:
            largest[figure.group] = max(largest.get(figure.group, 0.0), abs(figure.mean))
    return {name: largest[figure.group] if figure.group else abs(figure.mean) for name, figure in figures.items()}
