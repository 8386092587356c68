"""Uncertain inputs: distributions with rank correlations, and points at which they are sampled."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy.stats import norm, qmc

from gapbeam.solver.errors import UserError
from gapbeam.solver.system.operators import Array

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
        distributions: By path.
        factor: L, (inputs, inputs).

    Source: Nelsen (2006), An Introduction to Copulas, section 5.1.2; Liu and Der Kiureghian (1986).
    """

    distributions: dict[str, Any]
    factor: Array

    @property
    def is_correlated(self) -> bool:
        """True where inputs depend on each other."""
        return not np.array_equal(self.factor, np.eye(len(self.factor)))

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
    if each < 2 or each * replicates != members:
        raise UserError(
            f"uncertain: found {members} members in {replicates} replicates; expected as many in each, 2 at least"
        )
    if sampling == "sobol" and each & (each - 1):
        near = replicates * 2 ** round(np.log2(each))
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
