"""Search for the responses that members come to: marches in lock-step, orbits by shooting, members by their orbit.

Newton's method on the maps over the periods shoots many orbits at once, all members of one ensemble. A second lane for
each member gives the growth of small differences: the largest Lyapunov exponent.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from gapbeam.solver.case.figure_table import Figure
from gapbeam.solver.scene.lane_ensemble import ensemble
from gapbeam.solver.scene.limit_cycle import (
    FreeMotions,
    bared,
    change_in,
    change_of_orbit,
    check_period,
    drifting,
    free_motions,
    multipliers_of,
    state_of,
)
from gapbeam.solver.scene.linear_scheme import RESOLVED, LinearScheme
from gapbeam.solver.scene.scene import Scene, SceneState
from gapbeam.solver.system.operators import Array
from gapbeam.studies.atlas.two_frequencies import TwoFrequencies, two_frequencies

CONVERGED, SHIFT, PASSES = 1e-10, 1e-6, 12


@dataclass(frozen=True, eq=False)
class StrobeMap:
    """The motion of a scene from one period to the next, for members with values of their own.

    Attributes:
        scene: The scene.
        values: Values by path, (parameter points,).
        period: (parameter points,), s.
        steps: Steps in a period.
        scheme: Scheme of the time integration.
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
        T, start = self.period[points], state_of(self.scene, X, self.t)
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
    def free(self) -> FreeMotions:
        """Motions that nothing opposes."""
        return free_motions(self.scene)

    @cached_property
    def resolved(self) -> Any:
        """Modes whose phase advances by less than 2.4 rad a step, (n,); the midpoint rule hardly damps faster ones."""
        found = np.sqrt(self.scene.squares) * self.period.max() / self.steps < 2.0 * RESOLVED
        return found if found.any() else np.ones(self.scene.size, dtype=bool)

    def distance(self, X: Any) -> Any:
        """Return the energy norm of differences of states, of the modes that the step resolves, but free motions."""
        n, keep, X = self.scene.size, self.resolved, bared(X, self.free)
        moved = np.einsum("n,n...->...", self.weight[keep], X[:n][keep] ** 2) + (X[n : 2 * n][keep] ** 2).sum(axis=0)
        return np.sqrt(moved)

    def size(self, X: Any) -> Any:
        """Return the energy norm of states, (members,): of velocity, and displacement times its angular frequency."""
        n = self.scene.size
        moved = np.einsum("n,n...->...", self.weight, X[:n] ** 2) + (X[n : 2 * n] ** 2).sum(axis=0)
        return np.sqrt(moved + (X[2 * n :] ** 2).sum(axis=0))

    def record(self, points: Any, X: Array, samples: int) -> tuple[Any, Any]:
        """Return a march of so many periods, and displacements times their frequencies, (samples, n, members)."""
        many = self.march(points, X, samples, strobes=samples)
        states = bared(np.moveaxis(many.strobes, 1, 0), self.free)[: self.scene.size]
        return many, np.sqrt(self.weight)[:, None] * np.moveaxis(states, 0, 1)


@dataclass(frozen=True, eq=False)
class ShotOrbit:
    """A state that repeats after a number of periods.

    Attributes:
        x: The state, (2 n + states,).
        multipliers: Multipliers over all periods of the orbit, complex; of motions with two frequencies the growth by
            the exponent over a period.
    """

    x: Array
    multipliers: Any


def shoot(strobe: StrobeMap, points: Any, X: Array, order: int) -> list[ShotOrbit | None]:
    """Return orbits of an order from states near them, (2 n + states, candidates); None where one does not converge."""
    X = bared(X, strobe.free)
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
            P = drifting((y[:, 1 : D + 1] - y[:, D + 1 :]) / (2.0 * e), strobe.free, order * strobe.period[points[i]])
            miss = change_in(X[:, i], y[:, 0], strobe.free)
            if not np.isfinite(y).all():
                continue
            if strobe.size(miss) <= CONVERGED * size[i]:
                h = strobe.period[points[i]] / strobe.steps
                values = multipliers_of(strobe.scene, bared(P, strobe.free), h, order * strobe.steps)
                found[i] = ShotOrbit(X[:, i].copy(), values)
                continue
            X[:, i] += change_of_orbit(P, miss)
            if strobe.size(X[:, i]) < 1e3 * size[i]:
                keep.append(i)
        left = np.array(keep, dtype=int)
    return found


