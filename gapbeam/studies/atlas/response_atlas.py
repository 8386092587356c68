"""The atlas of a scene: all responses that a set of starts comes to, over one or two parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import binomtest

from gapbeam.solver.errors import UserError
from gapbeam.solver.scene.given_numbers import finite
from gapbeam.solver.scene.linear_scheme import MIDPOINT, LinearScheme
from gapbeam.solver.scene.scene import Scene, SceneState
from gapbeam.solver.system.operators import Array
from gapbeam.studies.atlas.response_search import CHAOTIC, FAILED, UNSETTLED, ResponseSearch, repeating


@dataclass(frozen=True, eq=False)
class Response:
    """A stable periodic response, found by shooting.

    Attributes:
        order: Periods of the load after which it repeats.
        state: At the start of a period: a march from it repeats.
        strobes: States (q, v) at its periods, (order, 2 n).
        multipliers: Of small disturbances over all its periods, complex; the largest is below 1 in size.
        count: Starts that come to it.
        share: Of all starts at this parameter point.
        interval: Of the share, 95 % (Wilson), for starts drawn at random.
        peak: By point, the largest displacement in absolute value, m.
        impacts: By contact, impacts a period of the load.
        peak_force: By contact, N.
    """

    order: int
    state: SceneState
    strobes: Array
    multipliers: Any
    count: int
    share: float
    interval: tuple[float, float]
    peak: dict[str, Any]
    impacts: dict[str | int, float]
    peak_force: dict[str | int, float]


@dataclass(frozen=True, eq=False)
class AtlasPoint:
    """Everything found at one parameter point.

    Attributes:
        values: Parameters by path.
        period: Of the load, s.
        responses: Stable periodic ones, largest share first.
        chaotic: Share of starts whose motion is chaotic: its exponent is above 0 by more than three standard errors.
        exponent: Mean exponent of these, 1/s; NaN where there are none.
        unsettled: Share of starts that neither came to a response nor are chaotic: march longer, or look at the orders.
        failed: Share of starts whose contact forces did not converge.
    """

    values: dict[str, float]
    period: float
    responses: list[Response]
    chaotic: float
    exponent: float
    unsettled: float
    failed: float


@dataclass(frozen=True, eq=False)
class Atlas:
    """All responses of a scene over its parameters.

    Attributes:
        over: Values by path.
        points: One for each combination of values, the last path fastest.
        which: Response of each start, (points, starts): its number in `responses`; -1 chaotic, -2 unsettled, -3 failed.
        starts: The starts.
        strobes: By point of the scene, displacements at the last periods, (points, starts, periods), or (..., motions).
    """

    over: dict[str, Array]
    points: list[AtlasPoint]
    which: Any
    starts: SceneState
    strobes: dict[str, Array]

    @property
    def is_complete(self) -> bool:
        """True where each start came to a response or to chaos."""
        return bool((self.which > UNSETTLED).all())


def atlas(
    scene: Scene, *, period: float | Callable[[dict[str, float]], float], starts: SceneState,
    over: Mapping[str, Any] | None = None, steps: int = 400, settle: int = 100, rounds: int = 4, orders: int = 8,
    exponents: int = 200, scheme: LinearScheme = MIDPOINT, threads: int | None = None,
) -> Atlas:  # fmt: skip
    """Find all stable periodic responses that a set of starts comes to, their shares, and what is chaotic.

    All starts march in lock-step; members whose strobes repeat are candidates; a candidate counts where shooting
    converges, its multipliers are below 1 in size, and a member has come to 1e-3 of it and comes nearer. Orbits are
    compared by their converged states, and orders are the least. Members that do not settle march again, `rounds` times
    in all; then their exponent decides whether they are chaotic. Those that are not march once more. Motion that is
    chaotic for that long may still end in a response later.

    Args:
        scene: Its loads repeat after the period.
        period: Of the loads, s; or a function of the parameters by path.
        starts: A set of starts, as of `drawn_starts`.
        over: Values by path; two paths: all combinations.
        steps: In a period.
        settle: Periods before strobes are compared.
        rounds: Marches of so many periods at most.
        orders: Highest number of periods after which a response may repeat.
        exponents: Periods over which exponents are taken.
        scheme: Of the time integration; without accelerations as states.
        threads: As of `ensemble`.

    Raises:
        UserError: A path, number or period cannot be, or loads do not repeat after the period.
    """
    if min(steps, settle, rounds, orders) < 1 or exponents < 50:
        raise UserError("atlas: expected steps, settle, rounds and orders from 1 on, and exponents from 50 on")
    if scheme.is_accelerated:
        raise UserError("atlas: the scheme has accelerations as states; take the midpoint rule or theta")
    axes = {path: np.atleast_1d(finite(value, path)) for path, value in (over or {}).items()}
    if len(axes) > 2:
        raise UserError(f"atlas: found {len(axes)} parameters, expected at most 2")
    grid = np.meshgrid(*axes.values(), indexing="ij") if axes else [np.zeros(1)]
    values: dict[str, Array] = {path: one.ravel() for path, one in zip(axes, grid, strict=False)}
    count = grid[0].size
    every = [{path: float(value[i]) for path, value in values.items()} for i in range(count)]
    periods = [period(one) if callable(period) else period for one in every]
    strobe = repeating(scene, values, finite(periods, "atlas: period"), starts, steps, scheme, threads)
    each = starts.q.shape[1]
    X = np.vstack([np.tile(one, (1, count)) for one in (starts.q, starts.v, starts.spread(each).z)])
    search = ResponseSearch(strobe, each, X, settle, rounds, orders, exponents)
    exponent = search.run()
    points = [_summary(search, i, one, exponent) for i, one in enumerate(every)]
    which = search.which.reshape(count, each)
    for i in range(count):
        which[i] = _numbered(search, i)[which[i]] if len(search.found) else which[i]
    strobes = {}
    for name, point in scene.point_names.items():
        x = np.einsum("mn,knl->lkm", scene.rows_at(point), search.late[:, : scene.size])
        x = x.reshape(count, each, *x.shape[1:])
        strobes[name] = x[..., 0] if x.shape[-1] == 1 else x
    return Atlas(axes, points, which, starts, strobes)


def _numbered(search: ResponseSearch, i: int) -> Any:
    """Return a table from numbers of all orbits to those of a parameter point; negative ones stay."""
    table = np.concatenate([np.zeros(len(search.found), dtype=int), [FAILED, UNSETTLED, CHAOTIC]])
    table[search.ranked(i)] = np.arange(len(search.ranked(i)))
    return table


def _summary(search: ResponseSearch, i: int, values: dict[str, float], exponent: Any) -> AtlasPoint:
    """Return everything found at a parameter point."""
    which, n = search.which[search.point == i], search.strobe.scene.size
    responses = []
    for k in search.ranked(i):
        one = search.found[k]
        share = binomtest(len(one.members), search.each)
        ends = share.proportion_ci(method="wilson")
        x = one.orbit.x[:, None]
        state = SceneState(search.strobe.t, x[:n], x[n : 2 * n], x[2 * n :], np.zeros((search.strobe.scene.motions, 1)))
        responses.append(
            Response(
                one.order, state, one.strobes, one.orbit.multipliers, len(one.members), float(share.statistic),
                (float(ends.low), float(ends.high)), one.peak, one.impacts, one.peak_force,
            )
        )  # fmt: skip
    chaos = exponent[(search.point == i) & (search.which == CHAOTIC)]
    shares = [float(np.mean(which == kind)) for kind in (CHAOTIC, UNSETTLED, FAILED)]
    mean = float(chaos.mean()) if len(chaos) else float("nan")
    return AtlasPoint(values, float(search.strobe.period[i]), responses, shares[0], mean, *shares[1:])
