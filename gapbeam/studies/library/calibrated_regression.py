"""Regression of values on features, with intervals and a test of membership that members held out have calibrated."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from scipy.linalg import cho_factor, cho_solve, lapack
from scipy.spatial.distance import cdist

from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.messages.wording import counted
from gapbeam.solver.system.operators import Array

CONFIDENCE = 0.95
OUTSIDE = 0.01
"""Share of members, as far off as a recording, below which it is said to lie outside: a false alarm in 100."""
NEAR = 40
"""Members whose errors make up the local error."""
TUNED = 1500
"""Members on which width and smoothing are chosen."""
WIDTHS = (1.0, 3.0, 6.0)
SMOOTHING = (1e-5, 1e-4, 1e-3, 1e-2)


@dataclass(frozen=True, eq=False)
class Regression:
    """Kernel ridge regression with locally scaled conformal intervals.

    Features z are standardised. u(z) = mean + sum_i k(|z - z_i| / width) c_i with the Matern kernel
    k(r) = (1 + sqrt(3) r) exp(-sqrt(3) r) and (K + smoothing I) c = u - mean. Each member's error without itself is
    e_i = c_i / (K + smoothing I)^-1_ii; the local error s is the mean of |e_i| over the nearest members. The 95 %
    quantile of |error| / s of members held out makes the interval u +- quantile * s. Two figures make the test of
    membership: the distance to the nearest members, and the residual of features beside a local linear fit over the
    values, relative to the scatter there; of a recording as of each member without itself.

    Attributes:
        center: Of the features, (features,).
        spread: Of the features, (features,).
        members: Standardised features, (members, features).
        values: u of the members, (members, values).
        weights: c, (members, values).
        errors: |e_i|, (members, values).
        width: Of the kernel.
        quantile: By value, (values,).
        scores: Figures of members, (members + held, 2).
        held: Values of the members held out, and what was estimated for them, (2, held, values).

    Source: Vovk, Gammerman and Shafer (2005), Algorithmic Learning in a Random World, section 4.2 (conformal);
        Papadopoulos, Vovk and Gammerman (2011), Regression conformal prediction with nearest neighbours;
        Rasmussen and Williams (2006), Gaussian Processes for Machine Learning, section 5.4.2 (errors without a member).
    """

    center: Array
    spread: Array
    members: Array
    values: Array
    weights: Array
    errors: Array
    width: Array
    quantile: Array
    scores: Array
    held: Array

    def __call__(self, features: Array) -> tuple[Array, Array, Array]:
        """Return u, half widths of its interval, (recordings, values), and the rarity of the features, (recordings,).

        Rarity is the share of members that are as far off, at most 1: below `OUTSIDE`, a recording is outside.
        """
        u, half, score = self._estimated(features)
        further = np.array([(self.scores >= one).sum(axis=0) for one in score]) + 1
        rarity = np.minimum(1.0, score.shape[1] * further.min(axis=1) / (len(self.scores) + 1))
        return u, half * self.quantile, rarity

    def _estimated(self, features: Array) -> tuple[Array, Array, Array]:
        z = (features - self.center) / self.spread
        D = cdist(z, self.members)
        u = _kernel(D / self.width) @ self.weights + self.values.mean(axis=0)
        return self._scored(z, D, u)

    def _scored(self, z: Array, D: Array, u: Array) -> tuple[Array, Array, Array]:
        """Return u, local errors, and figures of membership, given the distances to the members."""
        near = np.argpartition(D, NEAR, axis=1)[:, :NEAR]
        local = self.errors[near].mean(axis=1)
        distance = np.take_along_axis(D, near, axis=1).mean(axis=1)
        residual = np.array([self._residual(*one) for one in zip(z, u, near, strict=True)])
        return u, local, np.column_stack([distance, residual])

    def _residual(self, z: Array, u: Array, near: Any) -> float:
        """Return the root mean square of features beside a linear fit over the values, relative to its scatter."""
        A = np.column_stack([np.ones(NEAR), self.values[near] - u])
        B = self.members[near]
        fit = np.linalg.lstsq(A, B, rcond=None)[0]
        scatter = np.sqrt(((B - A @ fit) ** 2).sum(axis=0) / (NEAR - A.shape[1]))
        return float(np.sqrt(np.mean((z - fit[0]) ** 2 / (scatter**2 + FLOOR**2))))

    def flat(self) -> dict[str, Array]:
        """Return all arrays by name: what a file keeps."""
        return {one.name: getattr(self, one.name) for one in fields(self)}


FLOOR = 0.02
"""Least scatter of a feature around its local fit, over its scatter in the whole library."""


def regression(features: Array, values: Array, held_features: Array, held: Array) -> Regression:
    """Return the regression of values on features.

    Args:
        features: (members, features).
        values: (members, values), of one size.
        held_features: Of the members held out, (held, features).
        held: Their values, (held, values).

    Raises:
        UserError: There are too few members.
    """
    if len(features) < 2 * NEAR or len(held) < NEAR:
        raise UserError(
            f"library: {counted(len(features), 'member')}, and {len(held)} held out, did not fail; expected "
            f"{2 * NEAR} and {NEAR}"
        )
    center, spread, u = features.mean(axis=0), features.std(axis=0), values
    spread = np.where(spread > 1e-9 * (1.0 + np.abs(center)), spread, 1.0)
    z = (features - center) / spread
    some = slice(None, None, -(-len(z) // TUNED))
    D = cdist(z[some], z[some])
    middle = float(np.median(D))
    trials = [(w * middle, s) for w in WIDTHS for s in SMOOTHING]
    costs = [np.log(np.abs(_fitted(D / w, s, u[some])[1]).mean(axis=0)).mean() for w, s in trials]
    width, smoothing = trials[int(np.argmin(costs))]
    weights, errors = _fitted(cdist(z, z) / width, smoothing, u)
    whole = Regression(
        center, spread, z, u, weights, np.abs(errors), np.array(width), np.ones(u.shape[1]), np.zeros((0, 2)),
        np.zeros((2, 0, u.shape[1])),
    )  # fmt: skip
    found, local, scores = whole._estimated(held_features)
    D = cdist(z, z)
    D[np.diag_indices_from(D)] = np.inf
    scores = np.vstack([scores, whole._scored(z, D, u - errors)[2]])
    off = np.sort(np.abs(found - held) / local, axis=0)
    rank = min(int(np.ceil((len(held) + 1) * CONFIDENCE)), len(held)) - 1
    parts = whole.flat() | {"quantile": off[rank], "scores": scores, "held": np.stack([held, found])}
    return Regression(**parts)


def _kernel(r: Array) -> Array:
    r = np.sqrt(3.0) * r
    found: Array = (1.0 + r) * np.exp(-r)
    return found


def _fitted(r: Array, smoothing: float, u: Array) -> tuple[Array, Array]:
    """Return weights, and errors of each member without itself."""
    K = _kernel(r)
    K[np.diag_indices_from(K)] += smoothing
    factor = cho_factor(K, lower=True, overwrite_a=True)
    weights = cho_solve(factor, u - u.mean(axis=0))
    inverse, _ = lapack.dpotri(factor[0], lower=1)
    return weights, weights / np.diag(inverse)[:, None]
