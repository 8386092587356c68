"""The atlas of a scene: all responses that a set of starts comes to, over one or two parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.stats import binomtest

from gapbeam.solver.errors import UserError
from gapbeam.solver.scene.given_numbers import finite
from gapbeam.solver.scene.linear_scheme import MIDPOINT, LinearScheme
from gapbeam.solver.scene.scene import Scene, SceneState
from gapbeam.solver.system.operators import Array
from gapbeam.studies.atlas.growth_exponent import growth
from gapbeam.studies.atlas.lane_shooting import ShotOrbit, StrobeMap, shoot

CHAOTIC, UNSETTLED, FAILED = -1, -2, -3
NEAR, REPEATS, SAME = 1e-3, 1e-2, 1e-6
"""Tolerances over the motion: of members to their orbit, of strobes of candidates, and of two equal orbits."""
REST = 1e-9
"""Share of the largest start below which motions are rest."""


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


@dataclass
class _Found:
    """An orbit at a parameter point."""

    point: int
    orbit: ShotOrbit
    order: int
    strobes: Array
    peak: dict[str, Any]
    impacts: dict[str | int, float]
    peak_force: dict[str | int, float]
    members: list[int] = field(default_factory=list)


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
    T = finite(periods, "atlas: period")
    if not np.all(T > 0.0):
        raise UserError(f"atlas: found a period of {T.min():.6g} s, expected one above 0")
    for one, span in zip(every, T, strict=True):
        _check_period(scene.with_(one), starts.t, float(span))
    strobe = StrobeMap(scene, values, T, steps, scheme, starts.t, threads=threads)
    largest = float(strobe.size(np.vstack([starts.q, starts.v, starts.z])).max())
    strobe = replace(strobe, floor=REST * (largest or 1e-6 * _pushed(scene, every, T, starts.t)))
    return _Search(strobe, starts, settle, rounds, orders, exponents).atlas(axes, every)


def _pushed(scene: Scene, every: list[dict[str, float]], T: Array, t: float) -> float:
    """Return the largest velocity that the loads alone give the modes in a period: a scale where all starts rest."""
    most = 0.0
    for one, span in zip(every, T, strict=True):
        columns = scene.with_(one)
        for load, column in zip(columns.loads, scene.load_columns.T, strict=False):
            push = np.abs(load.table(t + span * np.linspace(0.0, 1.0, 24))).max()
            most = max(most, float(push * np.abs(column).max() * span))
    return most or 1.0


def _check_period(scene: Scene, t: float, period: float) -> None:
    """Refuse loads and walls that do not repeat."""
    times = t + period * np.linspace(0.013, 0.987, 23)
    for load in scene.loads:
        here, later = load.table(times), load.table(times + period)
        if np.abs(later - here).max() > 1e-6 * np.abs(here).max():
            raise UserError(f"atlas: load {load.name or '?'} does not repeat after {period:.6g} s; see the period")
    here, later = scene.walls(times), scene.walls(times + period)
    if np.abs(later - here).max(initial=0.0) > 1e-6 * np.abs(here).max(initial=0.0):
        raise UserError(f"atlas: the wall of a contact does not repeat after {period:.6g} s; see the period")


class _Search:
    """Members of all parameter points: their last strobes, and the orbits that were found.

    Args: see `atlas`.
    """

    def __init__(
        self, strobe: StrobeMap, starts: SceneState, settle: int, rounds: int, orders: int, exponents: int
    ) -> None:
        self.strobe, self.starts, self.settle, self.rounds = strobe, starts, settle, rounds
        self.orders, self.exponents, self.each = orders, exponents, starts.q.shape[1]
        count = len(strobe.period)
        self.point = np.repeat(np.arange(count), self.each)
        lanes = [np.tile(one, (1, count)) for one in (starts.q, starts.v, starts.spread(self.each).z)]
        self.X: Any = np.vstack(lanes)
        self.late: Any = np.zeros((2 * orders + 1, 2 * strobe.scene.size, len(self.point)))
        self.which = np.full(len(self.point), UNSETTLED)
        self.found: list[_Found] = []

    def atlas(self, axes: dict[str, Array], every: list[dict[str, float]]) -> Atlas:
        """March, shoot and judge."""
        for _ in range(self.rounds):
            self.settle_once()
        exponent = self.judge()
        self.settle_once()
        points = [self.summary(i, one, exponent) for i, one in enumerate(every)]
        which = self.which.reshape(len(every), self.each)
        for i in range(len(every)):
            which[i] = self.numbered(i)[which[i]] if len(self.found) else which[i]
        n, shape = self.strobe.scene.size, (len(every), self.each)
        strobes = {}
        for name, point in self.strobe.scene.point_names.items():
            x = np.einsum("mn,knl->lkm", self.strobe.scene.rows_at(point), self.late[:, :n])
            strobes[name] = (
                x.reshape(*shape, *x.shape[1:])[..., 0] if x.shape[2] == 1 else x.reshape(*shape, *x.shape[1:])
            )
        return Atlas(axes, points, which, self.starts, strobes)

    def settle_once(self) -> None:
        """March members that have not settled through another round, and look for their orbits."""
        left, kept = np.flatnonzero(self.which == UNSETTLED), 2 * self.orders + 1
        if not len(left):
            return
        many = self.strobe.march(self.point[left], self.X[:, left], self.settle + kept, strobes=kept)
        self.which[left[many.failed]] = FAILED
        self.X[:, left] = np.vstack([many.q, many.v, many.z])
        self.late[..., left] = many.strobes
        self.assign()
        self.polish()

    def order_of(self, i: int) -> int:
        """Return the least number of periods after which the strobes of a member nearly repeat; 0: none."""
        late = self.late[..., i]
        size = self.scale(late)
        for n in range(1, self.orders + 1):
            if self.strobe.distance((late[n:] - late[:-n]).T)[-self.orders :].max() <= REPEATS * size:
                return n
        return 0

    def assign(self) -> None:
        """Give members that have come to a known orbit to it."""
        for number, one in enumerate(self.found):
            mine = np.flatnonzero((self.which == UNSETTLED) & (self.point == one.point))
            if not len(mine):
                continue
            size = self.scale(one.strobes)
            apart = self.late[..., mine][:, None] - one.strobes[None, :, :, None]
            distance = self.strobe.distance(np.moveaxis(apart, 2, 0)).min(axis=1) / size  # (strobes, members)
            last = distance[-one.order :].max(axis=0)
            nearer = last <= np.maximum(distance[: one.order].max(axis=0), SAME)
            there = mine[(last <= NEAR) & nearer]
            self.which[there] = number
            one.members += there.tolist()

    def polish(self) -> None:
        """Shoot from one member of each parameter point at a time, until none is left that repeats."""
        tried = np.zeros(len(self.which), dtype=bool)
        while True:
            left = np.flatnonzero((self.which == UNSETTLED) & ~tried)
            _, first = np.unique(self.point[left], return_index=True)
            if not len(first):
                return
            chosen = left[first]
            tried[chosen] = True
            order = np.array([self.order_of(i) for i in chosen])
            for n in np.unique(order[order > 0]):
                self.shoot(chosen[order == n], int(n))
            self.assign()

    def shoot(self, members: Any, order: int) -> None:
        """Shoot orbits of an order from members; keep those that are stable and new."""
        points = self.point[members]
        orbits = shoot(self.strobe, points, self.X[:, members], order)
        twice = []
        good: list[tuple[int, ShotOrbit]] = []
        for i, member, orbit in zip(points, members, orbits, strict=True):
            if orbit is None:
                continue
            if np.abs(orbit.multipliers).max() < 1.0:
                good.append((int(i), orbit))
            elif 2 * order <= self.orders:  # the members may double the period around an orbit that is not stable
                twice.append(member)
        if twice:
            self.shoot(np.array(twice), 2 * order)
        if not good:
            return
        where, X = np.array([i for i, _ in good]), np.column_stack([orbit.x for _, orbit in good])
        many = self.strobe.march(where, X, order, strobes=order)
        shorter: dict[int, list[int]] = {}
        for k, (i, orbit) in enumerate(good):
            strobes = np.roll(many.strobes[..., k], 1, axis=0)  # the first belongs to the state itself
            size = self.scale(strobes)
            least = next(
                (
                    n
                    for n in range(1, order)
                    if order % n == 0 and self.near(strobes[n % order], strobes[0]) <= SAME * size
                ),
                order,
            )
            if least < order:
                shorter.setdefault(least, []).append(k)
                continue
            known = (one for one in self.found if one.point == i and one.order == order)
            if any(self.near(one.strobes.T, strobes[0][:, None]).min() <= SAME * size for one in known):
                continue
            names = {name: value[..., k] for name, value in many.peak.items()}
            impacts = {name: float(value[k]) / order for name, value in many.impacts.items()}
            forces = {name: float(value[k]) for name, value in many.peak_force.items()}
            self.found.append(_Found(i, orbit, order, strobes, names, impacts, forces))
        for least, some in shorter.items():
            self.shoot_states(where[some], X[:, some], least)

    def shoot_states(self, points: Any, X: Array, order: int) -> None:
        """Shoot again with the least order."""
        members = np.array([np.flatnonzero(self.point == i)[0] for i in points])
        kept = self.X[:, members].copy()
        self.X[:, members] = X
        self.shoot(members, order)
        self.X[:, members] = kept

    def scale(self, strobes: Any) -> float:
        """Return the size of a motion by its strobes, (strobes, 2 n)."""
        return max(float(self.strobe.distance(strobes.T).max()), self.strobe.floor)

    def near(self, a: Any, b: Any) -> Any:
        """Return the distance of states."""
        return self.strobe.distance(a - b)

    def judge(self) -> Any:
        """Return the exponents of members that have not settled; those that are chaotic are marked."""
        exponent = np.full(len(self.which), np.nan)
        left = np.flatnonzero(self.which == UNSETTLED)
        if len(left):
            mean, error, last = growth(self.strobe, self.point[left], self.X[:, left], self.exponents)
            exponent[left], self.X[:, left] = mean, last
            self.which[left[np.isnan(mean)]] = FAILED
            self.which[left[mean > 3.0 * error]] = CHAOTIC
        return exponent

    def ranked(self, i: int) -> list[int]:
        """Return the numbers of the orbits at a parameter point that members came to, largest share first."""
        mine = [k for k, one in enumerate(self.found) if one.point == i and one.members]
        return sorted(mine, key=lambda k: (-len(self.found[k].members), self.found[k].order))

    def numbered(self, i: int) -> Any:
        """Return a table from numbers of all orbits to those of a parameter point; negative ones stay."""
        table = np.concatenate([np.zeros(len(self.found), dtype=int), [FAILED, UNSETTLED, CHAOTIC]])
        table[self.ranked(i)] = np.arange(len(self.ranked(i)))
        return table

    def summary(self, i: int, values: dict[str, float], exponent: Any) -> AtlasPoint:
        """Return everything found at a parameter point."""
        which, n = self.which[self.point == i], self.strobe.scene.size
        responses = []
        for k in self.ranked(i):
            one = self.found[k]
            share = binomtest(len(one.members), self.each)
            ends = share.proportion_ci(method="wilson")
            x = one.orbit.x[:, None]
            state = SceneState(self.strobe.t, x[:n], x[n : 2 * n], x[2 * n :], np.zeros((self.strobe.scene.motions, 1)))
            responses.append(
                Response(
                    one.order, state, one.strobes, one.orbit.multipliers, len(one.members), float(share.statistic),
                    (float(ends.low), float(ends.high)), one.peak, one.impacts, one.peak_force,
                )
            )  # fmt: skip
        chaos = exponent[(self.point == i) & (self.which == CHAOTIC)]
        shares = [float(np.mean(which == kind)) for kind in (CHAOTIC, UNSETTLED, FAILED)]
        mean = float(chaos.mean()) if len(chaos) else float("nan")
        return AtlasPoint(values, float(self.strobe.period[i]), responses, shares[0], mean, *shares[1:])
