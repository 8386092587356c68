"""Conclusion of an identification: best values, how well they are known, and their predictions.

Around the best values it has derivatives of the figures, their noise, and the profile of the misfit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gapbeam.postprocess.study_figures.sweep_branches import CREEPING
from gapbeam.studies.identification.evaluations import Evaluations, Record, failed, mean
from gapbeam.studies.identification.identifiability import Identifiability, bound_of_misfit, identifiability, spread_of
from gapbeam.studies.identification.identification_file import FloatArray, Problem, Values
from gapbeam.studies.identification.misfit import (
    BudgetSpentError,
    Misfit,
    completed,
    difference_places,
    figure_slopes_at,
    polish,
    scales_of,
)

PROFILE = (-1.5, -1.0, -0.5, 0.5, 1.0, 1.5)  # of the half-width of an interval
DROWNED = 0.5  # of a derivative: a standard error beyond which it says little


class Neighborhood(NamedTuple):
    """Sensitivities around a set of values.

    Attributes:
        figures: Figures of all measurements, (m,), SI.
        slopes: Their derivatives by the coordinates, (m, n).
        known: Unknowns that the fitted ones determine.
        drowned: Unknowns by which the derivatives are within the scatter of the responses.
    """

    figures: FloatArray
    slopes: FloatArray
    known: Identifiability
    drowned: tuple[str, ...]

    def sensitivity(self, problem: Problem, values: Values) -> FloatArray:
        """Return d ln(figure) / d ln(unknown), (m, n); not numbers where one of them is 0 or failed."""
        z = problem.scaled(values)
        powers = np.array([one.elasticity(float(place)) for one, place in zip(problem.coordinates, z, strict=True)])
        with np.errstate(divide="ignore", invalid="ignore"):
            found = self.slopes / self.figures[:, None] / powers
        return np.where(np.isfinite(found), found, np.nan)

    def intervals(self, problem: Problem, values: Values) -> tuple[tuple[float, float], ...]:
        """Return the ends of the interval of each unknown, within its bounds, in its unit."""
        z = map(float, problem.scaled(values))
        return tuple(
            (one.value(place - finding.half_width), one.value(place + finding.half_width))
            for one, place, finding in zip(problem.coordinates, z, self.known.findings, strict=True)
        )


def neighborhood(problem: Problem, evaluations: Evaluations, values: Values) -> Neighborhood:
    """Return the neighborhood of values, by central differences of all experiments, also of those held out."""
    settings, z = problem.file.search, problem.scaled(values)
    pairs = difference_places(z, settings.difference)
    here = evaluations.of([values], problem.everything)[0]
    tried: dict[Values, list[Record]] = {values: here}

    def figures_at(places: FloatArray) -> FloatArray:
        points = [problem.values(row) for row in places]
        tried.update(zip(points, evaluations.of(points, problem.everything), strict=True))
        return np.array([_figures(problem, tried[point]) for point in points])

    figures = np.array(_figures(problem, here))
    known = figure_slopes_at(problem, evaluations, values)
    slopes = completed(known, figures_at, z, pairs)
    errors = {point: _errors(problem, row) for point, row in tried.items()}
    fitted, scales = list(problem.fitted), scales_of(problem)
    residuals = np.array([scales[number](figures[number]) for number in fitted])
    per_logarithm = np.array([scales[number].per_logarithm for number in fitted])
    given = all(scales[number].sigma is not None for number in fitted)
    spread = spread_of(residuals, len(values), per_logarithm, given, settings.confidence)
    per_figure = np.array([[scales[number].slope(figures[number])] for number in fitted])
    jacobian = per_figure * slopes[fitted]
    noise = per_figure * _noise(problem, errors, pairs)[fitted]
    names = [one.unknown.key for one in problem.coordinates]
    within = np.linalg.norm(noise, axis=0) > DROWNED * np.linalg.norm(jacobian, axis=0)
    drowned = tuple(name for name, is_within in zip(names, within, strict=True) if is_within)
    return Neighborhood(figures, slopes, identifiability(jacobian, spread, names), drowned)


def evaluate_profile(misfit: Misfit, values: Values, known: Identifiability) -> None:
    """Evaluate places along the way on which the misfit grows least as one unknown moves: z + d C_j / C_jj."""
    z = misfit.problem.scaled(values)
    places = []
    for number, finding in enumerate(known.findings):
        column = known.covariance[:, number]
        way = np.eye(len(z))[number]
        if np.all(np.isfinite(column)) and column[number] > 0.0:
            way = column / column[number]
        reach = min(finding.half_width, 1.0)
        places += [np.clip(z + share * reach * way, 0.0, 1.0) for share in PROFILE]
    misfit(np.array(places))


def _figures(problem: Problem, records: Sequence[Record]) -> list[float]:
    """Return the figure of each measurement."""
    return [mean(records[place], one.figure) for one, place in zip(problem.measurements, problem.places, strict=True)]


def _noise(problem: Problem, errors: Mapping[Values, FloatArray], pairs: Sequence[FloatArray]) -> FloatArray:
    """Return the standard errors of the derivatives by the scatter of the responses, (m, n); 0 of known slopes."""
    columns, none = [], np.zeros(len(problem.measurements))
    for number, pair in enumerate(pairs):
        low, high = (problem.values(row) for row in pair)
        apart = float(problem.scaled(high)[number] - problem.scaled(low)[number])
        columns.append(np.hypot(errors.get(low, none), errors.get(high, none)) / (apart or 1.0))
    return np.stack(columns, axis=1)


def _errors(problem: Problem, records: Sequence[Record]) -> FloatArray:
    """Return the standard error of the figure of each measurement, (m,)."""
    measured = zip(problem.measurements, problem.places, strict=True)
    return np.array([_error(records[place], one.figure) for one, place in measured])


def _error(record: Record, figure: str) -> float:
    """Return the standard error of a figure; 0 where it failed."""
    return 0.0 if failed(record) else float(record["figures"][figure]["error"])


BETTER = 0.99  # of the sum of squares: worth another round
ROUNDS = 3
ANOTHER = 0.05  # relative difference of a figure from another start that is reported
REFIT_STEPS = 4  # Gauss-Newton steps from better values that the profile has met
LEFT_OUT_STEPS = 2  # of a fit without one measurement, from the best of all evaluations


@dataclass(frozen=True)
class MeasurementRow:
    """Result of a measurement.

    Attributes:
        number: Number of the measurement.
        computed: Figure at the best values, SI; not a number where the experiment failed.
        scatter: Standard deviation of its windows.
        residual: Plain residual, as asked for, not divided by a standard error.
        log10: log10(computed/measured); not a number where that has none.
        response: "period 1", "no cycle", ... or the verdict of an experiment that failed.
        uncertainty: Standard deviation of the computed figure that the unknowns cause; not a number without a fit.
        others: The figure from other starts, where it is another response.
        left_out: log10 (or the residual asked for) of its prediction from all the others; None where not asked for.
    """

    number: int
    computed: float
    scatter: float
    residual: float
    log10: float
    response: str
    uncertainty: float
    others: tuple[float, ...]
    left_out: float | None = None


@dataclass(frozen=True)
class Conclusion:
    """All that was found.

    Attributes:
        problem: The identification.
        values: The best ones.
        cost: Their sum of squares.
        bound: Sum of squares up to which others cannot be distinguished from them.
        rows: One for each measurement.
        known: Identifiability.
        drowned: Unknowns by which the derivatives are within the scatter of the responses.
        sensitivity: d ln(figure) / d ln(unknown), (measurements, unknowns).
        intervals: Ends of the interval of each unknown by the Jacobian, within its bounds, in its unit.
        profiles: Ends of the range of each unknown among all evaluations that are as good, in its unit.
        tried: Sets of values that the search tried.
        cloud: Values and sum of squares of all evaluations that passed.
        failures: Records of those that did not.
    """

    problem: Problem
    values: Values
    cost: float
    bound: float
    rows: tuple[MeasurementRow, ...]
    known: Identifiability
    drowned: tuple[str, ...]
    sensitivity: FloatArray
    intervals: tuple[tuple[float, float], ...]
    profiles: tuple[tuple[float, float], ...]
    tried: int
    cloud: list[tuple[Values, float]]
    failures: list[Record]

    def rms(self, use: str, name: str = "residual") -> float:
        """Return the rms of residuals ("residual" or "log10") of fitted ("fit") or held out ("predict") figures.

        Not a number where there are none, or one of them failed.
        """
        found = [getattr(row, name) for row in self.rows if self.problem.measurements[row.number].use == use]
        return float(np.sqrt(np.mean(np.square(found)))) if found else math.nan

    @property
    def rms_left_out(self) -> float:
        """Return the rms of the residuals of measurements that the others predict; not a number where not asked for."""
        found = [row.left_out for row in self.rows if row.left_out is not None]
        return float(np.sqrt(np.mean(np.square(found)))) if found else math.nan

    @property
    def passed(self) -> bool:
        """True where every experiment passed its gates at the best values."""
        return all(math.isfinite(row.computed) for row in self.rows)


def conclude(
    problem: Problem, evaluations: Evaluations, tried: int, leave_one_out: bool, report: Callable[[str], None]
) -> Conclusion | None:
    """Look at the best of all evaluations; None where none passed.

    Args:
        problem: The identification.
        evaluations: Evaluations of the search; new ones are added.
        tried: Sets of values that the search tried.
        leave_one_out: Predict each fitted measurement from the others too.
        report: Hears what is done next.
    """
    settings = problem.file.search
    misfit = Misfit(problem, evaluations, budget=10**9)
    found = misfit.best()
    if found is None:
        return None
    left_out: dict[int, float] = {}
    if leave_one_out:
        report("each measurement from the others")
        left_out = {number: _from_the_others(problem, evaluations, number) for number in problem.fitted}
        found = misfit.best() or found
    for _ in range(ROUNDS):
        report("the neighborhood of the best values")
        values, cost = found
        around = neighborhood(problem, evaluations, values)
        if settings.profile:
            evaluate_profile(misfit, values, around.known)
        found = misfit.best() or found
        if found[1] >= BETTER * cost:
            break
        with_budget = Misfit(problem, evaluations, budget=REFIT_STEPS * (2 * len(values) + 2))
        _refit(with_budget, problem.scaled(found[0]))
        found = misfit.best() or found
    values, cost = found
    around = neighborhood(problem, evaluations, values)
    known = around.known
    report("responses from other starts")
    rows = _rows(problem, evaluations, values, around, left_out)
    cloud = misfit.cloud()
    bound = bound_of_misfit(cost, known.spread, len(misfit.fitted), len(values), settings.confidence)
    profiles = np.array([entry for entry, misfits in cloud if misfits <= bound] or [values])
    return Conclusion(
        problem=problem,
        values=values,
        cost=cost,
        bound=bound,
        rows=tuple(rows),
        known=known,
        drowned=around.drowned,
        sensitivity=around.sensitivity(problem, values),
        intervals=around.intervals(problem, values),
        profiles=tuple((float(column.min()), float(column.max())) for column in profiles.T),
        tried=tried,
        cloud=cloud,
        failures=misfit.failures(),
    )


def _refit(misfit: Misfit, z: FloatArray) -> None:
    """Spend the budget of a misfit on least squares from a place."""
    with suppress(BudgetSpentError):
        polish(misfit, z, misfit.problem.file.search.difference, misfit.slopes)


def _rows(
    problem: Problem, evaluations: Evaluations, values: Values, around: Neighborhood, left_out: Mapping[int, float]
) -> list[MeasurementRow]:
    numbers = problem.everything
    starts = range(1 + problem.file.search.coexisting)
    by_start = [evaluations.of([values], numbers, start)[0] for start in starts]
    scales, rows = scales_of(problem), []
    for number, (one, place) in enumerate(zip(problem.measurements, problem.places, strict=True)):
        record = by_start[0][place]
        computed = mean(record, one.figure)
        scatter = math.nan if failed(record) else float(record["figures"][one.figure]["scatter"])
        settled = [entry[place] for entry in by_start[1:] if not failed(entry[place])]
        others = [mean(entry, one.figure) for entry in settled if entry["response"] != CREEPING]
        others = [] if not failed(record) and record["response"] == CREEPING else others
        report = tuple(other for other in others if abs(other - computed) > ANOTHER * abs(computed) + 2.0 * scatter)
        ratio = computed / one.value if one.value else math.nan
        with np.errstate(invalid="ignore"):  # directions that are not determined have an infinite covariance
            variance = float(around.slopes[number] @ around.known.covariance @ around.slopes[number])
        rows.append(
            MeasurementRow(
                number,
                computed,
                scatter,
                scales[number].plain(computed),
                math.log10(ratio) if ratio > 0.0 else math.nan,
                str(record["verdict"]) if failed(record) else str(record["response"]),
                math.sqrt(variance) if variance >= 0.0 else math.inf,
                report,
                left_out.get(number),
            )
        )
    return rows


def _from_the_others(problem: Problem, evaluations: Evaluations, number: int) -> float:
    """Return the plain residual of a measurement by a fit to all the others, from the best of all evaluations.

    Not a number where it is the only one, or its experiment failed.
    """
    rest = [other for other in problem.fitted if other != number]
    misfit = Misfit(problem, evaluations, rest, LEFT_OUT_STEPS * (2 * len(problem.coordinates) + 2))
    begin = misfit.best() if rest else None
    if begin is None:
        return math.nan
    _refit(misfit, problem.scaled(begin[0]))
    values, _ = misfit.best() or begin
    record = evaluations.of([values], [problem.places[number]])[0][0]
    return scales_of(problem)[number].plain(mean(record, problem.measurements[number].figure))
