"""Intervals of means against processes whose means are known: do 95 of 100 intervals hold the truth?"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import norm

from gapbeam.solver.diagnostics.statistics.batch_interval import (
    MOST,
    BlockMeans,
    batch_means,
    burn_in,
    correlation_time,
    interval_of_mean,
    interval_of_percentile,
    kendall,
    standard_error,
    stopping_interval,
    verdict_on,
)

SEEDS = 300
VALUES = 2000


def ornstein_uhlenbeck(seed: int, relaxations: float, values: int = VALUES) -> np.ndarray:
    """A stationary process of mean 0, variance 1 and correlation exp(-t / tau), sampled exactly."""
    draw = np.random.default_rng(seed).standard_normal(values + 1)
    a = np.exp(-relaxations / values)
    return np.asarray(lfilter([1.0], [1.0, -a], np.sqrt(1.0 - a * a) * draw[1:], zi=[a * draw[0]])[0])


def ensemble(relaxations: float) -> list[np.ndarray]:
    return [ornstein_uhlenbeck(seed, relaxations) for seed in range(SEEDS)]


@pytest.mark.parametrize("relaxations", [110, 220, 2000])
def test_long_records_cover_as_promised(relaxations: float) -> None:
    """A mean, a mean square, a percentile and the interval that ends a run: 92 to 98 % of 300 hold the truth."""
    series, high = ensemble(relaxations), float(norm.ppf(0.95))
    found = {
        "mean": (0.0, [interval_of_mean(one) for one in series]),
        "mean square": (1.0, [interval_of_mean(one**2, positive=True) for one in series]),
        "percentile": (high, [interval_of_percentile(one, 0.95) for one in series]),
    }
    for name, (truth, intervals) in found.items():
        assert 0.92 <= np.mean([one.low <= truth <= one.high for one in intervals]) <= 0.98, name
    assert np.mean([abs(stopping_interval(one).value) <= stopping_interval(one).half_width for one in series]) >= 0.93


def test_records_just_long_enough_cover_nine_in_ten() -> None:
    """With 55 relaxation times, which are judged good, at least 90 % of the intervals hold the truth."""
    series = ensemble(55)
    assert np.mean([verdict_on(one) == "good" for one in series]) > 0.8
    squares = [interval_of_mean(one**2, positive=True) for one in series]
    assert np.mean([one.low <= 1.0 <= one.high for one in squares]) >= 0.9
    assert np.mean([abs(one.value) <= one.half_width for one in map(interval_of_mean, series)]) >= 0.9


@pytest.mark.parametrize("relaxations", [2, 5, 10])
def test_short_records_are_judged_too_short(relaxations: float) -> None:
    """Where intervals cover too little, at most one in eight records passes."""
    verdicts = [verdict_on(one) for one in ensemble(relaxations)]
    assert np.mean([verdict == "good" for verdict in verdicts]) <= 0.12


def test_long_records_raise_few_false_alarms() -> None:
    """Of records of 220 relaxation times and of independent values, at most 2 % are judged bad."""
    for relaxations in (220, 2000):
        assert np.mean([verdict_on(one) != "good" for one in ensemble(relaxations)]) <= 0.02


@pytest.mark.parametrize("decays", [1.0, 3.0])
def test_decays_are_found(decays: float) -> None:
    """The squares of a ringing that fades by e to e^3 over the record are not settled, whatever noise is in them."""
    time = np.linspace(0.0, 1.0, VALUES)
    fading = np.exp(-decays * time)
    found = [verdict_on(fading * (1.0 + 0.3 * np.random.default_rng(seed).standard_normal(VALUES)))
             for seed in range(100)]  # fmt: skip
    assert set(found) == {"not settled"}


def test_rare_events_need_one_in_every_batch() -> None:
    """Impacts in half of the record only give no interval of their rate."""
    draw = np.random.default_rng(1)
    rate = (draw.random(VALUES) < 0.05).astype(float)
    assert verdict_on(rate, rare=True) == "good"
    rate[VALUES // 2 : VALUES // 2 + VALUES // 8] = 0.0
    assert verdict_on(rate, rare=True) == "too short"


def test_correlation_time_is_the_relaxation_time() -> None:
    """Within 5 % on average of 1000 relaxation times; independent values count one by one."""
    tau = VALUES / 1000
    exact = 0.5 / np.tanh(0.5 / tau)  # of the sampled process: h (1/2 + sum of a^k)
    found = [correlation_time(one) for one in ensemble(1000)]
    assert np.mean(found) == pytest.approx(exact, rel=0.05)
    independent = np.random.default_rng(3).standard_normal(20_000)
    assert correlation_time(independent) == pytest.approx(0.5, rel=0.05)


def test_standard_error_of_independent_batches() -> None:
    """Without correlation the squared error is that of textbooks, up to a half more by the clipped correlation."""
    found = [standard_error(np.random.default_rng(seed).standard_normal(10)) for seed in range(2000)]
    assert 0.1 <= np.mean(np.square(found)) <= 0.15
    assert standard_error(np.ones(10)) == 0.0
    assert batch_means(np.arange(23.0), 10) == pytest.approx(np.arange(10) * 2 + 3.5)


def test_kendall_is_that_of_scipy() -> None:
    from scipy.stats import kendalltau

    values = np.random.default_rng(5).standard_normal(20)
    assert kendall(values) == pytest.approx(kendalltau(np.arange(20), values).statistic, abs=1e-12)


def test_burn_in_follows_the_slowest_series() -> None:
    """A tenth of fast series; 5 relaxation times of slow ones; never more than a third."""
    fast = np.random.default_rng(7).standard_normal(VALUES)
    assert burn_in([fast]) == VALUES // 10
    slow = [ornstein_uhlenbeck(seed, 30.0) for seed in range(40)]
    assert VALUES / 10 < np.mean([burn_in([fast, one]) for one in slow]) < VALUES / 3
    assert burn_in([fast, ornstein_uhlenbeck(1, 3.0)]) == round(VALUES / 3)


@pytest.mark.parametrize("pieces", [1, 7, 2048, 5000])
def test_blocks_do_not_depend_on_how_records_come(pieces: int) -> None:
    """Sums to the same bits from single records and from many at once, before and after blocks were joined."""
    values = np.random.default_rng(11).standard_normal((3 * MOST + 77, 3))
    one, other = BlockMeans(3), BlockMeans(3)
    for row in values:
        one.add(row[None])
    for first in range(0, len(values), pieces):
        other.add(values[first : first + pieces])
    assert np.array_equal(one.means, other.means)
    assert one.length == 4
    assert one.records == len(values)
    used = one.length * len(one.means)
    assert one.means == pytest.approx(values[:used].reshape(-1, one.length, 3).mean(axis=1))
    assert np.array_equal(one.ends, values[one.length - 1 : used : one.length])
    kept = BlockMeans(3)
    kept.restore(other.as_json())
    kept.add(values[:100])
    other.add(values[:100])
    assert np.array_equal(kept.means, other.means)
    with pytest.raises(ValueError, match="expected finite"):
        kept.restore(other.as_json() | {"waiting": 9})
