"""Search for the parameters of a scene at which a figure of its periodic response is least, by exact tangents."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy

from gapbeam.solver.messages.errors import NotConverged, UserError
from gapbeam.solver.messages.wording import counted
from gapbeam.solver.scene.argument_checks import checked, finite, period_at
from gapbeam.solver.scene.limit_cycle import periodic, state_of
from gapbeam.solver.scene.linear_scheme import MIDPOINT, LinearScheme
from gapbeam.solver.scene.orbit_tangents import OrbitTangents, tangents
from gapbeam.solver.scene.printed_values import result_words
from gapbeam.solver.scene.scene import Scene, SceneState
from gapbeam.solver.system.operators import Array

SHORTEST, BENT = 2.0**-6, 0.5
"""Shortest part of a move of the parameters, and how far an orbit may lie from its prediction, over its move."""
WITHIN = 1e-6
"""Relative: how far a figure may lie above its limit."""


@dataclass(frozen=True, eq=False)
class Optimum:
    """The parameters at which a figure is least.

    Attributes:
        values: Parameters by path.
        scene: Scene with these values.
        tangents: Figures there, their derivatives, and the state of the response.
        orbits: Values and figures of each response that was computed, in turn.
    """

    __repr__ = result_words

    values: dict[str, float]
    scene: Scene
    tangents: OrbitTangents
    orbits: list[tuple[dict[str, float], dict[str, float]]]

    @property
    def is_stable(self) -> bool:
        """True where the response is stable."""
        return bool(np.abs(self.tangents.multipliers).max() < 1.0)


class _Followed:
    """The response followed from values to values, so that it stays the same one."""

    def __init__(self, make: Any, names: list[str], paths: list[str], period: Any, steps: int, scheme: Any) -> None:
        self.make, self.names, self.paths, self.steps, self.scheme = make, names, paths, steps, scheme
        self.period = period
        self.u: Any = None
        self.found: Any = None
        self.orbits: list[tuple[dict[str, float], dict[str, float]]] = []

    def values(self, u: Array) -> dict[str, float]:
        return dict(zip(self.paths, map(float, u), strict=True))

    def at(self, u: Array) -> OrbitTangents:
        """Return figures and tangents at values, continued from the last ones in steps as long as predictions hold.

        Raises:
            NotConverged: The response ends on the way, or has no derivatives.
        """
        begin, done, part = self.u, float(np.array_equal(u, self.u)), 1.0
        while done < 1.0:
            part = min(part, 1.0 - done)
            try:
                self.step(begin + (done + part) * (u - begin))
                done, part = done + part, 2.0 * part
            except (NotConverged, UserError) as error:
                part *= 0.5
                if part < SHORTEST:
                    there = ", ".join(f"{path} = {value:.6g}" for path, value in self.values(self.u).items())
                    raise NotConverged(f"optimize: the response cannot be followed from {there}: {error}") from None
        assert isinstance(self.found, OrbitTangents)
        return self.found

    def step(self, u: Array) -> None:
        """Move to values in one part."""
        state = self.found.state
        x = state.x[:, 0]
        move: Any = sum(self.found.moved[path] * (a - b) for path, a, b in zip(self.paths, u, self.u, strict=True))
        orbit = self.orbit(u, state_of(self.make(self.values(u)), (x + move)[:, None], state.t))
        if not np.abs(orbit.state.x[:, 0] - x - move).max() <= BENT * np.abs(move).max() + WITHIN * np.abs(x).max():
            raise NotConverged("the next response is another one")
        self.u, self.found = u, orbit

    def orbit(self, u: Array, start: SceneState) -> OrbitTangents:
        """Return the response at values near a start, with its tangents."""
        values = self.values(u)
        period = period_at(self.period, values, "optimize")
        found = periodic(self.make(values), period, self.steps, start, scheme=self.scheme)
        given = {"period": period, "steps": self.steps, "start": found.state, "scheme": self.scheme}
        orbit = tangents(self.make, self.names, values, **given)
        self.orbits.append((values, orbit.values))
        return orbit


@checked
def optimize(
    scene: Scene | Callable[[dict[str, float]], Scene], figure: str, over: Mapping[str, Any], *,
    period: float | Callable[[dict[str, float]], float], steps: int, start: SceneState,
    limits: Mapping[str, float] | None = None, scheme: LinearScheme = MIDPOINT, passes: int = 50,
) -> Optimum:  # fmt: skip
    """Return the parameters at which a figure of a periodic response is least, with other figures below limits.

    The response is followed from values to values; derivatives are those of `tangents`. What is found is a local
    minimum of this response: others may coexist, see `atlas`, and other starts may find lower ones.

    Args:
        scene: As of `tangents`.
        figure: Such as "stop.peak_force"; see `tangents`.
        over: (lowest, first, highest) value by path.
        period: s; or a function of the values by path.
        steps: Steps in a period.
        start: Start of the response at the first values, or near it.
        limits: Highest values of other figures, above 0.
        scheme: Scheme of the time integration.
        passes: Largest number of passes of the search.

    Raises:
        UserError: A path, range or figure cannot be, or the response at the first values has no derivatives.
        NotConverged: The response ends on the way, or no values keep the limits.

    Source: Kraft (1988), A software package for sequential quadratic programming, DFVLR-FB 88-28 (SciPy's SLSQP).
    """
    table = {path: finite(value, f"optimize: {path}") for path, value in over.items()}
    wrong = [path for path, one in table.items() if one.shape != (3,) or not one[0] <= one[1] <= one[2] > one[0]]
    if wrong or not table:
        words = ", ".join(f"{path}: {over[path]!r}" for path in wrong) or "no parameters"
        raise UserError(f"optimize: found {words}; expected (lowest, first, highest) by path")
    bounds = {name: float(finite(value, f"optimize: limit of {name}")) for name, value in (limits or {}).items()}
    if low := [name for name, value in bounds.items() if not value > 0.0]:
        raise UserError(f"optimize: found the limit {bounds[low[0]]:g} of {low[0]}, expected one above 0")
    make = scene.with_ if isinstance(scene, Scene) else scene
    names = [figure, *(name for name in bounds if name != figure)]
    lowest, first, highest = np.array(list(table.values())).T
    followed = _Followed(make, names, list(table), period, steps, scheme)
    followed.u, followed.found = first, followed.orbit(first, start)
    scale, span = abs(followed.found.values[figure]) or 1.0, highest - lowest

    def at(s: Array) -> OrbitTangents:
        return followed.at(lowest + np.clip(s, 0.0, 1.0) * span)

    def slopes(s: Array, name: str) -> Array:
        return np.asarray(span * np.array([at(s).slopes[name][path] for path in table]), dtype=float)

    def room(s: Array) -> Array:
        return np.array([1.0 - at(s).values[name] / limit for name, limit in bounds.items()])

    def narrowing(s: Array) -> Array:
        return np.array([-slopes(s, name) / limit for name, limit in bounds.items()])

    try:
        answer = scipy.optimize.minimize(
            lambda s: at(s).values[figure] / scale, (first - lowest) / span, jac=lambda s: slopes(s, figure) / scale,
            bounds=[(0.0, 1.0)] * len(table), method="SLSQP", options={"maxiter": passes, "ftol": 1e-12},
            constraints=[{"type": "ineq", "fun": room, "jac": narrowing}] if bounds else (),
        )  # fmt: skip
    except NotConverged as error:
        raise NotConverged(f"{error}; {_nearest(followed.orbits, figure, bounds)}") from None
    found, values = at(answer.x), followed.values(followed.u)
    beyond = [name for name, limit in bounds.items() if not found.values[name] <= (1.0 + WITHIN) * limit]
    if not answer.success or beyond:
        there = ", ".join(f"{name} = {value:.6g}" for name, value in [*values.items(), *found.values.items()])
        raise NotConverged(
            f"optimize: the search ended after {answer.nit} passes at {there}, beyond the limit of "
            f"{', '.join(beyond) or 'none'}: {answer.message}; peaks have kinks where another step is the largest; "
            f"{_nearest(followed.orbits, figure, bounds)}"
        )
    return Optimum(values, make(values), found, followed.orbits)


def _nearest(
    orbits: list[tuple[dict[str, float], dict[str, float]]], figure: str, bounds: Mapping[str, float]
) -> str:  # fmt: skip
    """Return in words the best response of a search that failed: the least one, or the nearest to the limits."""

    def excess(figures: Mapping[str, float]) -> float:
        return max((figures[name] / limit - 1.0 for name, limit in bounds.items()), default=0.0)

    kept = [one for one in orbits if excess(one[1]) <= WITHIN]
    values, figures = min(kept or orbits, key=lambda one: one[1][figure] if kept else excess(one[1]))
    there = ", ".join(f"{name} = {value:.6g}" for name, value in [*values.items(), *figures.items()])
    if kept:
        return f"the best of {counted(len(orbits), 'response')} was {there}: start there, or give other ends"
    limits = ", ".join(f"{name} = {limit:.6g}" for name, limit in bounds.items())
    return f"none of {counted(len(orbits), 'response')} kept the limits {limits}; the nearest was {there}"
