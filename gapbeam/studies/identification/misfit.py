"""From the figures of evaluations to residuals: what the search makes small."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gapbeam.studies.identification.evaluations import Evaluations, failed, mean
from gapbeam.studies.identification.experiment_trial import Record
from gapbeam.studies.identification.identification_problem import FloatArray, Problem, Values
from gapbeam.studies.identification.identification_tables import Measurement


class BudgetSpentError(Exception):
    """The search has tried as many sets of values as it may."""


@dataclass(frozen=True)
class Scale:
    """How a measurement becomes a residual.

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
        evaluations: What computes them.
        scales: Of all measurements.
        fitted: Numbers of those that take part.
        tried: Sets of values so far, each counted once.

    Args:
        problem: The identification.
        evaluations: What computes them.
        fitted: Numbers of the measurements that take part; by default those of the file.
        budget: Largest number of sets of values; by default that of the file.
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
            BudgetSpentError: They would be more sets of values than the budget allows; none of them was tried.
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

    def failures(self) -> list[Record]:
        """Return the records of experiments that failed."""
        return [record for record in self.evaluations.records if failed(record)]


def scales_of(problem: Problem) -> tuple[Scale, ...]:
    """Return how each measurement becomes a residual."""
    return tuple(Scale(one, problem.file.search.residual) for one in problem.measurements)
