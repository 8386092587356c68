"""The error of each key figure, from the differences between a run and its companions.

With f of the run, R of its reference, and A, C, D, H, K of the companions (finest, coarser mesh, four times the step,
half the step, stiffer contact),

    E = max(2 |R - A|, |R - C|, |R - D| / 2, 4/3 |R - H|) + |f - R| + 3.4 |R - K|

each term where there is such a companion. The reference marches with twice the step of the run: |f - R| is the
error of a scheme of first order, and three times that of one of second order; of full models it has the error of the
reduced basis, too. A thorough estimate has a reference with the step of the run. |R - K| belongs to a contact stiffness
that was computed and stands for rigid contact: the duration of contacts goes as K^(-1/2), so that the distance from
rigid contact is 1 / (1 - 2^(-1/2)) = 3.4 times the difference that doubling K makes.

Where plane companions stand for a solid, differences are taken relative to the figures of the plane and enlarged by a
tenth, and |f - R| falls away. A span that the horizon ends is where motions are about to part: E is twice as large
there.

Beyond the horizon figures are means over windows, and so is each term: it differs by chance as much as two means do.
With the pooled standard deviation s of the windows of run and companions, n windows in each, the standard deviation m
of the k means themselves, which holds what windows have in common, and t the two-sided 95 % quantiles of Student's
distribution with k (n - 1) and k - 1 degrees of freedom,

    c = max(t s sqrt(2 / n), t m sqrt(2)),    E = c + max_i F_i max(0, |d_i| - c)

with the factors F_i of the terms above: what differs by more than chance is an error of step, mesh or stiffness.

The factors but those derived here were found by comparing estimates with converged marches; benchmarks.drawn_cases
compares them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from gapbeam.postprocess.signals.steady_figures import WindowFigure
from gapbeam.studies.error_estimate.companions import COARSER, FINEST, FOURFOLD, HALF_STEP, STIFFER
from gapbeam.studies.error_estimate.key_figures import Averages, key_figures
from gapbeam.studies.error_estimate.motion_record import MotionRecord
from gapbeam.studies.error_estimate.spans import FEWEST_WINDOWS, UP_TO_HORIZON, Span

FACTORS = {FINEST: 2.0, COARSER: 1.0, FOURFOLD: 0.5, HALF_STEP: 4.0 / 3.0}
RIGID_FACTOR = 1.0 / (1.0 - 0.5**0.5)
MODEL = "step and model"  # the difference from the reference
OF_A_SOLID = 1.1  # differences of a solid over those of its plane slice
PARTED = 2.0  # E is so much larger where motions are about to part
CONFIDENCE = 0.95
ROUND_OFF = 1.0e-12  # of a figure: a plane one that is smaller is no scale


@dataclass(frozen=True)
class FigureError:
    """A key figure of a run with its error.

    Attributes:
        name: Such as "tip peak-to-peak displacement".
        unit: SI unit.
        span: Part of the run.
        value: Mean over the windows of the span.
        error: Estimate of its error; None: not known.
        parts: Differences from each companion, in the unit of the figure, by name.
        standard_error: Of the mean over windows.
        window: Width of the mean that the figure is, s; None: it is none.
    """

    name: str
    unit: str
    span: str
    value: float
    error: float | None
    parts: Mapping[str, float]
    standard_error: float
    window: float | None = None

    @property
    def relative(self) -> float | None:
        """The error relative to the figure; None: not known, or larger than the figure."""
        known = self.error is not None and self.error <= abs(self.value) and self.value != 0.0
        return self.error / abs(self.value) if known and self.error is not None else None


def figure_errors(
    run: MotionRecord,
    companions: Mapping[str, MotionRecord],
    reference: str | None,
    span: Span,
    in_plane: bool,
    averages: Averages,
    records: int = 1,
) -> list[FigureError]:
    """Return the key figures of a run over a span, with their errors.

    Args:
        run: The motion of the run.
        companions: Those of its companions, by name.
        reference: The companion with which the others are compared; None: they are compared with the run.
        span: Part of the run.
        in_plane: Whether plane companions stand for a solid.
        averages: Widths of the means.
        records: Companions have the first of every so many records of the run.
    """
    reported = key_figures(run, span, averages)
    mine = reported if records == 1 else key_figures(run.thinned(records), span, averages)
    theirs = {name: key_figures(motion, span, averages) for name, motion in companions.items()}
    same = mine if reference is None else theirs[reference]
    found = []
    for name, figure in reported.items():
        usual = same[name].mean
        ratio = OF_A_SOLID * _ratio(mine[name].mean, usual) if in_plane else 1.0
        parts = {other: ratio * abs(usual - theirs[other][name].mean) for other in theirs if other != reference}
        if reference is not None and not in_plane:
            parts[MODEL] = abs(mine[name].mean - usual)
        error = None
        if parts:
            everyone = [mine[name], *(one[name] for one in theirs.values())]
            error = _error(parts, span) if span.predictable else _error_of_means(parts, everyone, ratio)
        window = averages.width_of(name)
        found.append(FigureError(name, figure.unit, span.name, figure.mean, error, parts, figure.uncertainty, window))
    return found


def _ratio(solid: float, plane: float) -> float:
    """Return a figure of a solid over that of its slice; 1 where the slice has none."""
    return abs(solid / plane) if abs(plane) > ROUND_OFF * abs(solid) else 1.0


def _error(parts: Mapping[str, float], span: Span) -> float:
    error = max((factor * parts[name] for name, factor in FACTORS.items() if name in parts), default=0.0)
    error += parts.get(MODEL, 0.0) + RIGID_FACTOR * parts.get(STIFFER, 0.0)
    return (PARTED if span.name == UP_TO_HORIZON else 1.0) * error


def _error_of_means(parts: Mapping[str, float], figures: Iterable[WindowFigure], ratio: float) -> float | None:
    """Return the error of a mean over windows; None with fewer than four windows, which say nothing."""
    values = [figure.values for figure in figures]
    count = values[0].size
    if count < FEWEST_WINDOWS:
        return None
    within = float(np.sqrt(np.mean([one.var(ddof=1) for one in values]) / count))
    between = float(np.std([one.mean() for one in values], ddof=1))
    degrees = len(values) * (count - 1), len(values) - 1
    parted = [
        float(student.ppf(0.5 + 0.5 * CONFIDENCE, degree)) * deviation
        for degree, deviation in zip(degrees, (within, between), strict=True)
        if degree > 1  # two means say nothing of how means differ
    ]
    chance = max(ratio, 1.0) * float(np.sqrt(2.0)) * max(parted)
    factors = {**FACTORS, MODEL: 1.0, STIFFER: RIGID_FACTOR}
    return chance + max(factors[name] * max(0.0, part - chance) for name, part in parts.items())
