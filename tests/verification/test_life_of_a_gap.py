"""Gaps that wear at a rate that is a known function of them: depths and life against SciPy, and intervals that hold."""

from __future__ import annotations

from collections.abc import Callable
from math import log

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from gapbeam.studies.life.worn_march import Blocks, DepthRates, Worn, wear_down, wear_to_limits

LIMIT, GAP, FASTEST = 1.0e-4, 1.0e-4, 1.0e-12  # m, m, m/s
Law = Callable[[np.ndarray], np.ndarray]


def growing(depth: np.ndarray) -> np.ndarray:
    """The wider the gap, the harder the impacts."""
    return FASTEST * (1.0 + depth / GAP) ** 2


def falling(depth: np.ndarray) -> np.ndarray:
    """The wider the gap, the rarer the impacts."""
    return FASTEST / (1.0 + depth / GAP)


def resonant(depth: np.ndarray) -> np.ndarray:
    """A motion that fits the gap at one depth."""
    return FASTEST * (0.3 + np.exp(-(((depth - 0.5 * LIMIT) / (0.15 * LIMIT)) ** 2)))


def coupled(depth: np.ndarray) -> np.ndarray:
    """Two supports: the wider one leaves the load to the other."""
    total = np.sum(depth)
    return FASTEST * np.array([1.0 + depth[1] / GAP, 0.7 + 2.0 * depth[0] / (GAP + total)])


def exact(law: Law, faces: int) -> tuple[float, Callable[[float], np.ndarray]]:
    """Return the life and the depths over time, of SciPy to 1e-10."""

    def done(_time: float, depth: np.ndarray) -> float:
        return float(depth.max() - LIMIT)

    done.terminal = True  # type: ignore[attr-defined]
    span = (0.0, 20.0 * LIMIT / FASTEST)
    found = solve_ivp(
        lambda _time, depth: law(depth),
        span,
        np.zeros(faces),
        method="DOP853",
        rtol=1e-11,
        atol=1e-16,
        events=done,
        dense_output=True,
    )
    return float(found.t_events[0][0]), found.sol


def rates_of(law: Law, spread: float = 0.0, seed: int = 0) -> Callable[[np.ndarray, int], DepthRates]:
    """Return a law as runs find it: with an error of one standard deviation, and its interval of two."""

    def rate_at(depth: np.ndarray, number: int) -> DepthRates:
        wrong = np.random.default_rng([seed, number]).standard_normal(len(depth))
        values = law(depth) * np.exp(spread * wrong)
        factor = np.exp(1.96 * spread)
        return DepthRates(values, values / factor, values * factor, ("good",) * len(depth))

    return rate_at


LAWS: dict[str, tuple[Law, int]] = {
    "growing": (growing, 1),
    "falling": (falling, 1),
    "resonant": (resonant, 1),
    "coupled": (coupled, 2),
}


def life_of(found: Worn) -> float:
    """Return the life of a march that reached its limit."""
    assert found.reason == "reached"
    assert found.life is not None
    return found.life


@pytest.mark.parametrize("name", LAWS)
def test_depths_and_life_are_those_of_the_equation(name: str) -> None:
    """Depths within 1 % of the limit and the life within 2 %, and within the error that is reported.

    Blocks of half the length change the life by less than that.
    """
    law, faces = LAWS[name]
    life, depths = exact(law, faces)
    found, halved = (wear_down(rates_of(law), faces, Blocks(LIMIT, runs=400, factor=factor)) for factor in (1.0, 0.5))
    assert life_of(found) == pytest.approx(life, rel=0.02)
    assert abs(life_of(found) - life) < found.block_error
    assert abs(life_of(found) - life_of(halved)) < found.block_error
    assert found.chance == 0.0
    for state in found.states:
        assert state.depths == pytest.approx(depths(state.time), abs=0.01 * LIMIT)
    assert found.states[-1].depths.max() == pytest.approx(LIMIT, rel=1e-9)


