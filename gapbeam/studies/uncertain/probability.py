"""Uncertain inputs and their effects: points, probabilities and means with 95 % intervals, and Sobol indices.

Intervals come from random points, or from the scatter of randomised replicates. Subset simulation finds probabilities
too small for plain sampling, level by level. Sobol indices are shares of the variance of figures that inputs cause,
alone and with others.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy.stats import binomtest, norm, qmc, sobol_indices, t

from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.system.operators import Array

FEW = 10
"""Members inside, or outside, below which the scatter of replicates does not have the shape that its interval needs."""
UP = 0.975


@dataclass(frozen=True)
class IntervalEstimate:
    """A number with its interval.

    Attributes:
        value: The estimate.
        low: Lower end of the 95 % interval.
        high: Upper end.
        count: Members that the event has; for a mean, members that it is taken over.
        unknown: Share of members for which it is not known: their motion failed or did not settle. The interval of a
            probability holds whatever they would have been.
    """

    value: float
    low: float
    high: float
    count: int
    unknown: float = 0.0


def probability(event: Any, known: Any, independent: bool) -> IntervalEstimate:
    """Return the probability of an event.

    Independent members: the interval of Wilson. Replicates of randomised points: Student's t of their means, where
    ten members or more have the event and ten have not; else the interval of Wilson, which is wider for such points.
    Replicates hold whole members, so that few of them agree by chance: a scatter of half a member is the least.

    Args:
        event: Whether it happened, (replicates, members).
        known: Whether that is known, (replicates, members).
        independent: Whether members are drawn independently of each other.

    Source: Wilson (1927); Owen (2013), Monte Carlo Theory, section 17.
    """
    yes, maybe = event & known, event | ~known
    low, high = _ends(yes, independent)[0], _ends(maybe, independent)[1]
    count, every = int(yes.sum()), int(known.sum())
    return IntervalEstimate(count / every if every else float("nan"), low, high, count, 1.0 - every / known.size)


def _ends(event: Any, independent: bool) -> tuple[float, float]:
    count, size = int(event.sum()), event.size
    if independent or min(count, size - count) < FEW:
        ends = binomtest(count, size).proportion_ci(method="wilson")
        return float(ends.low), float(ends.high)
    mean, half = mean_and_half_width(event.mean(axis=1))
    replicates, members = event.shape
    half = max(half, float(t.ppf(UP, replicates - 1)) * 0.5 / (members * np.sqrt(replicates)))
    return max(mean - half, 0.0), min(mean + half, 1.0)


def mean_and_half_width(means: Array) -> tuple[float, float]:
    """Return the mean of independent numbers, and the half width of its 95 % interval."""
    spread = float(np.std(means, ddof=1)) / np.sqrt(len(means)) if len(means) > 1 else float("nan")
    return float(np.mean(means)), float(t.ppf(UP, len(means) - 1)) * spread if len(means) > 1 else spread


def mean_of(values: Array, inside: Any, independent: bool) -> IntervalEstimate:
    """Return the mean of a figure over the members inside.

    Independent members: Student's t of these. Replicates: Student's t of the residuals of a ratio, of the sum inside
    to the number inside.

    Args:
        values: (replicates, members); others than inside do not count.
        inside: Whether each member is inside, (replicates, members).
        independent: As in `probability`.

    Source: Cochran (1977), Sampling Techniques, section 2.11 (ratio).
    """
    count = int(inside.sum())
    if not count:
        return IntervalEstimate(float("nan"), float("nan"), float("nan"), 0)
    if independent:
        mean, half = mean_and_half_width(values[inside])
        return IntervalEstimate(mean, mean - half, mean + half, count)
    sums, counts = np.where(inside, values, 0.0).sum(axis=1), inside.sum(axis=1)
    mean = float(sums.sum() / count)
    _, half = mean_and_half_width((sums - mean * counts) / counts.mean())
    return IntervalEstimate(mean, mean - half, mean + half, count)


PART, WANTED, SPREAD, MOST_LEVELS = 0.1, 0.44, 0.6, 20
"""Share kept at a level; acceptance aimed at; first spread of proposals; levels after which a replicate gives up."""


@dataclass(frozen=True, eq=False)
class RareProbability:
    """Probability that a figure exceeds a limit, by subset simulation.

    Attributes:
        value: The estimate, the mean over replicates.
        low: Lower end of the 95 % interval.
        high: Upper end.
        replicates: Estimates of the replicates.
        thresholds: Thresholds of each level, the mean over replicates that came to it.
        members: Evaluations.
        failed: Share of evaluations without a figure: they count as below the limit.
        complete: Whether each replicate came to the limit.
    """

    value: float
    low: float
    high: float
    replicates: Array
    thresholds: Array
    members: int
    failed: float
    complete: bool


def subset_simulation(
    figure: Callable[[Array], Array], inputs: int, limit: float, members: int = 500, replicates: int = 20, seed: int = 0
) -> RareProbability:  # fmt: skip
    """Return the probability that a figure exceeds a limit.

    Each replicate samples the standard normal space, keeps the largest tenth, and continues from there by Markov
    chains conditional on that threshold; the probability is the product of the shares kept. The interval is
    by Student's t for the mean over replicates, on the logarithmic scale.

    Args:
        figure: Values (points,) at standard normal points, (points, inputs); NaN where there is none.
        inputs: Their number.
        limit: Limit of the figure.
        members: Members of a level, in each replicate.
        replicates: Independent of each other; they march side by side.
        seed: Seed of the draws.

    Source: Au and Beck (2001), Prob. Eng. Mech. 16, 263; Papaioannou et al. (2015), Prob. Eng. Mech. 41, 89
    (conditional sampling with adaptive spread).
    """
    draw = np.random.default_rng(seed)
    counts = {"asked": 0, "failed": 0}

    def asked(points: Array) -> Array:
        y = figure(points.reshape(-1, inputs))
        counts["asked"] += y.size
        counts["failed"] += int(np.isnan(y).sum())
        return np.where(np.isnan(y), -np.inf, y).reshape(points.shape[:-1])

    U = draw.standard_normal((replicates, members, inputs))
    Y = asked(U)
    product: Array = np.ones(replicates)
    open_ = np.ones(replicates, dtype=bool)
    spread, found = np.full(replicates, SPREAD), np.zeros(replicates)
    levels: list[float] = []
    kept = max(round(PART * members), 1)
    for _ in range(MOST_LEVELS):
        over = (limit < Y).mean(axis=1)
        done = open_ & (over >= PART)
        found[done] = product[done] * over[done]
        open_ &= ~done
        threshold = np.sort(Y, axis=1)[:, members - kept - 1]
        share = (threshold[:, None] < Y).mean(axis=1)  # less than a tenth where several are equal
        last = open_ & ((share == 0.0) | ~np.isfinite(threshold))
        found[last] = product[last] * over[last]
        stuck = last & (over == 0.0)
        open_ &= ~last
        if not open_.any():
            return _result(found, levels, counts, complete=not stuck.any())
        levels.append(float(threshold[open_].mean()))
        product = np.where(open_, product * share, product)
        U[open_], Y[open_], spread[open_] = _conditional(
            U[open_], Y[open_], threshold[open_], spread[open_], kept, asked, draw
        )
    return _result(found, levels, counts, complete=False)


def _conditional(
    U: Array, Y: Array, threshold: Array, spread: Array, kept: int, asked: Callable[[Array], Array],
    draw: np.random.Generator,
) -> tuple[Array, Array, Array]:  # fmt: skip
    """Return as many members above the threshold, by chains from those that are: (replicates, members, inputs)."""
    R, members, d = U.shape
    order = np.argsort(-Y, axis=1)
    above = (threshold[:, None] < Y).sum(axis=1)
    seeds = np.array([np.resize(draw.permutation(one[:many]), kept) for one, many in zip(order, above, strict=True)])
    rows = np.arange(R)[:, None]
    u, y = U[rows, seeds], Y[rows, seeds]
    chain, heights = [u], [y]
    scale = U.std(axis=1, keepdims=True)
    for number in range(1, -(-members // kept)):
        step = np.minimum(spread[:, None, None] * scale, 1.0)
        moved = np.sqrt(1.0 - step**2) * u + step * draw.standard_normal((R, kept, d))
        tried = asked(moved)
        accepted = tried > threshold[:, None]
        u, y = np.where(accepted[..., None], moved, u), np.where(accepted, tried, y)
        spread = spread * np.exp((accepted.mean(axis=1) - WANTED) / np.sqrt(number))
        chain.append(u)
        heights.append(y)
    return np.concatenate(chain, axis=1)[:, :members], np.concatenate(heights, axis=1)[:, :members], spread


def _result(found: Array, levels: list[float], counts: dict[str, int], complete: bool) -> RareProbability:
    mean, half = mean_and_half_width(found)
    wide = np.exp(half / mean) if mean > 0.0 else np.inf
    return RareProbability(
        mean, mean / wide if mean > 0.0 else 0.0, min(mean * wide, 1.0) if mean > 0.0 else float("nan"), found,
        np.array(levels), counts["asked"], counts["failed"] / counts["asked"], complete,
    )  # fmt: skip


Sampling = Literal["sobol", "latin", "random"]
Pairs = Mapping[tuple[str, str], float]
EXAMPLE = "a distribution of scipy.stats with its parameters, such as scipy.stats.norm(1e-4, 1e-5)"
NEVER_ONE = 2.0**-53
"""Least distance of a uniform number from 0 and 1: a distribution without ends stays finite."""


@dataclass(frozen=True, eq=False)
class Inputs:
    """Distributions of values by path, joined by a Gaussian copula.

    A standard normal vector y becomes values x_i = F_i^-1(Phi((L y)_i)), where L L^T is the correlation of the copula.
    A rank correlation r (Spearman) needs the correlation 2 sin(pi r / 6).

    Attributes:
        distributions: Distributions by path.
        factor: L, (inputs, inputs).

    Source: Nelsen (2006), An Introduction to Copulas, section 5.1.2; Liu and Der Kiureghian (1986).
    """

    distributions: dict[str, Any]
    factor: Array

    def values(self, normal: Array) -> dict[str, Array]:
        """Return values by path, (points,), from standard normal vectors, (points, inputs)."""
        y, found = normal @ self.factor.T, {}
        for i, (path, one) in enumerate(self.distributions.items()):
            low = y[:, i] < 0.0  # each tail from its own end: digits are kept far out
            x = np.where(low, one.ppf(norm.cdf(np.minimum(y[:, i], 0.0))), one.isf(norm.sf(np.maximum(y[:, i], 0.0))))
            found[path] = np.asarray(x, dtype=float)
        return found


def inputs_of(distributions: Mapping[str, Any], correlation: Pairs | None = None) -> Inputs:
    """Return inputs after checking them.

    Args:
        distributions: Frozen distributions of scipy.stats by path.
        correlation: Rank correlations (Spearman) by pairs of paths; other pairs are independent.

    Raises:
        UserError: Something is no distribution, a pair is unknown, or the correlations contradict each other.
    """
    if not distributions:
        raise UserError("uncertain: expected one distribution or more, by path")
    for path, one in distributions.items():
        if not all(callable(getattr(one, name, None)) for name in ("ppf", "isf")) or not hasattr(one, "dist"):
            raise UserError(f"uncertain: {path}: found {one!r}, expected {EXAMPLE}")
        if not np.all(np.isfinite([*one.ppf([0.01, 0.5]), *one.isf([0.01])])):
            raise UserError(
                f"uncertain: {path}: {one.dist.name}{(*one.args, *one.kwds.items())} has no finite quantiles; "
                "look at its parameters"
            )
    paths, R = list(distributions), np.eye(len(distributions))
    for pair, rank in (correlation or {}).items():
        if not (isinstance(pair, tuple) and len(pair) == 2 and pair[0] != pair[1] and set(pair) <= set(paths)):
            raise UserError(f"uncertain: correlation of {pair!r}: expected a pair of {', '.join(paths)}")
        if not (np.isscalar(rank) and np.isreal(rank) and -1.0 < float(rank) < 1.0):
            raise UserError(f"uncertain: correlation of {pair!r}: found {rank!r}, expected a number between -1 and 1")
        i, j = map(paths.index, pair)
        twice = R[i, j] != 0.0
        R[i, j] = R[j, i] = 2.0 * np.sin(np.pi / 6.0 * float(rank))
        if twice:
            raise UserError(f"uncertain: correlation of {pair!r} is given twice")
    try:
        factor: Array = np.asarray(np.linalg.cholesky(R), dtype=float)
    except np.linalg.LinAlgError:
        raise UserError(
            "uncertain: the correlations contradict each other (their matrix has an eigenvalue of "
            f"{np.linalg.eigvalsh(R).min():.3g}); make them smaller"
        ) from None
    return Inputs(dict(distributions), factor)


def normal_points(sampling: Sampling, members: int, replicates: int, inputs: int, seed: int) -> Array:
    """Return standard normal points, (replicates, members / replicates, inputs).

    Each replicate of "sobol" and "latin" is randomised on its own, so that their scatter gives the error.

    Raises:
        UserError: Numbers do not fit.
    """
    if sampling not in ("sobol", "latin", "random"):
        raise UserError(f'uncertain: sampling: found {sampling!r}, expected "sobol", "latin" or "random"')
    if replicates < 2:
        raise UserError(f"uncertain: found {replicates} replicates, expected 2 or more: their scatter gives the error")
    each = members // replicates
    near = replicates * 2 ** max(round(np.log2(max(members / replicates, 1.0))), 1)
    if each < 2 or each * replicates != members:
        raise UserError(
            f"uncertain: found {members} members in {replicates} replicates; expected as many in each, 2 at least; "
            f"take {near if sampling == 'sobol' else replicates * max(each, 2)} members"
        )
    if sampling == "sobol" and each & (each - 1):
        raise UserError(
            f"uncertain: found {each} members in each of {replicates} replicates, expected a power of two for Sobol "
            f'points; take {near} members, or sampling "latin"'
        )
    draws = [np.random.default_rng([seed, k]) for k in range(replicates)]
    if sampling == "random":
        u = np.array([draw.random((each, inputs)) for draw in draws])
    elif sampling == "latin":
        u = np.array([qmc.LatinHypercube(inputs, seed=draw).random(each) for draw in draws])
    else:
        u = np.array([qmc.Sobol(inputs, seed=draw).random(each) for draw in draws])
    return np.asarray(norm.ppf(np.clip(u, NEVER_ONE, 1.0 - NEVER_ONE)))


RESAMPLES = 999


@dataclass(frozen=True, eq=False)
class Indices:
    """Sobol indices of one figure, by input.

    Attributes:
        first: Share of the variance that goes if the input is known, (inputs,).
        first_interval: 95 %, (inputs, 2).
        total: Share that remains if all others are known, (inputs,).
        total_interval: 95 %, (inputs, 2).
        half_first: First indices from half of the points: how far the numbers still move.
        half_total: Total indices from half of the points.
        missing: Share of points without a figure: they are left out, and so are the last ones beyond a power of two.
    """

    first: Array
    first_interval: Array
    total: Array
    total_interval: Array
    half_first: Array
    half_total: Array
    missing: float


def indices_of(figures: Callable[[Array], dict[str, Array]], inputs: int, points: int, seed: int) -> dict[str, Indices]:
    """Return Sobol indices of all figures, from points (inputs + 2) evaluations.

    Args:
        figures: Values by name, (points,), at standard normal points, (points, inputs), which are independent.
        inputs: Their number.
        points: A power of two.
        seed: Seed of the points.

    Raises:
        UserError: The number of points is no power of two, or is too small.

    Source: Saltelli et al. (2010), Comput. Phys. Commun. 181, 259; bootstrap intervals as of scipy.stats.sobol_indices.
    """
    if points < 16 or points & (points - 1):
        raise UserError(
            f"uncertain: found {points} points for Sobol indices, expected a power of two from 16 on, such as 1024"
        )
    u = qmc.Sobol(2 * inputs, seed=np.random.default_rng(seed)).random(points)
    both = np.asarray(norm.ppf(np.clip(u, NEVER_ONE, 1.0 - NEVER_ONE)))
    A, B = both[:, :inputs], both[:, inputs:]
    crossed = np.repeat(A[None], inputs, axis=0)
    crossed[np.arange(inputs), :, np.arange(inputs)] = B.T
    answers = figures(np.concatenate([A[None], B[None], crossed]).reshape(-1, inputs))
    return {name: _indices(y.reshape(inputs + 2, points), seed) for name, y in answers.items()}


def _indices(y: Array, seed: int) -> Indices:
    whole = np.isfinite(y).all(axis=0)
    missing, kept = 1.0 - float(whole.mean()), y[:, whole]
    kept, inputs = kept[:, : 1 << max(kept.shape[1].bit_length() - 1, 0)], len(y) - 2  # a power of two
    if kept.shape[1] < 4 or np.ptp(kept) == 0.0:  # nothing varies: there is no variance to share
        none, pair = np.full(inputs, np.nan), np.full((inputs, 2), np.nan)
        return Indices(none, pair, none, pair, none, none, missing)

    def found(part: Array) -> object:
        A, B, *AB = np.repeat((part - part.mean())[:, None], 2, axis=1)  # twice: SciPy takes no single index
        return sobol_indices(
            func={"f_A": A, "f_B": B, "f_AB": np.array(AB)}, n=part.shape[1], random_state=np.random.default_rng(seed)
        )

    whole_result, half = found(kept), found(kept[:, : kept.shape[1] // 2])
    ends = whole_result.bootstrap(confidence_level=0.95, n_resamples=RESAMPLES)  # type: ignore[attr-defined]

    def of(result: object, name: str) -> Array:
        return np.asarray(getattr(result, name), dtype=float).ravel()[:inputs]

    def interval(one: object) -> Array:
        ci = one.confidence_interval  # type: ignore[attr-defined]
        return np.column_stack([np.ravel(end)[:inputs] for end in (ci.low, ci.high)])

    return Indices(
        of(whole_result, "first_order"), interval(ends.first_order), of(whole_result, "total_order"),
        interval(ends.total_order), of(half, "first_order"), of(half, "total_order"), missing,
    )  # fmt: skip
