"""What lies around the best values: derivatives of the figures, their noise, and the profile of the misfit."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from gapbeam.studies.identification.evaluations import Evaluations, failed, mean
from gapbeam.studies.identification.experiment_trial import Record
from gapbeam.studies.identification.identifiability import Identifiability, identifiability, spread_of
from gapbeam.studies.identification.identification_problem import FloatArray, Problem, Values
from gapbeam.studies.identification.misfit import Misfit, scales_of
from gapbeam.studies.identification.parameter_search import difference_places, differences

PROFILE = (-1.5, -1.0, -0.5, 0.5, 1.0, 1.5)  # of the half-width of an interval
DROWNED = 0.5  # of a derivative: a standard error beyond which it says little


class Neighborhood(NamedTuple):
    """What lies around a set of values.

    Attributes:
        figures: Of all measurements, (m,), SI.
        slopes: Their derivatives by the coordinates, (m, n).
        known: What the fitted ones determine.
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
    """Return what lies around values, by central differences of all experiments, also of those held out."""
    settings, z = problem.file.search, problem.scaled(values)
    pairs = difference_places(z, settings.difference)
    points = [values, *(problem.values(row) for pair in pairs for row in pair)]
    records = evaluations.of(points, problem.everything)
    figures = np.array([_figures(problem, row) for row in records])
    tried = [np.array([problem.scaled(problem.values(row)) for row in pair]) for pair in pairs]
    slopes = differences(z, tried, figures)
    fitted, scales = list(problem.fitted), scales_of(problem)
    residuals = np.array([scales[number](figures[0, number]) for number in fitted])
    per_logarithm = np.array([scales[number].per_logarithm for number in fitted])
    given = all(scales[number].sigma is not None for number in fitted)
    spread = spread_of(residuals, len(values), per_logarithm, given, settings.confidence)
    per_figure = np.array([[scales[number].slope(figures[0, number])] for number in fitted])
    jacobian = per_figure * slopes[fitted]
    noise = per_figure * _noise(problem, records, tried)[fitted]
    names = [one.unknown.key for one in problem.coordinates]
    within = np.linalg.norm(noise, axis=0) > DROWNED * np.linalg.norm(jacobian, axis=0)
    drowned = tuple(name for name, is_within in zip(names, within, strict=True) if is_within)
    return Neighborhood(figures[0], slopes, identifiability(jacobian, spread, names), drowned)


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


def _noise(problem: Problem, records: Sequence[Sequence[Record]], tried: Sequence[FloatArray]) -> FloatArray:
    """Return the standard errors of the derivatives by the scatter of the responses, (m, n)."""
    measured = list(zip(problem.measurements, problem.places, strict=True))
    errors = np.array([[_error(row[place], one.figure) for one, place in measured] for row in records])
    columns = []
    for number, pair in enumerate(tried):
        apart = float(pair[1, number] - pair[0, number])
        columns.append(np.hypot(errors[1 + 2 * number], errors[2 + 2 * number]) / (apart or 1.0))
    return np.stack(columns, axis=1)


def _error(record: Record, figure: str) -> float:
    """Return the standard error of a figure; 0 where it failed."""
    return 0.0 if failed(record) else float(record["figures"][figure]["error"])