APART, BATCHES = 1e-7, 10


def growth(strobe: StrobeMap, points: Array, X: Array, periods: int) -> tuple[Array, Array, Array]:
    """Return exponents, 1/s, their standard errors from batches of periods, and the last states; NaN where one fails.

    The second lane starts 1e-7 of the motion away, and is brought back to that distance after each period.

    Args:
        strobe: The march by periods.
        points: Parameter point of each member.
        X: States, (2 n + states, members).
        periods: As many as ten batches.

    Source: Benettin et al. (1980), Meccanica 15, 9.
    """
    X, draw = (bared(one, strobe.free) for one in (X, np.random.default_rng(0).standard_normal(X.shape)))
    size = strobe.size(X)
    away, D = draw * APART * size / strobe.size(draw), X.shape[1]
    rates = np.zeros((periods, D))
    for k in range(periods):
        Y = strobe.after(np.tile(points, 2), np.hstack([X, X + away]), 1)
        X, away = Y[:, :D], bared(Y[:, D:] - Y[:, :D], strobe.free)
        grown = strobe.size(away) / (APART * size)
        rates[k] = np.log(np.maximum(grown, 1e-300)) / strobe.period[points]
        away = away / np.maximum(grown, 1e-300)
    late = rates[periods // 5 :]  # the difference has turned into the direction of the largest growth
    parts = np.array([part.mean(axis=0) for part in np.array_split(late, BATCHES)])
    return late.mean(axis=0), parts.std(axis=0, ddof=1) / np.sqrt(BATCHES), X


CHAOTIC, UNSETTLED, FAILED = -1, -2, -3
NEAR, REPEATS, SAME = 1e-3, 1e-2, 1e-6
"""Tolerances over the motion: of members to their orbit, of strobes of candidates, and of two equal orbits."""
REST = 1e-9
"""Share of the largest start below which motions are rest."""
NEVER = -1
"""Order of motions of two frequencies: they never repeat."""
STROBES = 256
"""Strobes of a record in which two frequencies are looked for."""


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
    figures: dict[str, float]
    members: list[int] = field(default_factory=list)
    lines: TwoFrequencies | None = None

    @property
    def frequencies(self) -> tuple[float, ...]:
        """Frequencies beside the load, over its frequency; none where the orbit repeats."""
        return () if self.lines is None else self.lines.frequencies


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
        figures: See `atlas`.
    """

    def __init__(
        self, strobe: StrobeMap, each: int, X: Array, settle: int, rounds: int, orders: int, exponents: int,
        figures: Sequence[Figure] = (),
    ) -> None:  # fmt: skip
        self.strobe, self.each, self.settle, self.rounds = strobe, each, settle, rounds
        self.orders, self.exponents, self.figures = orders, exponents, tuple(figures)
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
        self.find_two_frequencies(exponent)
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

    def order_of(self, i: int, within: float = REPEATS) -> int:
        """Return the least number of periods after which strobes of a member repeat within that share; 0: none."""
        late = self.late[..., i]
        size = self.scale(late)
        for n in range(1, self.orders + 1):
            if self.strobe.distance((late[n:] - late[:-n]).T)[-self.orders :].max() <= within * size:
                return n
        return 0

    def assign(self) -> None:
        """Give members that have come to a known orbit to it."""
        for number, one in enumerate(self.found):
            if one.order == NEVER:
                continue
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

    def shoot(self, members: Any, order: int, doubles: bool = True) -> None:
        """Shoot orbits of an order from members, some of twice that order; keep those that are stable and new."""
        points = self.point[members]
        orbits = shoot(self.strobe, points, self.X[:, members], order)
        twice = []
        good: list[tuple[int, ShotOrbit]] = []
        for i, member, orbit in zip(points, members, orbits, strict=True):
            if orbit is None:
                continue
            if np.abs(orbit.multipliers).max() < 1.0:
                good.append((int(i), orbit))
            elif doubles and 2 * order <= self.orders:  # members may double the period around an unstable orbit
                twice.append(member)
        if twice:
            self.shoot(np.array(twice), 2 * order)
        if not good:
            return
        where, X = np.array([i for i, _ in good]), np.column_stack([orbit.x for _, orbit in good])
        many = self.strobe.march(where, X, order, strobes=order, figures=self.figures)
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
            names = {name: value[..., k][()] for name, value in many.peak.items()}
            impacts = {name: float(value[k]) / order for name, value in many.impacts.items()}
            forces = {name: float(value[k]) for name, value in many.peak_force.items()}
            own = {name: float(value[k]) for name, value in many.figures.items()}
            self.found.append(FoundOrbit(i, orbit, order, strobes, names, impacts, forces, own))
            self.at.setdefault(i, []).append(len(self.found) - 1)
        for least, some in shorter.items():
            self.shoot_states(where[some], X[:, some], least)

    def shoot_states(self, points: Any, X: Array, order: int) -> None:
        """Shoot again with the least order."""
        members = points * self.each
        kept = self.X[:, members].copy()
        self.X[:, members] = X
        self.shoot(members, order, doubles=False)  # of the orbit that twice its periods came to
        self.X[:, members] = kept

    def scale(self, strobes: Any) -> float:
        """Return the size of a motion by its strobes, (strobes, 2 n)."""
        return max(float(self.strobe.distance(strobes.T).max()), self.strobe.floor)

    def near(self, a: Any, b: Any) -> Any:
        """Return the distance of states."""
        return self.strobe.distance(a - b)

    def judge(self) -> Any:
        """Return the exponents of members that have not settled; those that are chaotic are marked.

        What repeats within the tolerance of members to their orbit is no chaos: where a contact opens at the end of a
        step, the steps leave a small irregular rest, which grows as chaos does.
        """
        exponent = np.full(len(self.which), np.nan)
        left = np.flatnonzero(self.which == UNSETTLED)
        if len(left):
            mean, error, last = growth(self.strobe, self.point[left], self.X[:, left], self.exponents)
            exponent[left], self.X[:, left] = mean, last
            self.which[left[np.isnan(mean)]] = FAILED
            wild = [i for i in left[mean > 3.0 * error] if not self.order_of(int(i), NEAR)]
            self.which[wild] = CHAOTIC
        return exponent

    def find_two_frequencies(self, exponent: Any) -> None:
        """Give members of a second frequency beside the load, whose motion never repeats, to such motions."""
        left = np.flatnonzero(self.which == UNSETTLED)
        if not len(left):
            return
        many, record = self.strobe.record(self.point[left], self.X[:, left], STROBES)
        for k, i in enumerate(left):
            lines = two_frequencies(record[..., k], self.scale(self.late[..., i]), driven=True)
            if lines is None:
                continue
            point = int(self.point[i])
            known = ((n, other) for n in self.at.get(point, []) if (other := self.found[n].lines) is not None)
            number = lines.number_among(known, 1.0 / STROBES, len(self.found))
            if number == len(self.found):
                growing = np.exp(np.array([exponent[i] * self.strobe.period[point]]))
                peak, impacts, force = (
                    {name: value[..., k][()] / per for name, value in table.items()}
                    for table, per in ((many.peak, 1.0), (many.impacts, STROBES), (many.peak_force, 1.0))
                )
                orbit, strobes = ShotOrbit(self.X[:, i].copy(), growing), self.late[..., i]
                self.found.append(FoundOrbit(point, orbit, NEVER, strobes, peak, impacts, force, {}, lines=lines))
                self.at.setdefault(point, []).append(number)
            self.which[i] = number
            self.found[number].members.append(int(i))

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
    every = [{path: float(value[i]) for path, value in values.items()} for i in range(len(period))]
    for one, span in zip(every, period, strict=True):
        check_period(scene.with_(one), starts.t, float(span), steps)
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
