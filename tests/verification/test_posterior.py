"""Samples of values that fit a recording: against a closed form, their coverage, and where they are refused."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from scipy import stats

import gapbeam as gb
from gapbeam.studies.library.calibrated_regression import Regression, regression
from gapbeam.studies.library.posterior import Likelihood

A = np.array([[1.0, 0.6, 0.3, -0.8], [0.2, 1.0, -0.7, 0.5]]).T
SIGMA = 0.08


def drawn(count: int, seed: int, bent: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Return features z = A u + noise, (count, 4), and u, (count, 2); bent: of u_1^2, with noise growing with u_2."""
    draw = np.random.default_rng(seed)
    u = draw.random((count, 2))
    noise = SIGMA * draw.standard_normal((count, 4))
    if bent:
        return np.column_stack([(u[:, 0] - 0.3) ** 2, u[:, 1]]) @ A.T + noise * (0.2 + u[:, 1:]), u
    return u @ A.T + noise, u


def learned(members: int, bent: bool = False) -> Regression:
    """Return a regression on members, and on a quarter as many held out."""
    return regression(*drawn(members, 1, bent), *drawn(max(members // 4, 64), 2, bent))


@pytest.mark.slow(minutes=0.2)
def test_samples_of_a_linear_model_are_those_of_its_closed_form() -> None:
    """Prior uniform, noise normal: the posterior is N(u_ls, sigma^2 (A^T A)^-1) away from the ends of the ranges.

    The scatter is known from some 200 members: its standard deviation to 5 %, so to 15 % in all but 3 of 1000.
    """
    likelihood = Likelihood(learned(2000), 2)
    z = np.array([0.45, 0.55]) @ A.T + SIGMA * np.random.default_rng(5).standard_normal(4)
    exact = np.linalg.lstsq(A, z, rcond=None)[0]
    covariance = SIGMA**2 * np.linalg.inv(A.T @ A)
    s, _, _ = likelihood.regression(z[None])
    u, independent = likelihood.sampled(s[0], 4000, 0)
    assert u.shape == (4000, 2)
    assert independent > 500
    spread = np.sqrt(np.diag(covariance))
    assert np.all(np.abs(u.mean(axis=0) - exact) < 0.3 * spread)
    assert u.std(axis=0) == pytest.approx(spread, rel=0.15)
    correlation = covariance[0, 1] / np.prod(spread)
    assert np.corrcoef(u.T)[0, 1] == pytest.approx(correlation, abs=0.15)
    assert np.array_equal(u, likelihood.sampled(s[0], 4000, 0)[0])


@pytest.mark.slow(minutes=0.2)
@pytest.mark.parametrize("bent", [False, True])
def test_quantiles_cover_members_that_were_never_seen(bent: bool) -> None:
    """Places of true values in their distributions are uniform: 100 members, five levels, by a binomial of 1 in 1000.

    The bent model has two values of u_1 for some recordings, and errors that grow five-fold over the range of u_2. The
    density is summed over a grid; samples have its quantiles to six times their scatter:
    walkers change regions together.
    """
    likelihood = Likelihood(learned(1000, bent), 2)
    z, true = drawn(100, 9, bent)
    s, _, _ = likelihood.regression(z)
    axis = (np.arange(40) + 0.5) / 40
    grid = np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1).reshape(-1, 2)
    places, masses = [], []
    for one, u in zip(s, true, strict=True):
        density = likelihood(grid, one)
        mass = np.exp(density - density.max()).reshape(40, 40)
        sums = [np.concatenate([[0.0], np.cumsum(mass.sum(axis=1 - k)) / mass.sum()]) for k in range(2)]
        places.append([np.interp(u[k], np.linspace(0.0, 1.0, 41), sums[k]) for k in range(2)])
        masses.append(sums)
    for level in (0.1, 0.25, 0.5, 0.75, 0.9):
        below = (np.array(places) < level).sum(axis=0)
        low, high = stats.binom(100, level).ppf([5e-4, 1 - 5e-4])
        assert np.all((low <= below) & (below <= high)), (level, below)
    u, independent = likelihood.sampled(s[0], 4000, 0)
    for k in range(2):
        place = np.interp(np.quantile(u[:, k], [0.1, 0.5, 0.9]), np.linspace(0.0, 1.0, 41), masses[0][k])
        assert place == pytest.approx([0.1, 0.5, 0.9], abs=6.0 * 0.5 / np.sqrt(independent))


class NarrowAndWide(Likelihood):
    """A narrow normal density at 0.2, and a wide one at 0.9 whose peak is e^-30 of the first."""

    def __init__(self, count: int, width: float) -> None:
        for name, value in (("count", count), ("scale", 1.0), ("width", width)):
            object.__setattr__(self, name, value)

    def _gaussian(self, u: np.ndarray, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return s - u, np.broadcast_to(self.width**2 * np.eye(self.count), (len(u), self.count, self.count))

    def __call__(self, u: np.ndarray, s: np.ndarray) -> np.ndarray:  # noqa: ARG002
        """Return the logarithm of the density."""
        parts = [a - 0.5 * ((u - x) ** 2).sum(axis=1) / w**2 for a, x, w in ((0.0, 0.2, self.width), (-30, 0.9, 0.05))]
        return np.where(np.all((u >= 0.0) & (u <= 1.0), axis=1), np.logaddexp(*parts), -np.inf)


@pytest.mark.parametrize(("count", "width"), [(2, 0.003), (3, 0.0005), (4, 0.01)])
def test_samples_do_not_stay_where_they_began(count: int, width: float) -> None:
    """Samples of a narrow region have its width; walkers that began at the ends of the ranges stayed there."""
    s = np.full(count, 0.2 + width)
    u, _ = NarrowAndWide(count, width).sampled(s, 4000, 0)
    assert np.all(np.abs(u - 0.2) < 6.0 * width)
    assert u.std(axis=0) == pytest.approx(width, rel=0.15)


def test_what_has_no_likelihood_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Too few members for the number of values; emcee that is not installed."""
    with pytest.raises(gb.UserError, match="100 members are too few for samples of 2 values; expected 160"):
        Likelihood(learned(100), 2)
    likelihood = Likelihood(learned(200), 2)
    monkeypatch.setitem(sys.modules, "emcee", None)
    with pytest.raises(ImportError):
        likelihood.sampled(np.array([0.5, 0.5]), 10, 0)
