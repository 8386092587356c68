"""End springs, and length, of a beam with given frequencies: a map of the misfit, and least squares from it.

    minimize  sum_n (ln f_n(k1, k2, l) - ln f_n,given)^2 / accuracy^2

over ln k1, ln k2 and, if asked for, ln l. The misfit is computed over a whole map of springs first, 1e-6 to 1e9 in
units of E I / l^3 and E I / l, so that no valley is overlooked; the best of each valley starts a least-squares search
with the slopes in closed form. Intervals come from the Jacobian there. They mean nothing on a plateau, where
frequencies no longer feel a spring: so each spring is also set to either end of the map, and all else fitted anew;
where that does as well, the frequencies determine a limit, or nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from math import exp, inf, log, sqrt

import numpy as np
from scipy.ndimage import minimum_filter
from scipy.optimize import brentq, least_squares
from scipy.stats import chi2, norm

from gapbeam.solver.system.operators import Array, Indices
from gapbeam.studies.modes.beam_theory import SpringBeam, roots

LOWEST, HIGHEST = 1.0e-6, 1.0e9  # of the map, in units of E I / l^3 and E I / l
PER_DECADE = 4
NO_ROOT = 1.0e-12  # a root of 0 has a misfit like this one
STARTS = 4  # valleys that are searched


@dataclass(frozen=True)
class Found:
    """End of a search.

    Attributes:
        x: Unknowns ln k1, ln k2 (and ln l), (unknowns,).
        cost: Half of the sum of squares.
        jacobian: Slopes of the residuals, (modes, unknowns).
    """

    x: Array
    cost: float
    jacobian: Array


@dataclass(frozen=True)
class SpringSearch:
    """A beam and the frequencies that it shall have.

    Attributes:
        beam: The beam; its length is an unknown where `lengths` says so.
        modes: Numbers n, (modes,).
        wanted: ln f_n, given, (modes,), f_n in Hz.
        lengths: Least and greatest length, m; None: the length of the beam.
    """

    beam: SpringBeam
    modes: Indices
    wanted: Array
    lengths: tuple[float, float] | None

    def beam_of(self, x: Array) -> SpringBeam:
        """Return the beam with the length among the unknowns."""
        return self.beam if self.lengths is None else replace(self.beam, length=exp(x[2]))

    def roots(self, x: Array) -> Array:
        """Return lambda_n, (modes,)."""
        return self.beam_of(x).roots(self.modes, *np.exp(x[:2]))

    def residuals(self, x: Array, found: Array) -> Array:
        """Return the residuals, (modes,), from the roots."""
        return np.asarray(2.0 * np.log(np.maximum(found, NO_ROOT)) + log(self.beam_of(x).frequency_unit) - self.wanted)

    def jacobian(self, x: Array, found: Array) -> Array:
        """Return their slopes, (modes, unknowns); d ln f / d ln l = 3 d ln f / d ln k1 + d ln f / d ln k2 - 2."""
        draught, torsion = np.exp(x[:2])
        slopes = self.beam_of(x).sensitivities(self.modes, draught, torsion, found)
        if self.lengths is None:
            return slopes
        return np.column_stack([slopes, slopes @ np.array([3.0, 1.0]) - 2.0])

    def bounds(self, beam: SpringBeam) -> tuple[Array, Array]:
        """Return ends of the unknowns."""
        units = np.log([beam.draught_unit, beam.torsion_unit])
        low, high = units + log(LOWEST), units + log(HIGHEST)
        if self.lengths is None:
            return low, high
        return np.append(low - 1.0, log(self.lengths[0])), np.append(high + 1.0, log(self.lengths[1]))

    def starts(self) -> list[Array]:
        """Return the unknowns at the bottom of the deepest valleys of the map."""
        lengths = [self.beam.length] if self.lengths is None else list(np.linspace(*self.lengths, 5))
        found = []
        draught, torsion, logarithms = _map(tuple(int(mode) for mode in self.modes))
        for length in lengths:
            beam = replace(self.beam, length=length)
            misfits = np.sum((logarithms + log(beam.frequency_unit) - self.wanted[:, None, None]) ** 2, axis=0)
            rows, columns = np.nonzero(misfits == minimum_filter(misfits, size=3, mode="nearest"))
            for row, column in zip(rows, columns, strict=True):
                x = [log(draught[row] * beam.draught_unit), log(torsion[column] * beam.torsion_unit)]
                found.append((misfits[row, column], np.array(x if self.lengths is None else [*x, log(length)])))
        found.sort(key=lambda each: float(each[0]))
        return [x for _, x in found[:STARTS]]

    def search(self, start: Array, held: int | None = None) -> Found:
        """Search from a start, with one unknown held where it is if asked for."""
        low, high = self.bounds(self.beam)
        free = np.arange(len(start)) != held
        width = 1e-9 * (high - low)

        def whole(part: Array) -> Array:
            x = start.copy()
            x[free] = part
            return x

        seen: dict[bytes, Array] = {}  # residuals and slopes are asked for at the same place

        def found(x: Array) -> Array:
            if x.tobytes() not in seen:
                seen[x.tobytes()] = self.roots(x)
            return seen[x.tobytes()]

        result = least_squares(
            lambda part: self.residuals(x := whole(part), found(x)),
            np.clip(start, low + width, high - width)[free],
            lambda part: self.jacobian(x := whole(part), found(x))[:, free],
            bounds=(low[free], high[free]),
            xtol=1e-12,
            ftol=1e-12,
            gtol=1e-14,
        )
        x = whole(result.x)
        return Found(x, float(result.cost), self.jacobian(x, found(x)))


@cache
def _map(modes: tuple[int, ...]) -> tuple[Array, Array, Array]:
    """Return s1 (r,), s2 (c,) and 2 ln lambda_n (modes, r, c)."""
    points = round(PER_DECADE * np.log10(HIGHEST / LOWEST)) + 1
    springs = np.logspace(np.log10(LOWEST), np.log10(HIGHEST), points)
    found = roots(np.array(modes)[:, None, None], springs[:, None], springs)
    return springs, springs, 2.0 * np.log(np.maximum(found, NO_ROOT))


CONFIDENCE = 0.95
ACCURACY = 0.01  # of a frequency
SAME = 0.02  # of ln k, below which two results are one
SPRINGS = ("k1", "k2")
LARGEST = 700.0  # of a logarithm of a number
UNFELT = 1.0e-9  # of the largest slope of all frequencies together
WITHIN = 0.01  # of ln k, of a limit


@dataclass(frozen=True)
class Estimate:
    """A value with its interval of confidence of 95 %.

    Attributes:
        value: The best.
        low: Lower end; 0 where the frequencies determine none.
        high: Upper end; infinite where the frequencies determine none.
        unit: Unit of all of them.
    """

    value: float
    low: float
    high: float
    unit: str

    @property
    def verdict(self) -> str:
        """Verdict of the frequencies on the spring: "identified", "at least", "at most" or "not identifiable"."""
        if self.low > 0.0 and np.isfinite(self.high):
            return "identified"
        if self.low > 0.0:
            return "at least"
        return "at most" if np.isfinite(self.high) else "not identifiable"


@dataclass(frozen=True)
class EndSpringFit:
    """A beam on springs that reproduces frequencies.

    Attributes:
        beam: Dimensions, with the fitted length if it was fitted.
        draught: k1, N/m.
        torsion: k2, N m/rad.
        length: l, m, where it was fitted; None: it was given.
        modes: Numbers n of the frequencies.
        given: The given frequencies, Hz.
        found: The frequencies of the fitted beam, Hz.
        accuracy: Expected standard deviation of ln f.
        deviation: Standard deviation of the intervals: the larger of `accuracy` and the scatter of the misfit.
        misfit: Root mean square of ln f_n - ln f_n,given.
        others: Springs (k1, k2) of other minima within the confidence.
    """

    beam: SpringBeam
    draught: Estimate
    torsion: Estimate
    length: Estimate | None
    modes: tuple[int, ...]
    given: Array
    found: Array
    accuracy: float
    deviation: float
    misfit: float
    others: tuple[tuple[float, float], ...]

    @property
    def springs(self) -> tuple[float, float]:
        """k1, N/m, and k2, N m/rad."""
        return self.draught.value, self.torsion.value

    @property
    def reproduces(self) -> bool:
        """True where the frequencies are met within twice their accuracy."""
        return self.misfit <= 2.0 * self.accuracy


def identify_end_springs(
    beam: SpringBeam,
    modes: Sequence[int],
    frequencies: Sequence[float],
    lengths: tuple[float, float] | None = None,
    accuracy: float = ACCURACY,
) -> EndSpringFit:
    """Return the springs, and the length, with which a beam reproduces frequencies.

    Args:
        beam: The beam; its length is fitted where `lengths` says so, and the start of that.
        modes: Numbers n of the frequencies, all different.
        frequencies: f_n > 0, Hz.
        lengths: Least and greatest length, m, to fit it between; None: the length of the beam.
        accuracy: Standard deviation of a frequency, relative. Where the misfit that remains says it is worse, the
            intervals stand on that instead.

    Raises:
        ValueError: Fewer frequencies than unknowns, modes that are not different, or frequencies not positive.
    """
    unknowns = 2 if lengths is None else 3
    if len(set(modes)) != len(frequencies) or len(modes) != len(frequencies):
        raise ValueError("each frequency needs a mode of its own")
    if not np.all(np.array(frequencies) > 0.0):
        raise ValueError("a frequency is not positive")
    if len(frequencies) < unknowns:
        raise ValueError(f"{len(frequencies)} frequencies cannot determine {unknowns} unknowns")
    problem = SpringSearch(beam, np.array(modes), np.log(np.array(frequencies, dtype=float)), lengths)
    results = sorted((problem.search(start) for start in problem.starts()), key=lambda result: result.cost)
    best, left = results[0], len(frequencies) - unknowns
    scatter = sqrt(2.0 * best.cost / left) if left > 0 else 0.0
    deviation = max(accuracy, scatter)
    allowed = 0.5 * deviation**2 * chi2.ppf(CONFIDENCE, 1)
    estimates = [_interval(problem, best, place, deviation, allowed) for place in range(unknowns)]
    others: list[Array] = []
    for result in results[1:]:
        apart = [np.abs(result.x[:2] - known).max() for known in (best.x[:2], *others)]
        if result.cost <= best.cost + allowed and min(apart) > SAME and not _on_plateau(estimates, result.x):
            others.append(result.x[:2])
    fitted = problem.beam_of(best.x)
    found = fitted.frequencies(problem.modes, *np.exp(best.x[:2]))
    return EndSpringFit(
        fitted,
        estimates[0],
        estimates[1],
        estimates[2] if lengths is not None else None,
        tuple(int(mode) for mode in modes),
        np.array(frequencies, dtype=float),
        found,
        accuracy,
        deviation,
        float(np.sqrt(np.mean(np.log(found / np.array(frequencies)) ** 2))),
        tuple((exp(x[0]), exp(x[1])) for x in others),
    )


def _interval(problem: SpringSearch, best: Found, place: int, deviation: float, allowed: float) -> Estimate:
    """Return the interval of one unknown: from the Jacobian, or a limit, or none where all do as well."""
    unit, value = ("N/m", "N m/rad", "m")[place], exp(best.x[place])
    ends = [end[place] for end in problem.bounds(problem.beam)]

    def excess(x: float) -> float:
        start = best.x.copy()
        start[place] = x
        return problem.search(start, held=place).cost - best.cost - allowed

    if place < len(SPRINGS):
        open_ends = [excess(end) <= 0.0 for end in ends]
        if any(open_ends):
            sides = [
                end if is_open else brentq(excess, *sorted((end, float(best.x[place]))), xtol=WITHIN, rtol=1e-6)
                for end, is_open in zip(ends, open_ends, strict=True)
            ]
            low, high = (0.0 if open_ends[0] else exp(sides[0])), (np.inf if open_ends[1] else exp(sides[1]))
            return Estimate(value, low, high, unit)
    half = norm.ppf(0.5 + 0.5 * CONFIDENCE) * deviation * _standard_error(best.jacobian, place)
    low, high = best.x[place] - half, best.x[place] + half
    if place >= len(SPRINGS):
        low, high = max(low, ends[0]), min(high, ends[1])
    return Estimate(value, exp(low), exp(high) if high < LARGEST else inf, unit)


def _standard_error(jacobian: Array, place: int) -> float:
    """Return the standard error of one unknown for residuals with deviation 1; infinite where nothing determines it."""
    _, values, right = np.linalg.svd(jacobian, full_matrices=False)
    felt = values > UNFELT * values[0]
    if np.any(np.abs(right[~felt, place]) > UNFELT):
        return inf
    return float(np.linalg.norm(right[felt, place] / values[felt]))


def _on_plateau(estimates: Sequence[Estimate], x: Array) -> bool:
    """Return whether a result lies in the interval of the best one, along a spring that frequencies do not feel."""
    return all(each.low <= exp(value) <= each.high for each, value in zip(estimates[:2], x[:2], strict=True))
