"""Shooting on systems that are too large for their monodromy matrix: Newton's method with GMRES.

Each product with the derivative of the period map is a march of a disturbance by linearized steps. Damping makes the
map forget all but the lowest modes, so that few are needed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gapbeam.solver.periodic.arnoldi_gmres import leading_multipliers, solve_identity_minus
from gapbeam.solver.periodic.floquet import Stability
from gapbeam.solver.periodic.marched_period_map import ContactTangent, MarchedMap
from gapbeam.solver.periodic.shooting import SLACK, no_orbit
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import State

FORCING = 0.01  # of the residual: how well Newton's equations are solved
MOST_PRODUCTS = 60
MULTIPLIER_ERROR = 1.0e-3
SHORTEST_UPDATE = 2.0**-5
FLOOR = 1.0e-30


@dataclass(frozen=True)
class MarchedOrbit:
    """A periodic response.

    Attributes:
        state: State at the start of a period, t = 0.
        stability: Leading multipliers.
        multiplier_error: How far the largest may be off.
        residuals: |P(x) - x| / |x| of every iteration, norms of energy.
        products: Marches of disturbances.
    """

    state: State
    stability: Stability
    multiplier_error: float
    residuals: tuple[float, ...]
    products: int

    @property
    def residual(self) -> float:
        """Change of the state over a period, relative."""
        return self.residuals[-1]

    @property
    def iterations(self) -> int:
        """Newton iterations."""
        return len(self.residuals) - 1


def shoot_marched(
    period_map: MarchedMap,
    start: State,
    tolerance: float = 1.0e-8,
    max_iterations: int = 20,
    report: Callable[[int, float], None] | None = None,
    pause: Callable[[], None] | None = None,
) -> MarchedOrbit:
    """Find a periodic response near a state, and its leading multipliers.

    Args:
        period_map: The map.
        start: State to start from: the end of a march, or the response of a smaller model.
        tolerance: Largest |P(x) - x| / |x|.
        max_iterations: Limit of Newton iterations.
        report: Called with the number and residual of every iteration.
        pause: Called before every march of a disturbance, of which an iteration has dozens; may raise. Collective.

    Raises:
        NotConverged: With the residual of every iteration.

    Collective.
    """
    state, residuals, products = start, list[float](), 0
    kept: tuple[State, Array] | None = None
    length = 1.0
    for _ in range(max_iterations + 1):
        end, tangents = period_map.linearized(state)
        change = np.stack([end.u - state.u, end.v - state.v])
        here = np.stack([state.u, state.v])
        squares = period_map.products([(change, change), (here, here)])
        residual = float(np.sqrt(max(squares[0], 0.0) / max(squares[1], FLOOR)))
        if kept is not None and length > SHORTEST_UPDATE and not residual <= SLACK * residuals[-1]:
            length *= 0.5
            state = period_map.moved(kept[0], length * kept[1])
            continue
        residuals.append(residual)
        if report is not None:
            report(len(residuals) - 1, residual)
        if not np.isfinite(residual):
            break
        counted = _Counted(period_map, tangents, pause)
        if residual <= tolerance:
            probe = change if squares[0] > 0.0 else here
            stability, off = leading_multipliers(
                counted, period_map.products, _mixed(probe, here), MULTIPLIER_ERROR, MOST_PRODUCTS
            )
            return MarchedOrbit(state, stability, off, tuple(residuals), products + counted.count)
        update, _ = solve_identity_minus(counted, period_map.products, change, FORCING, MOST_PRODUCTS)
        products += counted.count
        kept, length = (state, update), 1.0
        state = period_map.moved(state, update)
    raise no_orbit(max_iterations, residuals, tolerance)


def _mixed(one: Array, other: Array) -> Array:
    """Return a vector with a share of both, however small one is."""
    return np.asarray(one / max(float(np.max(np.abs(one))), FLOOR) + other / max(float(np.max(np.abs(other))), FLOOR))


@dataclass
class _Counted:
    """The derivative of the period map, with the number of its products."""

    period_map: MarchedMap
    tangents: list[ContactTangent]
    pause: Callable[[], None] | None = None
    count: int = 0

    def __call__(self, disturbance: Array) -> Array:
        if self.pause is not None:
            self.pause()
        self.count += 1
        return self.period_map.disturbed(self.tangents, disturbance)
