"""Shooting of many orbits at once: Newton's method on the maps over their periods, all members of one ensemble."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from gapbeam.solver.scene.lane_ensemble import ensemble
from gapbeam.solver.scene.linear_scheme import RESOLVED, LinearScheme
from gapbeam.solver.scene.scene import Scene, SceneState
from gapbeam.solver.system.operators import Array

CONVERGED, SHIFT, PASSES = 1e-10, 1e-6, 12


@dataclass(frozen=True, eq=False)
class StrobeMap:
    """The motion of a scene from one period to the next, for members with values of their own.

    Attributes:
        scene: The scene.
        values: By path, (parameter points,).
        period: (parameter points,), s.
        steps: In a period.
        scheme: Of the time integration.
        t: Time of all starts, s.
        floor: Energy norm below which a motion is rest.
        threads: As of `ensemble`.
    """

    scene: Scene
    values: dict[str, Array]
    period: Array
    steps: int
    scheme: LinearScheme
    t: float
    floor: float = 0.0
    threads: int | None = None

    def march(self, points: Any, X: Array, periods: int, **features: Any) -> Any:
        """March states X (2 n + states, members) at these parameter points over some periods."""
        n, T = self.scene.size, self.period[points]
        start = SceneState(self.t, X[:n], X[n : 2 * n], X[2 * n :], np.zeros((self.scene.motions, X.shape[1])))
        return ensemble(
            self.scene, {path: value[points] for path, value in self.values.items()}, step=T / self.steps,
            end=self.t + periods * T, start=start, members=X.shape[1], threads=self.threads, scheme=self.scheme,
            period=T, **features,
        )  # fmt: skip

    def after(self, points: Any, X: Array, periods: int) -> Any:
        """Return the states after some periods; NaN where a member failed."""
        found = self.march(points, X, periods)
        return np.vstack([found.q, found.v, found.z])

    @cached_property
    def weight(self) -> Array:
        """Squares of the angular frequencies by which displacements count, (n,)."""
        found: Array = np.maximum(self.scene.squares, (2.0 * np.pi / self.period.max()) ** 2)
        return found

    @cached_property
    def resolved(self) -> Any:
        """Modes that turn by less than 2.4 in a step, (n,); the midpoint rule hardly damps faster ones."""
        found = np.sqrt(self.scene.squares) * self.period.max() / self.steps < 2.0 * RESOLVED
        return found if found.any() else np.ones(self.scene.size, dtype=bool)

    def distance(self, X: Any) -> Any:
        """Return the energy norm of differences of states, of the modes that the step resolves."""
        n, keep = self.scene.size, self.resolved
        moved = np.einsum("n,n...->...", self.weight[keep], X[:n][keep] ** 2) + (X[n : 2 * n][keep] ** 2).sum(axis=0)
        return np.sqrt(moved)

    def size(self, X: Any) -> Any:
        """Return the energy norm of states, (members,): of velocity, and displacement times its angular frequency."""
        n = self.scene.size
        moved = np.einsum("n,n...->...", self.weight, X[:n] ** 2) + (X[n : 2 * n] ** 2).sum(axis=0)
        return np.sqrt(moved + (X[2 * n :] ** 2).sum(axis=0))


@dataclass(frozen=True, eq=False)
class ShotOrbit:
    """A state that repeats after a number of periods.

    Attributes:
        x: The state, (2 n + states,).
        multipliers: Over all periods of the orbit, complex.
    """

    x: Array
    multipliers: Any


def shoot(strobe: StrobeMap, points: Any, X: Array, order: int) -> list[ShotOrbit | None]:
    """Return orbits of an order from states near them, (2 n + states, candidates); None where one does not converge."""
    X = X.copy()
    found: list[ShotOrbit | None] = [None] * X.shape[1]
    size: Any = np.maximum(strobe.size(X), strobe.floor)
    left: Any = np.arange(X.shape[1])
    n, D = strobe.scene.size, len(X)
    unit = np.concatenate([1.0 / np.sqrt(strobe.weight), np.ones(D - n)])
    for _ in range(PASSES):
        if not len(left):
            break
        blocks = []
        for i in left:
            x, e = X[:, i], SHIFT * size[i] * unit
            blocks.append(np.column_stack([x, x[:, None] + np.diag(e), x[:, None] - np.diag(e)]))
        width = 2 * D + 1
        Y = strobe.after(np.repeat(points[left], width), np.hstack(blocks), order)
        keep = []
        for k, i in enumerate(left):
            y, block = Y[:, k * width : (k + 1) * width], blocks[k]
            e = (block[:, 1 : D + 1] - block[:, :1]).diagonal()
            P = (y[:, 1 : D + 1] - y[:, D + 1 :]) / (2.0 * e)
            miss = y[:, 0] - X[:, i]
            if not np.isfinite(y).all():
                continue
            if strobe.size(miss) <= CONVERGED * size[i]:
                found[i] = ShotOrbit(X[:, i].copy(), np.linalg.eigvals(P))
                continue
            X[:, i] += np.linalg.lstsq(np.eye(D) - P, miss, rcond=None)[0]
            if strobe.size(X[:, i]) < 1e3 * size[i]:
                keep.append(i)
        left = np.array(keep, dtype=int)
    return found
