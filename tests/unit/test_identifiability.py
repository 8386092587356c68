"""Searches and statistics of identifications on functions with known answers: regression, combinations, failures."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from gapbeam.studies.identification.identifiability import (
    RESOLUTION,
    bound_of_misfit,
    combination_words,
    identifiability,
    spread_of,
)
from gapbeam.studies.identification.identification_tables import Search
from gapbeam.studies.identification.misfit import BudgetSpentError, jacobian, polish, search

X = np.array([0.1, 0.7, 1.1, 1.9, 2.2, 3.1, 3.3, 4.2])
Y = np.array([1.03, 1.42, 1.38, 2.13, 2.02, 2.71, 2.55, 3.21])
LOW, HIGH = np.array([-2.0, -1.0]), np.array([4.0, 2.0])  # bounds of intercept and slope


class Line:
    """Residuals of a straight line through (X, Y), of intercept and slope on a scale from 0 to 1."""

    def __init__(self, budget: int = 10**6) -> None:
        self.budget, self.tried = budget, 0

    def __call__(self, z: np.ndarray) -> np.ndarray:
        """Return Y - a - b X at places, (k, 8)."""
        self.tried += len(z)
        if self.tried > self.budget:
            raise BudgetSpentError
        a, b = (LOW + z * (HIGH - LOW)).T
        return np.asarray(Y - a[:, None] - b[:, None] * X)


def test_least_squares_is_linear_regression() -> None:
    """Values, standard errors and confidence intervals are those of scipy.stats.linregress, the profile the same."""
    line, exact = Line(), stats.linregress(X, Y)
    z = polish(line, np.array([0.9, 0.1]), 0.01)
    a, b = LOW + z * (HIGH - LOW)
    assert (a, b) == pytest.approx((exact.intercept, exact.slope), rel=1e-9)
    residuals = line(z[None])[0]
    spread = spread_of(residuals, 2, np.ones(8), given=False, confidence=0.95)
    known = identifiability(jacobian(line, z, 0.01), spread, ["a", "b"])
    half = stats.t.ppf(0.975, 6) * np.array([exact.intercept_stderr, exact.stderr])
    found = [finding.half_width for finding in known.findings] * (HIGH - LOW)
    assert found == pytest.approx(half, rel=1e-8)
    assert {finding.word for finding in known.findings} == {"identifiable"}
    mean = X.mean()
    assert known.correlation[0, 1] == pytest.approx(-mean / np.sqrt(np.mean(X**2)), rel=1e-8)
    # the other intercept free, the sum of squares reaches the bound just at the ends of the interval of the slope
    slope = exact.slope + half[1]
    at_end = float(np.sum((Y - Y.mean() - slope * (X - mean)) ** 2))
    assert at_end == pytest.approx(bound_of_misfit(float(residuals @ residuals), spread, 8, 2, 0.95), rel=1e-8)


def test_given_standard_errors_hold_where_the_misfit_agrees_and_grow_where_it_does_not() -> None:
    """Residuals of 0.5 sigma keep sigma and the normal quantile; of 3 sigma take the misfit and Student's t."""
    agrees = spread_of(np.full(6, 0.5), 2, np.full(6, 20.0), given=True, confidence=0.95)
    assert (agrees.deviation, agrees.quantile) == pytest.approx((1.0, 1.959964), rel=1e-6)
    differs = spread_of(np.full(6, 3.0), 2, np.full(6, 20.0), given=True, confidence=0.95)
    assert (differs.deviation, differs.quantile) == pytest.approx((3.0 * np.sqrt(1.5), 2.776445), rel=1e-6)
    assert "times the given standard errors" in differs.sentence
    exact = spread_of(np.zeros(6), 2, np.full(6, 1.0 / np.log(10.0)), given=False, confidence=0.95)
    assert exact.deviation == pytest.approx(RESOLUTION / np.log(10.0))


@pytest.mark.parametrize("count", [1, 2, 3, 8])
@pytest.mark.parametrize("far", [2.5, 4.0, 137.0])
def test_nothing_is_identified_far_off_the_measurements(count: int, far: float) -> None:
    """A misfit of many given standard errors is one of the model, with any number of figures for two unknowns."""
    freedom = max(count - 2, 1)
    residuals = np.full(count, far * np.sqrt(freedom / count))
    steep = 1.0e4 * np.random.default_rng(1).normal(size=(count, 2))
    spread = spread_of(residuals, 2, np.full(count, 20.0), given=True, confidence=0.95)
    known = identifiability(steep, spread, ["a", "b"])
    assert spread.contradicts == (far > 3.0)
    if far > 3.0:
        assert {finding.word for finding in known.findings} == {"not identifiable"}
        assert f"by {far:.3g} given standard errors" in known.findings[0].sentence
    elif count > 1:
        assert {finding.word for finding in known.findings} == {"identifiable"}


def test_what_a_run_cannot_tell_is_no_misfit() -> None:
    """Standard errors below a thousandth of a figure do not make figures of runs wrong."""
    spread = spread_of(np.full(6, 9.0), 2, np.full(6, 2.0e4), given=True, confidence=0.95)
    assert not spread.contradicts


