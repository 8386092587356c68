"""Sets of starts of a scene: displacements and velocities of points, drawn or on a grid."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gapbeam.solver.errors import UserError
from gapbeam.solver.scene.given_numbers import finite
from gapbeam.solver.scene.scene import Scene, SceneState
from gapbeam.solver.system.operators import Array

Ranges = Mapping[str, ArrayLike]


def drawn_starts(
    scene: Scene, count: int, displacement: Ranges | None = None, velocity: Ranges | None = None, seed: int = 0,
    rest: SceneState | None = None,
) -> SceneState:  # fmt: skip
    """Return starts with displacements and velocities of points drawn at random, each evenly between two values.

    The rest of a structure follows: of all motions with these displacements (velocities) it takes the one of least
    potential (kinetic) energy.

    Args:
        scene: The scene.
        count: Starts.
        displacement: By point of one motion, (lowest, highest), m, from `rest`.
        velocity: Likewise, m/s.
        seed: Of the draws.
        rest: State to which they are added, such as a seat; default undeformed.

    Raises:
        UserError: A point has no single motion, values are no pair, or the motions of two points follow each other.
    """
    if count < 1:
        raise UserError(f"starts: found {count}, expected 1 or more")
    draw = np.random.default_rng(seed)

    def values(given: Ranges | None) -> dict[str, Array]:
        found = {}
        for name, pair in (given or {}).items():
            ends = finite(pair, f"starts: {name}")
            if ends.shape != (2,) or ends[0] > ends[1]:
                raise UserError(f"starts: {name}: found {pair!r}, expected (lowest, highest)")
            found[name] = draw.uniform(float(ends[0]), float(ends[1]), count)
        return found

    return _starts(scene, values(displacement), values(velocity), count, rest)


def gridded_starts(
    scene: Scene, displacement: Ranges | None = None, velocity: Ranges | None = None, rest: SceneState | None = None
) -> SceneState:
    """Return starts at all combinations of values, the last one fastest: what a picture of basins needs.

    Args:
        scene: The scene.
        displacement: By point of one motion, values, m, from `rest`.
        velocity: Likewise, m/s.
        rest: See `drawn_starts`.

    Raises:
        UserError: As `drawn_starts`.
    """
    axes = [
        finite(np.atleast_1d(one), "starts") for table in (displacement, velocity) for one in (table or {}).values()
    ]
    if not axes:
        raise UserError("starts: expected values of one point at least")
    grid = [one.ravel() for one in np.meshgrid(*axes, indexing="ij")]
    first = len(displacement or {})
    return _starts(
        scene, dict(zip(displacement or {}, grid, strict=False)), dict(zip(velocity or {}, grid[first:], strict=False)),
        len(grid[0]), rest,
    )  # fmt: skip


def _starts(
    scene: Scene, displacement: dict[str, Array], velocity: dict[str, Array], count: int, rest: SceneState | None
) -> SceneState:
    base = (rest or scene.state()).spread(count)
    soft = scene.squares[scene.squares > 1e-9 * scene.squares.max(initial=0.0)].min(initial=np.inf)
    weight = scene.squares + (soft if np.isfinite(soft) else 1.0)
    q = base.q + _motion(scene, displacement, 1.0 / weight)
    v = base.v + _motion(scene, velocity, np.ones(scene.size))
    return SceneState(base.t, q, v, base.z, base.F)


def _motion(scene: Scene, values: dict[str, Array], mobility: Array) -> Any:
    """Return the motion, (n, starts), of least weight that has these values."""
    if not values:
        return 0.0
    points = [scene.point(name) for name in values]
    wide = [name for name, point in zip(values, points, strict=True) if len(point.rows) != 1]
    if wide:
        raise UserError(f"starts: {', '.join(wide)}: expected points of one motion")
    B = scene.rows(points)
    G = (B * mobility) @ B.T
    if np.linalg.matrix_rank(G, hermitian=True) < len(G):
        raise UserError(f"starts: the motions of {', '.join(values)} follow each other; give fewer points")
    return mobility[:, None] * B.T @ np.linalg.solve(G, np.vstack(list(values.values())))
