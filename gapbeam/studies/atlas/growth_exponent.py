"""Growth of small differences: the largest Lyapunov exponent of members, from a second lane for each."""

from __future__ import annotations

import numpy as np

from gapbeam.solver.system.operators import Array
from gapbeam.studies.atlas.lane_shooting import StrobeMap

APART, BATCHES = 1e-7, 10


def growth(strobe: StrobeMap, points: Array, X: Array, periods: int) -> tuple[Array, Array, Array]:
    """Return exponents, 1/s, their standard errors from batches of periods, and the last states; NaN where one fails.

    The second lane starts 1e-7 of the motion away, and is brought back to that distance after each period.

    Args:
        strobe: The march by periods.
        points: Parameter point of each member.
        X: States, (2 n + states, members).
        periods: As many as ten batches.

    Source: Benettin et al. (1980), Meccanica 15, 9.
    """
    draw = np.random.default_rng(0).standard_normal(X.shape)
    size = strobe.size(X)
    away, D = draw * APART * size / strobe.size(draw), X.shape[1]
    rates = np.zeros((periods, D))
    for k in range(periods):
        Y = strobe.after(np.tile(points, 2), np.hstack([X, X + away]), 1)
        X, away = Y[:, :D], Y[:, D:] - Y[:, :D]
        grown = strobe.size(away) / (APART * size)
        rates[k] = np.log(np.maximum(grown, 1e-300)) / strobe.period[points]
        away = away / np.maximum(grown, 1e-300)
    late = rates[periods // 5 :]  # the difference has turned into the direction of the largest growth
    parts = np.array([part.mean(axis=0) for part in np.array_split(late, BATCHES)])
    return late.mean(axis=0), parts.std(axis=0, ddof=1) / np.sqrt(BATCHES), X
