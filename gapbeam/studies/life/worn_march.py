"""March of wear in blocks of time: depth of each face as gaps grow, and life until the first reaches its limit.

    dd/dt = r(d)

d are the depths of all faces, r their rates, which a run finds on the gaps as they are, with an interval. A block of
the length h takes one run:

    P = d_n + h (r_n + h / (2 h') (r_n - r_n-1)),    r_n+1 = r(P),    d_n+1 = C = d_n + h (r_n + r_n+1) / 2,

the predictor of Adams and Bashforth behind a block of the length h' (in the first block that of Euler), and the
trapezoidal rule. |C - P| / 2 is the error estimate of the block, about three times the error of C where rates are
smooth. Blocks become shorter where it is too large, and more than chance: r has an interval, and so has C - P, whose
variance is taken from the square of the estimate.

A rate that is wrong by dr for the time h shifts all that follows by h dr / r, and no more, as r depends on d alone. Of
the face that reaches the limit first, the errors of the blocks are thus added up as times: their sizes, and beside
them the square root of the sum of the squares of half of the intervals. What errors at one face change at another one
is left out. Faces whose lives end at different depths are marched as shares of their limits.

Source: Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I (1993), sections III.1 and III.5.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from math import exp, inf, sqrt
from typing import Literal

import numpy as np

FIRST = 1.0 / 16.0  # of the limit: the first block, whose predictor is the simplest
LONGEST = 0.25  # of the limit
SHORTEST = 1.0e-3
BEYOND = 1.1  # of the last block, up to which its parabola is followed
WHOLE = 1.25  # of a block, which is not left as two
CHANCE = 2.0  # of what the intervals explain of C - P: more is curvature
SAFETY, GROWTH, CUT = 0.8, 2.0, 0.25

Reason = Literal["reached", "nothing slides", "time", "runs"]


@dataclass(frozen=True)
class DepthRates:
    """Rates of all faces on given gaps.

    Attributes:
        values: (faces,), m/s, at least 0.
        low: Lower ends of their 95 % intervals.
        high: Upper ends.
        verdicts: Verdicts on each interval: good, biased, too short, not settled, no event.
    """

    values: np.ndarray
    low: np.ndarray
    high: np.ndarray
    verdicts: tuple[str, ...]

    @property
    def spread(self) -> np.ndarray:
        """Half of the width of each interval, that of its logarithm times the rate, (faces,), m/s."""
        known = (self.values > 0.0) & (self.low > 0.0)
        ratio = np.divide(self.high, self.low, out=np.ones_like(self.values), where=known)
        return np.where(known, 0.5 * self.values * np.log(ratio), 0.5 * (self.high - self.low))

    def at(self, values: np.ndarray) -> DepthRates:
        """Return other rates, (faces,), m/s, that are known as well as these, in proportion."""
        share = np.divide(values, self.values, out=np.ones_like(values), where=self.values > 0.0)
        return DepthRates(values, share * self.low, share * self.high, self.verdicts)


RateAt = Callable[[np.ndarray, int], DepthRates]
"""Rates at depths (faces,), m; the second argument counts the calls, so that each has its own chance."""


@dataclass(frozen=True)
class WornState:
    """The faces at the end of a block.

    Attributes:
        time: s.
        depths: (faces,), m.
        rates: There.
        errors: Errors of the depths that the block has added, as estimated, (faces,), m.
    """

    time: float
    depths: np.ndarray
    rates: DepthRates
    errors: np.ndarray


@dataclass(frozen=True)
class Blocks:
    """Settings of a march of wear.

    Attributes:
        limit: Depth at which it ends, m.
        tolerance: Largest share of the depth of a block that its error may be.
        longest: Time after which it ends, s.
        runs: Rates that it may ask for.
        factor: Factor by which all blocks are longer than they would be.
    """

    limit: float
    tolerance: float = 0.02
    longest: float = inf
    runs: int = 40
    factor: float = 1.0


@dataclass(frozen=True)
class Worn:
    """Result of a march of wear.

    Attributes:
        states: States at the start and at the end of each block.
        reason: Why it ended.
        first: The face that reached the limit first, or was deepest; None where nothing slides.
        life: Time at which it did, s; None: it did not.
        chance: Half of the 95 % interval of the logarithm of the life, from those of the rates.
        block_error: Error of the life by the length of the blocks, s.
        runs: Rates that were asked for.
    """

    states: tuple[WornState, ...]
    reason: Reason
    first: int | None
    life: float | None = None
    chance: float = 0.0
    block_error: float = 0.0
    runs: int = 1

    @property
    def low(self) -> float | None:
        """Lower end of the interval of the life, s: chance and blocks together."""
        return None if self.life is None else max(self.life * exp(-self.chance) - self.block_error, 0.0)

    @property
    def high(self) -> float | None:
        """Upper end, s."""
        return None if self.life is None else self.life * exp(min(self.chance, 700.0)) + self.block_error

    @property
    def depth_interval(self) -> tuple[np.ndarray, np.ndarray]:
        """The ends of the 95 % intervals of the depths at the end, (faces,) each, m: chance and blocks together."""
        depths = self.states[-1].depths
        chance, error = _depth_errors(self.states)
        share = np.divide(chance, depths, out=np.zeros_like(depths), where=depths > 0.0)
        growth = np.exp(np.minimum(share, 700.0))
        return np.maximum(depths / growth - error, 0.0), np.where(depths > 0.0, depths * growth, chance) + error


def wear_down(rate_at: RateAt, faces: int, blocks: Blocks) -> Worn:
    """March faces from no wear to the limit.

    Args:
        rate_at: Function that gives the rates.
        faces: Their number.
        blocks: Settings of the march.
    """
    start = np.zeros(faces)
    march = _March(rate_at, blocks, [WornState(0.0, start, rate_at(start, 0), np.zeros(faces))])
    return march.to_the_end()


@dataclass
class _March:
    """A march under way."""

    rate_at: RateAt
    blocks: Blocks
    states: list[WornState]
    length: float = field(init=False)
    runs: int = 1

    def __post_init__(self) -> None:
        self.length = FIRST * self.blocks.factor * self.blocks.limit

    def to_the_end(self) -> Worn:
        """March until there is a reason to end."""
        while True:
            last = self.states[-1]
            if not np.any(last.rates.values > 0.0):
                return self._ended("nothing slides")
            if last.time >= self.blocks.longest:
                return self._ended("time")
            if self.runs >= self.blocks.runs:
                return self._ended("runs")
            found = self._step(last)
            if found is None:
                continue
            self.states.append(found)
            if (life := self._reached(last, found)) is not None and life <= self.blocks.longest:
                return self._ended("reached", life)

    def _step(self, last: WornState) -> WornState | None:
        """Take a block; None: it was too long, and the next one is shorter."""
        h = self._time(last)
        predicted = last.depths + h * self._slope(last, h)
        rates = self.rate_at(predicted, self.runs)
        self.runs += 1
        depths = last.depths + 0.5 * h * (last.rates.values + rates.values)
        found, by_chance = 0.5 * np.abs(depths - predicted), self._chance(h, rates)
        errors = np.sqrt(np.maximum(found**2 - by_chance**2, 0.0))
        scale = float((depths - last.depths).max())
        share, chance = (float(each.max()) / scale if scale > 0.0 else 0.0 for each in (found, by_chance))
        curved = share > CHANCE * chance
        tolerance, limit = self.blocks.tolerance * self.blocks.factor**2, self.blocks.limit
        if curved and share > tolerance and self.length > SHORTEST * limit:
            self.length = min(self.length, scale) * min(max(SAFETY * sqrt(tolerance / share), CUT), 0.5)
            return None
        change = min(SAFETY * sqrt(tolerance / share), GROWTH) if curved else GROWTH
        self.length = min(self.length * change, LONGEST * self.blocks.factor * limit)
        return WornState(last.time + h, depths, rates, errors)

    def _time(self, last: WornState) -> float:
        """Return the length of the next block, s: no face becomes deeper than the limit, as far as is known."""
        rate, limit = float(last.rates.values.max()), self.blocks.limit
        h = self.length / rate
        for _ in range(3):  # the slope depends on the length
            slope = self._slope(last, h)
            moving = slope > 0.0
            left = float(((limit - last.depths[moving]) / slope[moving]).min()) if np.any(moving) else inf
            h = left if left <= WHOLE * self.length / rate else self.length / rate
        return max(min(h, self.blocks.longest - last.time), 1.0e-9 * self.length / rate)

    def _slope(self, last: WornState, h: float) -> np.ndarray:
        """Return the mean rates of the next block, as predicted, (faces,)."""
        values = last.rates.values
        if len(self.states) == 1:
            return values
        before = self.states[-2]
        step = last.time - before.time
        predicted = values + 0.5 * h / step * (values - before.rates.values)
        return np.asarray(np.clip(predicted, 0.5 * values, 2.0 * values))

    def _chance(self, h: float, rates: DepthRates) -> np.ndarray:
        """Return half of the uncertainty of C - P by the intervals of the rates, standard errors, (faces,), m."""
        last = self.states[-1]
        ratio, before = 0.0, np.zeros_like(rates.values)
        if len(self.states) > 1:
            ratio, before = h / (last.time - self.states[-2].time), self.states[-2].rates.spread
        squares = rates.spread**2 + ((1.0 + ratio) * last.rates.spread) ** 2 + (ratio * before) ** 2
        return 0.125 * h * np.sqrt(squares)  # an interval is two standard errors to either side

    def _reached(self, last: WornState, found: WornState) -> float | None:
        """Return the time at which the first face reaches the limit in a block, or just behind it, s."""
        h = found.time - last.time
        times = [
            _crossing(self.blocks.limit - depth, rate, (next_rate - rate) / h)
            for depth, rate, next_rate in zip(last.depths, last.rates.values, found.rates.values, strict=True)
        ]
        soonest = min(times)
        return last.time + soonest if soonest <= BEYOND * h else None

    def _ended(self, reason: Reason, life: float | None = None) -> Worn:
        states = self.states
        if reason == "nothing slides" and len(states) == 1:
            return Worn(tuple(states), reason, None, runs=self.runs)
        if life is None:
            return Worn(tuple(states), reason, int(np.argmax(states[-1].depths)), runs=self.runs)
        last, found = states[-2:]
        h, t = found.time - last.time, life - last.time
        bend = (found.rates.values - last.rates.values) / h
        depths = last.depths + last.rates.values * t + 0.5 * bend * t**2
        rates = found.rates.at(np.maximum(last.rates.values + bend * t, 0.0))
        states[-1] = WornState(life, depths, rates, found.errors * max(t / h, 1.0))
        first = int(np.argmax(depths))
        chance, error = _life_errors(states, first)
        return Worn(tuple(states), reason, first, life, chance / life, error, self.runs)


def _crossing(way: float, rate: float, bend: float) -> float:
    """Return the first time t > 0 at which rate t + bend t^2 / 2 is the way; infinite: never."""
    inside = rate**2 + 2.0 * bend * way
    if (rate <= 0.0 and bend <= 0.0) or inside < 0.0:
        return inf
    return 2.0 * way / (rate + sqrt(inside))


def _depth_errors(states: Sequence[WornState]) -> tuple[np.ndarray, np.ndarray]:
    """Return half of the 95 % intervals of the last depths, and the error by the blocks, (faces,) each, m.

    Errors shift what follows in time; at the end they are the shift times the rate of the last block.
    """
    if len(states) == 1:
        return np.zeros_like(states[0].depths), np.zeros_like(states[0].depths)
    shifts = np.array([_life_errors(states, face) for face in range(len(states[0].depths))])
    before, last = states[-2:]
    rate = (last.depths - before.depths) / (last.time - before.time)
    return shifts[:, 0] * rate, shifts[:, 1] * rate


def _life_errors(states: Sequence[WornState], face: int) -> tuple[float, float]:
    """Return half of the 95 % interval of the life, and its error by the blocks, s."""
    weights, error = np.zeros(len(states)), 0.0
    for number, (last, found) in enumerate(pairwise(states)):
        h = found.time - last.time
        mean = float(found.depths[face] - last.depths[face]) / h
        if mean <= 0.0:
            continue
        weights[number : number + 2] += 0.5 * h / mean
        error += float(found.errors[face]) / mean
    spreads = np.array([state.rates.spread[face] for state in states])
    return float(np.sqrt(np.sum((weights * spreads) ** 2))), error


def wear_to_limits(rate_at: RateAt, limits: np.ndarray, blocks: Blocks) -> Worn:
    """March faces from no wear to the limit of the first, as `wear_down` does for one limit.

    A depth over its limit is 1 where the life of the face ends; so is the limit of `wear_down` here.

    Args:
        rate_at: Function that gives the rates, m/s, at depths in m.
        limits: Depth at which the life of each face ends, (faces,), m.
        blocks: Settings of the march; the limit is 1.
    """
    worn = wear_down(lambda shares, number: _times(rate_at(shares * limits, number), 1.0 / limits), len(limits), blocks)
    return replace(worn, states=tuple(_in_meters(state, limits) for state in worn.states))


def _in_meters(state: WornState, limits: np.ndarray) -> WornState:
    return WornState(state.time, state.depths * limits, _times(state.rates, limits), state.errors * limits)


def _times(rates: DepthRates, factors: np.ndarray) -> DepthRates:
    return DepthRates(rates.values * factors, rates.low * factors, rates.high * factors, rates.verdicts)
