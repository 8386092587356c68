"""The search for the unknowns: differential evolution, least squares with finite differences, from several starts.

All coordinates run from 0 to 1, from the lower to the upper bound of an unknown on its scale. Residuals that are not
numbers, of runs that failed, are worse than all others and are never averaged into anything.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from math import isfinite

import numpy as np
from scipy.optimize import differential_evolution, least_squares
from scipy.stats import qmc

from gapbeam.studies.identification.identification_tables import Search
from gapbeam.studies.identification.misfit import BudgetSpentError

FloatArray = np.ndarray
Residuals = Callable[[FloatArray], FloatArray]
"""From places (k, n) to residuals (k, m)."""

SMALLEST_POPULATION, INDIVIDUALS = 16, 8  # of an unknown
POLISH_STEPS = 8  # Gauss-Newton steps that are put aside for the end of a global search
SPREAD = 1e-3  # of the misfits of a population that has converged, relative to their mean


def search(residuals: Residuals, start: FloatArray, settings: Search, budget: int) -> None:
    """Search from a start until it converges or the budget is spent; what was found is what was evaluated.

    Args:
        residuals: Evaluates, and raises `BudgetSpentError` at the end of the budget.
        start: Where to start, (n,).
        settings: Method, seed, starts, step of differences.
        budget: Places that may be evaluated.
    """
    with suppress(BudgetSpentError):
        if settings.method == "global":
            found = evolve(residuals, start, budget, settings.seed)
            polish(residuals, found, settings.difference)
            return
        places = _starts(start, min(settings.starts, budget), settings.seed)
        costs = _costs(residuals(places))
        for number in np.argsort(costs, kind="stable"):
            if isfinite(costs[number]):
                polish(residuals, places[number], settings.difference)


def evolve(residuals: Residuals, start: FloatArray, budget: int, seed: int) -> FloatArray:
    """Return the best place that differential evolution finds, generation by generation evaluated side by side.

    Source: Storn and Price (1997), as implemented by `scipy.optimize.differential_evolution`.
    """
    size = len(start)
    put_aside = min(POLISH_STEPS * (2 * size + 2), budget // 4)
    population = min(max(SMALLEST_POPULATION, INDIVIDUALS * size), max(5, (budget - put_aside) // 5))
    generations = (budget - put_aside) // population - 1
    if generations < 1:
        return start
    first = _starts(start, population, seed)
    found = differential_evolution(
        lambda places: _costs(residuals(np.asarray(places).T.reshape(-1, size))),
        [(0.0, 1.0)] * size,
        maxiter=generations,
        init=first,
        tol=SPREAD,
        rng=np.random.default_rng(seed),
        polish=False,
        updating="deferred",
        vectorized=True,
    )
    return np.asarray(found.x)


def polish(residuals: Residuals, start: FloatArray, difference: float) -> FloatArray:
    """Return where least squares leads from a place; its derivatives are central differences."""
    first = residuals(start[None])[0]
    if not np.all(np.isfinite(first)):
        return start
    found = least_squares(
        lambda z: residuals(z[None])[0],
        start,
        lambda z: jacobian(residuals, z, difference),
        bounds=(0.0, 1.0),
        ftol=1e-12,
        xtol=1e-8,
        gtol=1e-12,
    )
    return np.asarray(found.x)


def jacobian(residuals: Residuals, z: FloatArray, difference: float) -> FloatArray:
    """Return d residual / dz, (m, n), by central differences; one-sided at a bound or beside a run that failed.

    A column of zeros stands where both sides failed.
    """
    places = difference_places(z, difference)
    found = residuals(np.concatenate([z[None], *places]))
    return differences(z, places, found)


def difference_places(z: FloatArray, difference: float) -> list[FloatArray]:
    """Return the places below and above for each coordinate, within the bounds: n arrays (2, n)."""
    places = []
    for number in range(len(z)):
        pair = np.stack([z, z])
        pair[0, number] = max(z[number] - difference, 0.0)
        pair[1, number] = min(z[number] + difference, 1.0)
        places.append(pair)
    return places


def differences(z: FloatArray, places: list[FloatArray], found: FloatArray) -> FloatArray:
    """Return the derivatives, (m, n), from values at z and then at its pairs of places, (1 + 2 n, m)."""
    columns = []
    for number, pair in enumerate(places):
        below, above = found[1 + 2 * number], found[2 + 2 * number]
        low, high = pair[0, number], pair[1, number]
        if not np.all(np.isfinite(below)):
            below, low = found[0], z[number]
        if not np.all(np.isfinite(above)):
            above, high = found[0], z[number]
        columns.append((above - below) / (high - low) if high > low else np.zeros_like(found[0]))
    return np.stack(columns, axis=1)


def _starts(first: FloatArray, count: int, seed: int) -> FloatArray:
    """Return a start and others that are spread evenly, (count, n)."""
    if count == 1:
        return first[None]
    others = qmc.LatinHypercube(len(first), rng=np.random.default_rng(seed)).random(count - 1)
    return np.concatenate([first[None], others])


def _costs(residuals: FloatArray) -> FloatArray:
    """Return sums of squares, (k,); infinite where an experiment failed."""
    costs = np.sum(np.square(residuals), axis=1)
    return np.where(np.isfinite(costs), costs, np.inf)
