"""Errors of fidelity levels relative to the finest, the error of the finest itself, and the choice of a level.

All fidelity levels start from their own seat. Figures are compared window by window over the span of the case, as
errors grow with time: a period that is 0.01 % too long detunes a resonance, and shows after hundreds of periods only. A
chaotic motion can be compared as long as it can be predicted: as long as the members of the reference family stay
together. Beyond that it has only statistics: means over windows and starts, with their standard errors.

A tolerance is promised where the level is inside it over the span of the case: error and uncertainty of the reference
together, in every window. What is missing is a doubt, and a doubt is never dropped.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf, isfinite, log

import numpy as np

from gapbeam.postprocess.display_units import in_percent
from gapbeam.postprocess.signals.figure_names import LARGEST_FORCE
from gapbeam.postprocess.signals.steady_figures import scales_of
from gapbeam.postprocess.study_figures.sweep_branches import CREEPING
from gapbeam.studies.tradeoff.level_measurement import REFINEMENT, Level, LevelPlan, MeasuredLevel

GROUPS = ("acceleration", "displacement", "harmonics", LARGEST_FORCE, "impulse")
TOGETHER = 0.01  # rms difference of waveforms over their range, up to which motions can be predicted
ORDERS = (0.5, 4.0)  # observed orders that are believed
STANDARD_ERRORS = 2.0
ENDINGS = {
    " smoothed acceleration": "acceleration",
    " displacement": "displacement",
    f" {LARGEST_FORCE}": LARGEST_FORCE,
    " impulse": "impulse",
}
Figures = Mapping[str, float]
Windows = Mapping[str, np.ndarray]  # figures by name, window by window


@dataclass(frozen=True)
class Judged:
    """A fidelity level and its distance from the reference.

    Attributes:
        level: The fidelity level.
        measured: Its cost and answers.
        errors: Largest relative difference of every group of figures in any window of the time that is covered.
        statistics: Largest difference of the long means beyond 2 standard errors; None without long marches.
        seconds: Predicted wall time of the whole case on it: set-up and march, s.
        covered: Time from the seat that the errors cover, s.
        means: Largest difference of the long means: by what they do, and 2 standard errors; None likewise.
    """

    level: Level
    measured: MeasuredLevel
    errors: dict[str, float]
    statistics: float | None
    seconds: float
    covered: float = 0.0
    means: float | None = None

    @property
    def error(self) -> float:
        """The largest error over all groups; infinite for a fidelity level that failed."""
        return max(self.errors.values(), default=inf)

    def inside(self, tolerance: float) -> bool:
        """Return True where figures and statistics are within a tolerance of the reference."""
        return self.measured.verdict == "passed" and max(self.error, self.statistics or 0.0) <= tolerance


def judged(level: Level, measured: MeasuredLevel, reference: MeasuredLevel, periods: int, end: float) -> Judged:
    """Compare a fidelity level with the reference.

    Args:
        level: The fidelity level.
        measured: Its figures.
        reference: Figures of the reference.
        periods: Forcing periods from the seat over which they are compared where one has no windows over the span.
        end: Simulated time of the case, s.
    """
    seconds = measured.set_up + end * measured.per_second
    if measured.verdict != "passed":
        return Judged(level, measured, {}, None, seconds)
    if measured.windows and reference.windows:
        covered, errors = measured.span, window_differences(measured.windows, reference.windows)
    else:
        covered = periods / measured.frequency
        errors = differences(measured.figures(periods), reference.figures(periods))
    beyond, means = _long_means(measured, reference)
    return Judged(level, measured, errors, beyond, seconds, covered, means)


def differences(one: Figures, other: Figures) -> dict[str, float]:
    """Return the largest difference of every group of figures, relative to the other."""
    found: dict[str, float] = {}
    scales = scales_of(other)
    for name in one.keys() & other.keys():
        group = group_of(name)
        if group is not None:
            found[group] = max(found.get(group, 0.0), abs(one[name] - other[name]) / scales[name])
    return {group: found[group] for group in GROUPS if group in found}


def window_differences(one: Windows, other: Windows) -> dict[str, float]:
    """Return the largest difference of every group of figures in any window, relative to the other in that window."""
    found: dict[str, float] = {}
    for mine, reference in zip(_by_window(one), _by_window(other), strict=True):
        for group, difference in differences(mine, reference).items():
            found[group] = max(found.get(group, 0.0), difference)
    return {group: found[group] for group in GROUPS if group in found}


def predictable_periods(family: Sequence[MeasuredLevel], most: int) -> int:
    """Return for how many forcing periods from the seat all motions stay with the first one."""
    first = family[0]
    for periods in range(1, most + 1):
        waves = first.waves(periods)
        for other in family[1:]:
            others = other.waves(periods)
            for name, wave in waves.items():
                values = np.interp(wave.time, others[name].time, others[name].values)
                span = float(np.ptp(wave.values))
                if span > 0.0 and float(np.sqrt(np.mean((values - wave.values) ** 2))) > TOGETHER * span:
                    return periods - 1
    return most


def uncertainty(plan: LevelPlan, found: Mapping[str, MeasuredLevel], periods: int) -> dict[str, float]:
    """Return the uncertainty of the reference by mesh, step and basis, each relative, summed by group.

    The largest of any window over the span counts; without windows, the figures are those of so many forcing periods.

    From three meshes h, r h, r^2 h with values q, the error of the finest is |q1 - q0| / (r^p - 1) with
    r^p = (q2 - q1) / (q1 - q0), p within 0.5 and 4; where the differences do not shrink, the largest of them.
    Likewise for steps, with r = 2 and p up to 2.

    Source: Roache (1994), J. Fluids Eng. 116, 405, for the estimate.
    """
    members = {level.name: found[level.name] for level in plan.family}
    if all(one.windows for one in members.values()):
        windows = [_by_window(one.windows) for one in members.values()]
    else:
        windows = [[one.figures(periods)] for one in members.values()]
    total: dict[str, float] = {}
    for figures in zip(*windows, strict=True):
        for group, error in _reference_errors(plan, dict(zip(members, figures, strict=True))).items():
            total[group] = max(total.get(group, 0.0), error)
    return {group: total[group] for group in GROUPS if group in total}


def _reference_errors(plan: LevelPlan, figures: Mapping[str, Figures]) -> dict[str, float]:
    """Return the uncertainty of the reference in one window, by group, from the figures of its family."""
    reference = figures[plan.reference.name]
    total: dict[str, float] = {}
    scales = scales_of(reference)
    triples = [(plan.meshes, REFINEMENT, ORDERS[1]), (plan.steps, 2.0, 2.0)]
    for name, finest in reference.items():
        group = group_of(name)
        if group is None:
            continue
        error = abs(figures[plan.basis.name][name] - finest)
        for levels, ratio, most in triples:
            values = [finest, *(figures[level.name][name] for level in levels)]
            error += richardson(values[0], values[1], values[2], ratio, most)
        total[group] = max(total.get(group, 0.0), error / scales[name])
    return total


def richardson(finest: float, middle: float, coarsest: float, ratio: float, most: float) -> float:
    """Return the estimated error of the finest of three values; see `uncertainty`."""
    near, far = middle - finest, coarsest - middle
    if near == 0.0:
        return 0.0
    if far * near <= 0.0 or abs(far) <= abs(near):
        return max(abs(near), abs(far))
    order = float(np.clip(log(far / near) / log(ratio), ORDERS[0], most))
    return float(abs(near) / (ratio**order - 1.0))


def front(levels: Sequence[Judged]) -> list[Judged]:
    """Return the levels than which no other is both cheaper and more accurate, from cheap to expensive."""
    best, found = inf, list[Judged]()
    for one in sorted(levels, key=lambda one: (one.seconds, one.error)):
        if one.error < best:
            best = one.error
            found.append(one)
    return found


def group_of(name: str) -> str | None:
    """Return the group of a figure; None: it belongs to none."""
    if " harmonic " in name:
        return "harmonics"
    return next((group for ending, group in ENDINGS.items() if name.endswith(ending)), None)


def _by_window(windows: Windows) -> list[dict[str, float]]:
    """Return the figures of every window, by name."""
    count = max((len(values) for values in windows.values()), default=0)
    return [{name: float(values[place]) for name, values in windows.items()} for place in range(count)]


def _long_means(one: MeasuredLevel, other: MeasuredLevel) -> tuple[float | None, float | None]:
    """Return the difference of long means: less 2 standard errors, and plus 2 standard errors.

    Both are infinite for other cycles, and None without long marches.
    """
    if not one.long or not other.long:
        return None, None
    cycles = [{word for word in measured.words if word != CREEPING} for measured in (one, other)]
    if cycles[0] and cycles[1] and not cycles[0] & cycles[1]:
        return inf, inf
    beyond, most = 0.0, 0.0
    scales = scales_of({name: quantity.mean for name, quantity in other.long.items()})
    for name in one.long.keys() & other.long.keys():
        if group_of(name) is not None:
            a, b = one.long[name], other.long[name]
            scatter = STANDARD_ERRORS * float(np.hypot(a.uncertainty, b.uncertainty))
            beyond = max(beyond, (abs(a.mean - b.mean) - scatter) / scales[name])
            most = max(most, (abs(a.mean - b.mean) + scatter) / scales[name])
    return beyond, most


WHOLE = 1.0 - 1.0e-6  # share of the end of a case that counts as all of it


@dataclass(frozen=True)
class Grounds:
    """Facts about all levels of a trade-off.

    Attributes:
        end: Simulated time of the case, s.
        uncertainty: Uncertainty of the reference, by group of figures.
        chaotic: Whether the response never repeats.
        cut: Why the reference was not marched over the whole case; "" where it was.
    """

    end: float
    uncertainty: Mapping[str, float]
    chaotic: bool = False
    cut: str = ""

    def span_words(self, covered: float) -> str:
        """Return the part of the case that errors cover, in words."""
        if covered >= WHOLE * self.end:
            return f"over the {self.end:.4g} s of the case"
        words = f"over the first {covered:.3g} s of {self.end:.4g} s"
        return f"{words}, and in means beyond" if self.chaotic else words


def choice(levels: Sequence[Judged], tolerance: float, grounds: Grounds) -> Judged | None:
    """Return the cheapest level inside a tolerance, those that promise it first; None where none is inside."""
    inside = [one for one in levels if one.inside(tolerance)]
    return min(inside, key=lambda one: (bool(doubts(one, tolerance, grounds)), one.seconds), default=None)


def nearest(levels: Sequence[Judged], grounds: Grounds) -> Judged | None:
    """Return the level nearest to the reference, those with errors over the whole case first; None: all failed."""
    passed = [one for one in levels if one.measured.verdict == "passed" and one.errors]
    return min(passed, key=lambda one: (one.covered < WHOLE * grounds.end, _off(one), one.seconds), default=None)


def doubts(one: Judged, tolerance: float, grounds: Grounds) -> list[str]:
    """Return the doubts on a tolerance for a level; empty where there are none.

    Args:
        one: The level.
        tolerance: Largest error that will do, as a fraction.
        grounds: Facts about all levels.
    """
    found = []
    if not one.inside(tolerance):
        found.append(f"{one.level.name} {_off_words(one)}")
    uncertain = grounds.uncertainty
    sums = {group: error + uncertain.get(group, 0.0) for group, error in one.errors.items()}
    worst = max(uncertain, key=lambda group: uncertain[group], default="")
    largest = max(sums, key=lambda group: sums[group], default="")
    if uncertain.get(worst, 0.0) > tolerance:
        found.append(f"the reference itself is uncertain by {in_percent(uncertain[worst])} ({worst})")
    elif one.inside(tolerance) and sums.get(largest, 0.0) > tolerance:
        found.append(
            f"its error and the uncertainty of the reference add up to {in_percent(sums[largest])} ({largest})"
        )
    if one.covered < WHOLE * grounds.end:
        found += _span_doubts(one, tolerance, grounds)
    return found


def _span_doubts(one: Judged, tolerance: float, grounds: Grounds) -> list[str]:
    """Return the doubts about a level whose errors do not cover the whole case."""
    if not grounds.chaotic:
        reason = f": {grounds.cut}" if grounds.cut else ", since a longer reference would cost too much"
        return [f"errors cover the first {one.covered:.3g} s of {grounds.end:.4g} s only{reason}"]
    known = inf if one.means is None else one.means
    if known <= tolerance:
        return []
    words = "are not known" if not isfinite(known) else f"are known to {in_percent(known)} only"
    return [f"the motion can be predicted for {one.covered:.3g} s only, and means beyond that {words}"]


def _off(one: Judged) -> float:
    """Return the larger of error and excess of the long means."""
    return max(one.error, one.statistics or 0.0)


def _off_words(one: Judged) -> str:
    if not isfinite(_off(one)):
        return "is in another cycle than the reference"
    worst = max(one.errors, key=lambda group: one.errors[group], default="")
    where = worst if one.error >= (one.statistics or 0.0) else "means over windows"
    return f"is {in_percent(_off(one))} off the reference ({where})"