@pytest.mark.parametrize(("limits", "first"), [((1.0, 1.0), 0), ((0.5, 1.0), 0), ((2.0, 0.4), 1)])
def test_the_first_limit_of_several(limits: tuple[float, float], first: int) -> None:
    """Two faces with limits of their own: which one ends the life, when, and how deep the other is then."""
    ends = LIMIT * np.array(limits)

    def done(_time: float, depth: np.ndarray) -> float:
        return float((depth / ends).max() - 1.0)

    done.terminal = True  # type: ignore[attr-defined]
    span = (0.0, 20.0 * LIMIT / FASTEST)
    exactly = solve_ivp(lambda _time, depth: coupled(depth), span, np.zeros(2), rtol=1e-10, atol=1e-16, events=done)
    found = wear_to_limits(rates_of(coupled), ends, Blocks(1.0, runs=400))
    assert found.first == first == int(np.argmax(exactly.y[:, -1] / ends))
    assert life_of(found) == pytest.approx(exactly.t[-1], rel=0.005)
    assert abs(life_of(found) - exactly.t[-1]) < found.block_error
    assert found.states[-1].depths == pytest.approx(exactly.y[:, -1], rel=0.01)
    assert found.states[-1].rates.values == pytest.approx(coupled(exactly.y[:, -1]), rel=0.02)


def test_the_last_block_ends_at_the_limit_of_a_linear_law() -> None:
    """dd/dt = w (1 + d / g): the life is g / w ln(1 + limit / g)."""
    found = wear_down(rates_of(lambda depth: FASTEST * (1.0 + depth / GAP)), 1, Blocks(LIMIT))
    assert life_of(found) == pytest.approx(GAP / FASTEST * log(2.0), rel=0.005)


@pytest.mark.parametrize("spread", [0.03, 0.15])
def test_intervals_hold_the_life(spread: float) -> None:
    """Rates with chance in them: the interval holds the exact life in at least 90 % of 200 lives, and is not wide."""
    life, _ = exact(growing, 1)
    lives = [wear_down(rates_of(growing, spread, seed), 1, Blocks(LIMIT)) for seed in range(200)]
    assert all(found.reason == "reached" for found in lives)
    inside = sum(found.low <= life <= found.high for found in lives if found.low and found.high)
    assert inside >= 180
    assert np.median([found.high / found.low for found in lives if found.low and found.high]) < 1.0 + 6.0 * spread
    assert np.mean([found.runs for found in lives]) <= 15.0


@pytest.mark.parametrize("law", [growing, falling, resonant])
@pytest.mark.parametrize("share", [0.02, 0.6])
def test_intervals_hold_the_depth_after_a_time(law: Law, share: float) -> None:
    """At a time before the limit the interval holds the exact depth in at least 90 % of 200 marches."""
    spread, (life, depths) = 0.1, exact(law, 1)
    marches = [wear_down(rates_of(law, spread, seed), 1, Blocks(LIMIT, longest=share * life)) for seed in range(200)]
    assert {found.reason for found in marches} == {"time"}
    depth = float(depths(share * life)[0])
    ends = np.array([[end[0] for end in found.depth_interval] for found in marches])
    assert np.sum((ends[:, 0] <= depth) & (depth <= ends[:, 1])) >= 180
    assert np.median(ends[:, 1] / ends[:, 0]) < 1.0 + 6.0 * spread


def test_what_does_not_wear_through_says_why() -> None:
    """No slip at all, slip that ends, too little time, too few runs."""
    still = wear_down(rates_of(lambda depth: 0.0 * depth), 2, Blocks(LIMIT))
    assert (still.reason, still.life, still.first, still.runs) == ("nothing slides", None, None, 1)
    ends = wear_down(rates_of(lambda depth: FASTEST * (depth < 0.4 * LIMIT)), 1, Blocks(LIMIT))
    assert (ends.reason, ends.life) == ("nothing slides", None)
    life, depths = exact(growing, 1)
    early = wear_down(rates_of(growing), 1, Blocks(LIMIT, longest=0.5 * life))
    assert (early.reason, early.life) == ("time", None)
    assert early.states[-1].time == pytest.approx(0.5 * life)
    assert early.states[-1].depths == pytest.approx(depths(0.5 * life), rel=0.02)
    few = wear_down(rates_of(growing), 1, Blocks(LIMIT, runs=4))
    assert (few.reason, few.runs, few.life) == ("runs", 4, None)