def test_a_product_is_identifiable_only_as_a_product() -> None:
    """Three figures that are powers of p q: neither p nor q is known, p q is, and r is by a figure of its own."""
    powers = np.array([[1.0, 1.0, 0.0], [2.0, 2.0, 0.0], [0.5, 0.5, 0.0], [0.0, 0.0, 1.0]])
    spread = spread_of(np.full(4, 1e-3), 3, np.ones(4), given=False, confidence=0.95)
    known = identifiability(powers, spread, ["p", "q", "r"])
    assert [finding.word for finding in known.findings] == ["only in combination"] * 2 + ["identifiable"]
    assert known.findings[0].sentence == "identifiable only in combination with q"
    assert np.isinf(known.widths[-1])
    assert combination_words(known.combinations[-1], np.ones(3), ["p", "q", "r"]) in ("p^1 q^-1", "p^-1 q^1")
    assert known.findings[2].half_width == pytest.approx(spread.quantile * spread.deviation)


def test_one_figure_for_two_unknowns_reports_their_combination_only() -> None:
    """Fewer measurements than unknowns: an error of 5 % is assumed, and nothing but the combination is known."""
    spread = spread_of(np.zeros(1), 2, np.array([1.0]), given=False, confidence=0.95)
    known = identifiability(np.array([[3.0, -2.0]]), spread, ["amplitude", "damping"])
    assert "assumed" in spread.sentence
    assert [finding.sentence for finding in known.findings] == [
        "identifiable only in combination with damping",
        "identifiable only in combination with amplitude",
    ]


def test_what_no_figure_depends_on_is_not_identifiable() -> None:
    """A column of zeros, also beside a run that failed."""
    spread = spread_of(np.full(3, 1e-2), 2, np.ones(3), given=False, confidence=0.95)
    known = identifiability(np.array([[1.0, 0.0], [2.0, 0.0], [1.0, 0.0]]), spread, ["p", "q"])
    assert [finding.word for finding in known.findings] == ["identifiable", "not identifiable"]


def hills(z: np.ndarray) -> np.ndarray:
    """Return residuals whose squares add up to Rastrigin's function, least at (0.71, 0.33), many minima around it."""
    x = 10.24 * (z - np.array([0.71, 0.33]))
    return np.asarray(np.concatenate([x, np.sqrt(10.0 * (1.0 - np.cos(2.0 * np.pi * x)))], axis=1))


def test_a_search_from_many_starts_passes_over_hills() -> None:
    """Least squares stops in the next valley; from many starts it finds the deepest, the same for the same seed."""
    start = np.array([0.2, 0.85])
    local = polish(hills, start, 1e-4)
    assert float(np.sum(hills(local[None]) ** 2)) > 10.0
    settings = Search(starts=400, budget=2000, difference=1e-4, seed=3)
    ends = search(hills, start, settings, is_met=lambda cost: cost < 1e-6)
    assert ends[-1] == pytest.approx([0.71, 0.33], abs=0.01)
    np.testing.assert_array_equal(ends, search(hills, start, settings, is_met=lambda cost: cost < 1e-6))


def test_a_search_ends_where_the_least_misfit_is_found_twice() -> None:
    """A misfit that nothing meets, with one valley: two of twelve starts are polished; of two, the deeper is found."""

    def valley(z: np.ndarray) -> np.ndarray:
        return np.concatenate([z - 0.3, np.ones((len(z), 1))], axis=1)

    def two(z: np.ndarray) -> np.ndarray:
        x = z[:, :1]
        return np.concatenate([np.minimum(np.abs(x - 0.2) + 0.1, 4.0 * np.abs(x - 0.9)), z[:, 1:] - 0.5], axis=1)

    assert len(search(valley, np.array([0.9, 0.9]), Search())) == 2
    least = min(search(two, np.array([0.1, 0.1]), Search()), key=lambda z: float(np.sum(two(z[None]) ** 2)))
    assert least == pytest.approx([0.9, 0.5], abs=1e-3)


def test_failures_are_never_taken_for_results() -> None:
    """Where everything beyond a line fails, the least on this side is found, and least squares stays on it."""

    def half(z: np.ndarray) -> np.ndarray:
        values = z - np.array([0.6, 0.4])
        return np.where(z[:, :1] > 0.5, np.nan, values)

    start = np.array([0.1, 0.9])
    beside = half(polish(half, start, 0.01)[None])[0]
    assert float(beside @ beside) < 0.1 * float(np.sum(half(start[None]) ** 2))
    ends = search(half, np.array([0.9, 0.9]), Search())
    found = min(ends, key=lambda z: float(np.sum(half(z[None]) ** 2)))
    assert found == pytest.approx([0.5, 0.4], abs=1e-3)
    assert found[0] <= 0.5
    slopes = jacobian(half, np.array([0.495, 0.2]), 0.01)
    np.testing.assert_allclose(slopes, np.eye(2), atol=1e-12)


@pytest.mark.parametrize("starts", [None, 1, 100])
@pytest.mark.parametrize("budget", [1, 7, 60])
def test_the_budget_is_kept(starts: int | None, budget: int) -> None:
    """No search tries more places than it may, and none needs a budget that is large enough for it."""
    line = Line(budget)
    asked = 0

    def counted(z: np.ndarray) -> np.ndarray:
        nonlocal asked
        found = line(z)
        asked += len(z)
        return found

    search(counted, np.array([0.5, 0.5]), Search(starts=starts, budget=budget))
    assert 0 < asked <= budget
