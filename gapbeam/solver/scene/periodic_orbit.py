"""Periodic responses of scenes: Newton's method on the map over a period, with disturbed members of one ensemble."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gapbeam.solver.errors import NotConverged, UserError
from gapbeam.solver.scene.argument_checks import checked
from gapbeam.solver.scene.lane_ensemble import ensemble
from gapbeam.solver.scene.linear_scheme import MIDPOINT, LinearScheme
from gapbeam.solver.scene.scene import Scene, SceneState
from gapbeam.solver.system.operators import Array

TOLERANCE = 1e-10
SHIFT = 1e-6


@dataclass(frozen=True, eq=False)
class PeriodicOrbit:
    """A response that repeats after a period.

    Attributes:
        state: At the start of a period: a march from it repeats.
        multipliers: Of small disturbances over a period, (2 n + states,), complex.
        residual: Change over a period, over the size of the motion.
        passes: Of Newton's method.
    """

    state: SceneState
    multipliers: Any
    residual: float
    passes: int

    @property
    def is_stable(self) -> bool:
        """True where all disturbances decay."""
        return bool(np.abs(self.multipliers).max() < 1.0)


@checked
def periodic(
    scene: Scene, period: float, steps: int, start: SceneState | None = None, passes: int = 30,
    scheme: LinearScheme = MIDPOINT,
) -> PeriodicOrbit:  # fmt: skip
    """Return a response that repeats after a period, from a start that is near it.

    Solves P(x) = x for the state x after a period of so many steps. The Jacobian of P is taken from members that are
    disturbed by 1e-6 of the size of the motion, all marched in one ensemble.

    Args:
        scene: Its loads repeat after the period.
        period: s.
        steps: In a period.
        start: Where to begin; default at rest. March some periods first where that is far away.
        passes: Of Newton's method at most.
        scheme: Of the time integration; without accelerations as states.

    Raises:
        UserError: The period, steps or scheme cannot be.
        NotConverged: The state did not converge to 1e-10; a motion that slides or grazes may not be smooth enough.

    Source: Parker and Chua (1989), Practical Numerical Algorithms for Chaotic Systems, sec. 5.3.
    """
    if not (np.isfinite(period) and period > 0.0) or steps < 1:
        raise UserError(f"periodic: found period {period!r} s in {steps} steps, expected both above 0")
    if scheme.is_accelerated:
        raise UserError("periodic: the scheme has accelerations as states; take the midpoint rule or theta")
    begin = start or scene.state()
    if begin.q.shape[1] != 1:
        raise UserError("periodic: the start has several members; take one")
    h, t = period / steps, begin.t
    x: Any = np.concatenate([begin.q[:, 0], begin.v[:, 0], begin.z[:, 0]])
    best = np.inf
    for count in range(1, passes + 1):
        miss, P, size = returned(scene, x, t, h, steps, scheme)
        best = float(np.abs(miss / size).max())
        if best < TOLERANCE:
            return PeriodicOrbit(state_of(scene, x[:, None].copy(), t), np.linalg.eigvals(P), best, count)
        x = x + _newton(P, miss)
    raise NotConverged(
        f"periodic: after {passes} passes a period of {period:g} s leaves {best:.2g} of the motion; start nearer "
        "(march some periods first), or the response has another period"
    )


def state_of(scene: Scene, x: Array, t: float) -> SceneState:
    """Return columns of coordinates, velocities and states as the lanes of a state."""
    n = scene.size
    return SceneState(t, x[:n], x[n : 2 * n], x[2 * n :], np.zeros((scene.motions, x.shape[1])))


def returned(scene: Scene, x: Array, t: float, h: float, steps: int, scheme: LinearScheme) -> tuple[Any, Any, Array]:
    """Return P(x) - x after so many steps, the Jacobian of P by disturbed members, and the sizes of x that scale both.

    Raises:
        NotConverged: The contact forces of a step failed.
    """
    n = scene.size
    size: Array = np.concatenate([np.full(len(one), np.abs(one).max(initial=0.0)) for one in np.split(x, [n, 2 * n])])
    if not size.max() > 0.0:
        size = np.ones_like(size) * (np.abs(scene.load_columns).max() or 1.0) * h * h
    size = np.maximum(size, 1e-12 * size.max())
    e = SHIFT * size
    X = np.column_stack([x, x[:, None] + np.diag(e), x[:, None] - np.diag(e)])
    found = ensemble(scene, step=h, end=t + steps * h, start=state_of(scene, X, t), scheme=scheme)
    if found.failed.any():
        raise NotConverged("periodic: the contact forces of a step failed; take more steps")
    Y = np.vstack([found.q, found.v, found.z])
    return Y[:, 0] - x, (Y[:, 1 : 1 + len(x)] - Y[:, 1 + len(x) :]) / (2.0 * e), size


def _newton(P: Any, miss: Array) -> Any:
    return np.linalg.lstsq(np.eye(len(P)) - P, miss, rcond=None)[0]
