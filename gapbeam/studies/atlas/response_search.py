"""Search for the responses that members come to: marches in lock-step, orbits by shooting, members by their orbit."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from gapbeam.solver.errors import UserError
from gapbeam.solver.scene.linear_scheme import LinearScheme
from gapbeam.solver.scene.scene import Scene, SceneState
from gapbeam.solver.system.operators import Array
from gapbeam.studies.atlas.growth_exponent import growth
from gapbeam.studies.atlas.lane_shooting import ShotOrbit, StrobeMap, shoot

CHAOTIC, UNSETTLED, FAILED = -1, -2, -3
NEAR, REPEATS, SAME = 1e-3, 1e-2, 1e-6
"""Tolerances over the motion: of members to their orbit, of strobes of candidates, and of two equal orbits."""
REST = 1e-9
"""Share of the largest start below which motions are rest."""


@dataclass
class FoundOrbit:
    """An orbit at a parameter point, with the members that came to it."""

    point: int
    orbit: ShotOrbit
    order: int
    strobes: Array
    peak: dict[str, Any]
    impacts: dict[str | int, float]
    peak_force: dict[str | int, float]
    members: list[int] = field(default_factory=list)


class ResponseSearch:
    """Members of all parameter points: their last strobes, and the orbits that were found.

    Args:
        strobe: Map of the scene from period to period.
        each: Members of a parameter point; those of one point follow each other.
        X: Their states, (2 n + states, members).
        settle: See `atlas`.
        rounds: See `atlas`.
        orders: See `atlas`.
        exponents: See `atlas`.
    """

    def __init__(
        self, strobe: StrobeMap, each: int, X: Array, settle: int, rounds: int, orders: int, exponents: int
    ) -> None:
        self.strobe, self.each, self.settle, self.rounds = strobe, each, settle, rounds
        self.orders, self.exponents = orders, exponents
        self.point = np.repeat(np.arange(len(strobe.period)), each)
        self.X: Any = X
        self.late: Any = np.zeros((2 * orders + 1, 2 * strobe.scene.size, len(self.point)))
        self.which = np.full(len(self.point), UNSETTLED)
        self.found: list[FoundOrbit] = []
        self.at: dict[int, list[int]] = {}

    def run(self) -> Any:
        """March, shoot and judge; return the exponents of members that did not settle in all rounds."""
        for _ in range(self.rounds):
            self.settle_once()
        exponent = self.judge()
        self.settle_once()
        return exponent

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
            first = one.point * self.each
            mine = first + np.flatnonzero(self.which[first : first + self.each] == UNSETTLED)
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
            known = (self.found[k] for k in self.at.get(i, []) if self.found[k].order == order)
            if any(self.near(one.strobes.T, strobes[0][:, None]).min() <= SAME * size for one in known):
                continue
            names = {name: value[..., k] for name, value in many.peak.items()}
            impacts = {name: float(value[k]) / order for name, value in many.impacts.items()}
            forces = {name: float(value[k]) for name, value in many.peak_force.items()}
            self.found.append(FoundOrbit(i, orbit, order, strobes, names, impacts, forces))
            self.at.setdefault(i, []).append(len(self.found) - 1)
        for least, some in shorter.items():
            self.shoot_states(where[some], X[:, some], least)

    def shoot_states(self, points: Any, X: Array, order: int) -> None:
        """Shoot again with the least order."""
        members = points * self.each
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
        mine = [k for k in self.at.get(i, []) if self.found[k].members]
        return sorted(mine, key=lambda k: (-len(self.found[k].members), self.found[k].order))


def repeating(
    scene: Scene, values: dict[str, Array], period: Array, starts: SceneState, steps: int, scheme: LinearScheme,
    threads: int | None,
) -> StrobeMap:  # fmt: skip
    """Return the map from period to period, after a check that loads and walls repeat.

    Raises:
        UserError: A path or number cannot be, or loads do not repeat after the period.
    """
    if not np.all(period > 0.0):
        raise UserError(f"found a period of {period.min():.6g} s, expected one above 0")
    every = [{path: float(value[i]) for path, value in values.items()} for i in range(len(period))]
    for one, span in zip(every, period, strict=True):
        _check_period(scene.with_(one), starts.t, float(span))
    strobe = StrobeMap(scene, values, period, steps, scheme, starts.t, threads=threads)
    largest = float(strobe.size(np.vstack([starts.q, starts.v, starts.spread(starts.q.shape[1]).z])).max())
    return replace(strobe, floor=REST * (largest or 1e-6 * _pushed(scene, every, period, starts.t)))


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
            raise UserError(f"load {load.name or '?'} does not repeat after {period:.6g} s; see the period")
    here, later = scene.walls(times), scene.walls(times + period)
    if np.abs(later - here).max(initial=0.0) > 1e-6 * np.abs(here).max(initial=0.0):
        raise UserError(f"the wall of a contact does not repeat after {period:.6g} s; see the period")
