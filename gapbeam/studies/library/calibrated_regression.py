"""Regression of values on features; members held out correct it, and calibrate intervals and a test of membership."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
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

    Features z are standardised. u(z) = mean + sum_i k(|z - z_i| / width) c_i with the Matern kernel k(r) = (1 + sqrt(3)
    r) exp(-sqrt(3) r) and (K + smoothing I) c = u - mean. Each member's error without itself is e_i = c_i / (K +
    smoothing I)^-1_ii; the local error s is the mean of |e_i| over the nearest members. Members held out are marched in
    finer steps: u + (1, u) B removes what the step does to them, by least squares with the weights 1 / (s + median
    s)^2: a member that touches nothing has features without information. r is what remains of each without itself,
    residual / (1 - leverage). The 95 % quantile of |r| / (s + median |r|) makes the interval u +- quantile (s + median
    |r|). Two figures make the test of membership: the distance to the nearest members, and the residual of features
    beside a local linear fit over the values, relative to the scatter there; of a recording as of members held out, and
    of each other one without itself, times the ratio of both medians.

    Attributes:
        center: Center of the features, (features,).
        spread: Spread of the features, (features,).
        members: Standardised features, (members, features).
        values: u of the members, (members, values).
        weights: c, (members, values).
        errors: |e_i|, (members, values).
        width: Width of the kernel.
        correction: B, (1 + values, values).
        floor: Median of |r|, (values,).
        quantile: Quantile of each value, (values,).
        scores: Figures of members, (members + held, 2).
        held: Values of the members held out, and what the others give for them, (2, held, values).

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
    correction: Array
    floor: Array
    quantile: Array
    scores: Array
    held: Array

    def __call__(self, features: Array) -> tuple[Array, Array, Array]:
        """Return u, half widths of its interval, (recordings, values), and the rarity of the features, (recordings,).

        Rarity is the share of members that are as far off, at most 1: below `OUTSIDE`, a recording is outside.
        """
        u, local, score = self._estimated(features)
        further = np.array([(self.scores >= one).sum(axis=0) for one in score]) + 1
        rarity = np.minimum(1.0, score.shape[1] * further.min(axis=1) / (len(self.scores) + 1))
        return u + _affine(u) @ self.correction, (local + self.floor) * self.quantile, rarity

    def _estimated(self, features: Array) -> tuple[Array, Array, Array]:
        z = (features - self.center) / self.spread
        D = cdist(z, self.members)
        u = kernel(D / self.width) @ self.weights + self.values.mean(axis=0)
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
        """Return all arrays by name, as a file keeps them."""
        return {one.name: getattr(self, one.name) for one in fields(self)}


DISTINCT = 16
"""Fewest distinct values among members held out from which a value is corrected: up to 64 members share some."""
FLOOR = 0.02
"""Least scatter of a feature around its local fit, over its scatter in the whole library."""


def regression(features: Array, values: Array, held_features: Array, held: Array) -> Regression:
    """Return the regression of values on features.

    Args:
        features: (members, features).
        values: (members, values), of one size.
        held_features: Features of the members held out, in finer steps, (held, features).
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
    width, weights, errors = fitted(z, u)
    none = np.zeros(u.shape[1])
    whole = Regression(
        center, spread, z, u, weights, np.abs(errors), np.array(width), np.zeros((len(none) + 1, len(none))), none,
        none, np.zeros((0, 2)), np.zeros((2, 0, len(none))),
    )  # fmt: skip
    found, local, scores = whole._estimated(held_features)
    B, left = _corrected(found, held, local)
    floor = np.median(np.abs(left), axis=0)
    off = np.sort(np.abs(left) / (local + floor), axis=0)
    rank = min(int(np.ceil((len(held) + 1) * CONFIDENCE)), len(held)) - 1
    D = cdist(z, z)
    D[np.diag_indices_from(D)] = np.inf
    others = whole._scored(z, D, u - errors)[2]
    scores = np.vstack([scores, others * np.median(scores, axis=0) / np.median(others, axis=0)])
    return replace(
        whole, correction=B, floor=floor, quantile=off[rank], scores=scores, held=np.stack([held, held - left])
    )


def _corrected(found: Array, held: Array, local: Array) -> tuple[Array, Array]:
    """Return B, and what (1, found) B leaves of held - found: of each member without itself."""
    A, d = _affine(found), held - found
    B, left = np.zeros((A.shape[1], d.shape[1])), d.copy()
    for k, one in enumerate(held.T):
        if len(np.unique(one)) >= DISTINCT:
            w = 1.0 / (local[:, k] + np.median(local[:, k]))
            inverse = np.linalg.pinv(A * w[:, None]) * w
            B[:, k] = inverse @ d[:, k]
            left[:, k] = (d[:, k] - A @ B[:, k]) / (1.0 - np.einsum("ij,ji->i", A, inverse))
    return B, left


def fitted(z: Array, u: Array) -> tuple[float, Array, Array]:
    """Return the width of a kernel regression of u on z, its weights, and u - u(z) of members without themselves.

    Width and smoothing make these errors least, among every k-th member.
    """
    some = slice(None, None, -(-len(z) // TUNED))
    D = cdist(z[some], z[some])
    middle = float(np.median(D))
    trials = [(w * middle, s) for w in WIDTHS for s in SMOOTHING]
    costs = [np.log(np.abs(_fitted(D / w, s, u[some])[1]).mean(axis=0)).mean() for w, s in trials]
    width, smoothing = trials[int(np.argmin(costs))]
    return width, *_fitted(cdist(z, z) / width, smoothing, u)


def _affine(u: Array) -> Array:
    """Return (1, u)."""
    return np.column_stack([np.ones(len(u)), u])


def kernel(r: Array) -> Array:
    """Return the Matern kernel (1 + sqrt(3) r) exp(-sqrt(3) r)."""
    r = np.sqrt(3.0) * r
    found: Array = (1.0 + r) * np.exp(-r)
    return found


def _fitted(r: Array, smoothing: float, u: Array) -> tuple[Array, Array]:
    """Return weights, and errors of each member without itself."""
    K = kernel(r)
    K[np.diag_indices_from(K)] += smoothing
    factor = cho_factor(K, lower=True, overwrite_a=True)
    weights = cho_solve(factor, u - u.mean(axis=0))
    inverse, _ = lapack.dpotri(factor[0], lower=1)
    return weights, weights / np.diag(inverse)[:, None]
