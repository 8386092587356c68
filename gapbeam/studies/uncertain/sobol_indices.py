"""Sobol indices: shares of the variance of figures that inputs cause, alone and with others, with intervals."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm, qmc, sobol_indices

from gapbeam.solver.errors import UserError
from gapbeam.solver.system.operators import Array
from gapbeam.studies.uncertain.input_points import NEVER_ONE

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
        missing: Share of points without a figure: they are left out.
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
        seed: Of the points.

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
    inputs = len(y) - 2
    if kept.shape[1] < 4 or np.ptp(kept) == 0.0:  # nothing varies: there is no variance to share
        none, pair = np.full(inputs, np.nan), np.full((inputs, 2), np.nan)
        return Indices(none, pair, none, pair, none, none, missing)

    def found(part: Array) -> object:
        part = part - part.mean()
        return sobol_indices(
            func={"f_A": part[:1], "f_B": part[1:2], "f_AB": part[2:, None]}, n=part.shape[1],
            random_state=np.random.default_rng(seed),
        )  # fmt: skip

    whole_result, half = found(kept), found(kept[:, : kept.shape[1] // 2])
    ends = whole_result.bootstrap(confidence_level=0.95, n_resamples=RESAMPLES)  # type: ignore[attr-defined]

    def of(result: object, name: str) -> Array:
        return np.asarray(getattr(result, name), dtype=float).ravel()

    def interval(one: object) -> Array:
        ci = one.confidence_interval  # type: ignore[attr-defined]
        return np.column_stack([np.ravel(ci.low), np.ravel(ci.high)])

    return Indices(
        of(whole_result, "first_order"), interval(ends.first_order), of(whole_result, "total_order"),
        interval(ends.total_order), of(half, "first_order"), of(half, "total_order"), missing,
    )  # fmt: skip
