"""Misfit of an identification, from the figures of evaluations, and the search that minimizes it.

The search is least squares from the best of places that are spread evenly. All coordinates run from 0 to 1, from the
lower to the upper bound of an unknown on its scale. Residuals that are not numbers, of runs that failed, are worse than
all others and are never averaged into anything.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from math import isfinite

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import qmc

from gapbeam.studies.identification.evaluations import Evaluations, Record, failed, mean
from gapbeam.studies.identification.identifiability import RESOLUTION
from gapbeam.studies.identification.identification_file import FloatArray, Problem, Values
from gapbeam.studies.identification.identification_tables import Measurement, Search


class BudgetSpentError(Exception):
    """The search has tried as many sets of values as it may."""


@dataclass(frozen=True)
class Scale:
    """Conversion of a measurement to a residual.

    Attributes:
        measurement: The measurement.
        residual: "log10", "relative" or "absolute".
    """

    measurement: Measurement
    residual: str

    @property
    def sigma(self) -> float | None:
        """Standard error of the value, in its unit; None where none is given."""
        one = self.measurement
        return one.sigma if one.relative_sigma is None else one.relative_sigma * abs(one.value)

    def slope(self, computed: float) -> float:
        """Return the derivative of the residual by the computed figure."""
        if self.residual == "log10":
            return 1.0 / (math.log(10.0) * computed * self._divisor)
        return 1.0 / ((abs(self.measurement.value) if self.residual == "relative" else 1.0) * self._divisor)

    @property
    def per_logarithm(self) -> float:
        """Change of the residual with the logarithm of the figure, at the measured value."""
        value = self.measurement.value
        return abs(value * self.slope(value)) if value else 0.0

    def plain(self, computed: float) -> float:
        """Return log10(computed/measured) or the difference, without the standard error.

        Not a number where the computed figure has another sign than the measured one and a logarithm is asked for.
        """
        value = self.measurement.value
        if self.residual == "log10":
            ratio = computed / value
            return math.log10(ratio) if ratio > 0.0 else math.nan
        return (computed - value) / (abs(value) if self.residual == "relative" else 1.0)

    def __call__(self, computed: float) -> float:
        """Return the residual: the plain one over the standard error on the same scale, where one is given."""
        return self.plain(computed) / self._divisor

    @property
    def _divisor(self) -> float:
        if self.sigma is None:
            return 1.0
        value = abs(self.measurement.value)
        if self.residual == "absolute":
            return self.sigma
        return self.sigma / value / (math.log(10.0) if self.residual == "log10" else 1.0)


class Misfit:
    """Residuals of the fitted measurements, as the search asks for them, within its budget.

    Attributes:
        problem: The identification.
        evaluations: Their source.
        scales: Scales of all measurements.
        fitted: Numbers of those that take part.
        tried: Sets of values so far, each counted once.

    Args:
        problem: The identification.
        evaluations: Their source.
        fitted: Numbers of the measurements that take part; default: as in the file.
        budget: Largest number of sets of values; default: as in the file.
    """

    def __init__(
        self,
        problem: Problem,
        evaluations: Evaluations,
        fitted: Sequence[int] | None = None,
        budget: int | None = None,
    ) -> None:
        self.problem, self.evaluations = problem, evaluations
        self.scales = scales_of(problem)
        self.fitted = tuple(problem.fitted if fitted is None else fitted)
        self.budget = problem.file.search.budget if budget is None else budget
        self.tried: set[Values] = set()

    def __call__(self, z: FloatArray) -> FloatArray:
        """Return the residuals at places (k, n) on the scales, (k, m); not numbers where an experiment failed.

        Raises:
            BudgetSpentError: The places are more sets of values than the budget allows; none of them was tried.
        """
        points = [self.problem.values(row) for row in z]
        tried = self.tried | set(points)
        if len(tried) > self.budget:
            raise BudgetSpentError
        self.tried = tried
        return self.residuals(points)

    def residuals(self, points: Sequence[Values]) -> FloatArray:
        """Return the residuals at sets of values, (k, m), whatever the budget."""
        numbers = sorted({self.problem.places[number] for number in self.fitted})
        rows = self.evaluations.of(points, numbers)
        return np.array([self._row(dict(zip(numbers, row, strict=True))) for row in rows])

    def slopes(self, z: FloatArray) -> FloatArray:
        """Return the derivatives of the residuals at a place that was tried, (m, n); not numbers where none is known.

        They are those of periodic responses, see `gapbeam.studies.identification.run_figures`.
        """
        values = self.problem.values(z)
        numbers = sorted({self.problem.places[number] for number in self.fitted})
        records = dict(zip(numbers, self.evaluations.of([values], numbers)[0], strict=True))
        found = figure_slopes_at(self.problem, self.evaluations, values)[list(self.fitted)]
        for row, number in zip(found, self.fitted, strict=True):
            computed = mean(records[self.problem.places[number]], self.scales[number].measurement.figure)
            row *= self.scales[number].slope(computed) if computed else math.nan
        return found

    def _row(self, records: dict[int, Record]) -> list[float]:
        found = []
        for number in self.fitted:
            scale = self.scales[number]
            record = records[self.problem.places[number]]
            found.append(scale(mean(record, scale.measurement.figure)))
        return found

    def best(self) -> tuple[Values, float] | None:
        """Return the values with the least sum of squares among all that are on disk; None where all failed."""
        cloud = self.cloud()
        return min(cloud, key=lambda entry: entry[1], default=None)

    def cloud(self) -> list[tuple[Values, float]]:
        """Return values and sum of squares of everything on disk that passed, in the order in which it was tried."""
        numbers = {self.problem.places[number] for number in self.fitted}
        found: dict[Values, dict[int, Record]] = {}
        for record in self.evaluations.records:
            if record["start"] == 0:
                found.setdefault(tuple(record["values"]), {})[record["experiment"]] = record
        cloud = []
        for values, records in found.items():
            if numbers <= set(records):
                cost = float(np.sum(np.square(self._row(records))))
                if math.isfinite(cost):
                    cloud.append((values, cost))
        return cloud

    def is_met(self, cost: float) -> bool:
        """Return whether a sum of squares is within the errors of figures of runs, or given standard errors."""
        scales = [self.scales[number] for number in self.fitted]
        least = RESOLUTION**2 * sum(one.per_logarithm**2 for one in scales)
        given = all(one.sigma is not None for one in scales)
        return cost <= (max(least, float(len(scales))) if given else least)

    def failures(self) -> list[Record]:
        """Return the records of experiments that failed."""
        return [record for record in self.evaluations.records if failed(record)]


def figure_slopes_at(problem: Problem, evaluations: Evaluations, values: Values) -> FloatArray:
    """Return derivatives of all figures by the coordinates, (measurements, n); not numbers where none is known."""
    pairs = difference_places(problem.scaled(values), problem.file.search.difference)
    found = evaluations.slopes(values, problem.everything, pairs)
    none: list[float | None] = [None] * len(values)
    rows = [found[place].get(one.figure, none) for one, place in zip(problem.measurements, problem.places, strict=True)]
    return np.array(rows, dtype=float)


def scales_of(problem: Problem) -> tuple[Scale, ...]:
    """Return the scale of each measurement, which makes it a residual."""
    return tuple(Scale(one, problem.file.search.residual) for one in problem.measurements)


ParameterSearchFloatArray = np.ndarray
Residuals = Callable[[ParameterSearchFloatArray], ParameterSearchFloatArray]
"""Function from places (k, n) to residuals (k, m)."""
Slopes = Callable[[ParameterSearchFloatArray], ParameterSearchFloatArray]
"""Function from a place (n,) to derivatives of the residuals there, (m, n), with columns of not numbers."""

STARTS = 4
"""Places that a search tries first, for each unknown and one more."""
APART = 0.05
"""Distance on the scales up to which a start leads to the same minimum as another start, or as an end."""


def search(
    residuals: Residuals, start: ParameterSearchFloatArray, settings: Search, slopes: Slopes | None = None,
    is_met: Callable[[float], bool] = lambda _: False,
) -> list[ParameterSearchFloatArray]:  # fmt: skip
    """Search from places that are spread evenly: least squares from the best, then from the next best, and so on.

    It ends where the measurements are met, where the least misfit was found a second time, or with the budget; what was
    found is what was evaluated.

    Args:
        residuals: Evaluates, and raises `BudgetSpentError` at the end of the budget.
        start: The first place, (n,).
        settings: Starts, budget, seed, step of differences.
        slopes: Derivatives, which least squares takes where they are numbers.
        is_met: Function that returns True for a sum of squares as small as can be known.

    Returns:
        Ends of least squares.
    """
    ends, seen, best = list[ParameterSearchFloatArray](), list[ParameterSearchFloatArray](), math.inf
    with suppress(BudgetSpentError):
        count = settings.starts or STARTS * (len(start) + 1)
        places = _starts(start, min(count, 1 + settings.budget // 2), settings.seed)
        costs = _costs(residuals(places))
        for number in np.argsort(costs, kind="stable"):
            if not isfinite(costs[number]):
                break
            if any(np.abs(places[number] - one).max() < APART for one in seen):
                continue
            z = polish(residuals, places[number], settings.difference, slopes)
            cost, before = float(_costs(residuals(z[None]))[0]), best
            again = any(np.abs(z - one).max() < settings.difference for one in ends)
            ends, seen, best = [*ends, z], [*seen, places[number], z], min(best, cost)
            if is_met(best) or (again and cost <= before * (1.0 + settings.difference)):
                break
    return ends


def polish(
    residuals: Residuals, start: ParameterSearchFloatArray, difference: float, slopes: Slopes | None = None
) -> ParameterSearchFloatArray:  # fmt: skip
    """Return the result of least squares from a place; its derivatives are known slopes, or central differences.

    With slopes it ends where a step is below the square of the difference, to which these are known. Where runs fail
    beside its end, it continues along the limit of these failures.
    """
    if not np.all(np.isfinite(residuals(start[None]))):
        return start
    z, box, failures = start, np.array([np.zeros(len(start)), np.ones(len(start))]), 0

    def one(z: ParameterSearchFloatArray) -> ParameterSearchFloatArray:
        nonlocal failures
        row = np.asarray(residuals(z[None])[0])
        failures += not np.all(np.isfinite(row))
        return row

    while True:
        before = failures
        found = least_squares(
            one, z, lambda z: jacobian(residuals, z, difference, slopes), bounds=tuple(box), ftol=1e-12,
            xtol=1e-8 if slopes is None else difference**2, gtol=1e-12,
        )  # fmt: skip
        z = np.asarray(found.x)
        if failures == before:
            return z
        beside = [np.isfinite(_costs(residuals(pair))) for pair in difference_places(z, difference)]
        closed = ~np.array(beside).T & (np.abs(box - z) > difference**2)
        narrow = np.where(closed, z, box)
        if not closed.any() or np.any(np.diff(narrow, axis=0) <= difference**2):
            return z
        box = narrow


def jacobian(
    residuals: Residuals, z: ParameterSearchFloatArray, difference: float, slopes: Slopes | None = None
) -> ParameterSearchFloatArray:  # fmt: skip
    """Return d residual / dz, (m, n): known slopes, else central differences.

    Differences are one-sided at a bound or next to a run that failed; a column of zeros stands where both sides failed.
    """
    known = None if slopes is None else slopes(z)
    return completed(known, residuals, z, difference_places(z, difference))


def completed(
    known: ParameterSearchFloatArray | None, values: Residuals, z: ParameterSearchFloatArray,
    places: list[ParameterSearchFloatArray],
) -> ParameterSearchFloatArray:  # fmt: skip
    """Return derivatives, (m, n), of values by z: columns that are known, and differences for all others.

    Args:
        known: (m, n), with not numbers where none is known; None: all.
        values: Function from places (k, n) to values (k, m).
        z: Place, (n,).
        places: As of `difference_places`.
    """
    left = [n for n in range(len(z)) if known is None or not np.all(np.isfinite(known[:, n]))]
    if known is not None and not left:
        return known
    found = values(np.concatenate([z[None], *(places[n] for n in left)]))
    columns = differences(z, {n: places[n] for n in left}, found)
    whole = np.empty((len(columns), len(z))) if known is None else known.copy()
    whole[:, left] = columns
    return whole


def difference_places(z: ParameterSearchFloatArray, difference: float) -> list[ParameterSearchFloatArray]:
    """Return the places below and above for each coordinate, within the bounds: n arrays (2, n)."""
    places = []
    for number in range(len(z)):
        pair = np.stack([z, z])
        pair[0, number] = max(z[number] - difference, 0.0)
        pair[1, number] = min(z[number] + difference, 1.0)
        places.append(pair)
    return places


def differences(
    z: ParameterSearchFloatArray, places: Mapping[int, ParameterSearchFloatArray], found: ParameterSearchFloatArray
) -> ParameterSearchFloatArray:
    """Return derivatives, (m, k), from values at z and then at k pairs of places, by coordinate, (1 + 2 k, m)."""
    columns = []
    for place, (number, pair) in enumerate(places.items()):
        below, above = found[1 + 2 * place], found[2 + 2 * place]
        low, high = pair[0, number], pair[1, number]
        if not np.all(np.isfinite(below)):
            below, low = found[0], z[number]
        if not np.all(np.isfinite(above)):
            above, high = found[0], z[number]
        columns.append((above - below) / (high - low) if high > low else np.zeros_like(found[0]))
    return np.stack(columns, axis=1)


def _starts(first: ParameterSearchFloatArray, count: int, seed: int) -> ParameterSearchFloatArray:
    """Return a start and others that are spread evenly, (count, n)."""
    if count == 1:
        return first[None]
    others = qmc.LatinHypercube(len(first), rng=np.random.default_rng(seed)).random(count - 1)
    return np.concatenate([first[None], others])


def _costs(residuals: ParameterSearchFloatArray) -> ParameterSearchFloatArray:
    """Return sums of squares, (k,); infinite where an experiment failed."""
    costs = np.sum(np.square(residuals), axis=1)
    return np.where(np.isfinite(costs), costs, np.inf)
