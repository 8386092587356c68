"""How many impacts steps miss: against touches and partings whose durations are known, and what it does to verdicts."""

from __future__ import annotations

import numpy as np
import pytest

from gapbeam.solver.diagnostics.contact_episodes import MOST, ImpactList
from gapbeam.solver.diagnostics.statistics.batch_interval import MOST_MISSED, Interval, missed_share
from gapbeam.solver.diagnostics.statistics.statistic_figures import Doubts, StatisticFigure

STEP = 0.1  # s


def seen_of(touches: np.ndarray) -> ImpactList:
    """Return the impacts that looks once a step show of touches with begin and end, (count, 2), s."""
    found = ImpactList()
    closed = np.floor(touches / STEP)
    begin, end = touches[closed[:, 0] < closed[:, 1]].T  # a look falls into the touch
    parted = np.append(True, np.floor(begin[1:] / STEP) > np.floor(end[:-1] / STEP))  # and one into the parting
    first = np.flatnonzero(parted)
    last = np.append(first[1:], len(begin)) - 1
    rows = np.zeros((len(first), 4))
    rows[:, 0], rows[:, 3] = begin[first], end[last] - begin[first]
    found.add(rows)
    return found


def touches_of(touch: float, parting: float, least: float, count: int = 3900) -> np.ndarray:
    """Return touches and partings of even durations up to so many steps, the latter from so many on."""
    draw = np.random.default_rng(3)
    durations = STEP * np.column_stack([draw.uniform(least, parting, count), draw.uniform(0.0, touch, count)])
    return np.cumsum(durations.ravel()).reshape(-1, 2)


@pytest.mark.parametrize("touch", [3.0, 12.0])
def test_as_many_touches_are_missed_as_are_seen_to_be_short(touch: float) -> None:
    """Of touches of 0 to n steps, 1 / (2 n) are missed: of 3900, 16.7 and 4.2 %, within three standard errors."""
    seen = seen_of(touches_of(touch, 30.0, 5.0))
    assert seen.count == pytest.approx(3900 * (1.0 - 0.5 / touch), rel=0.02)
    exact = 0.5 / touch / (1.0 - 0.5 / touch)
    assert missed_share(seen, STEP) == pytest.approx(exact, abs=3.0 * np.sqrt(exact / 3900))


def test_short_partings_count_as_well() -> None:
    """Partings of 0 to 10 steps between long touches: one in 20 is missed, and two impacts count as one."""
    touches = touches_of(20.0, 10.0, 0.0)
    seen = seen_of(touches)
    missed = 3900 / seen.count - 1.0
    assert missed > 0.05
    assert missed_share(seen, STEP) == pytest.approx(missed, abs=0.02)


def test_long_touches_miss_nothing() -> None:
    """Nor do none at all; partings count where only some of the impacts are kept, too."""
    rows = np.column_stack([np.arange(MOST + 1.0), np.ones(MOST + 1), np.ones(MOST + 1), np.full(MOST + 1, 0.95)])
    whole, thinned = ImpactList(), ImpactList()
    whole.add(rows[:100])
    thinned.add(rows)
    assert missed_share(ImpactList(), STEP) == 0.0
    assert missed_share(whole, STEP) == pytest.approx(0.99)
    assert thinned.every == 2
    assert missed_share(thinned, STEP) == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize(
    ("name", "share", "verdict"),
    [
        ("face.a.b.impact_rate", 2.0 * MOST_MISSED, "not resolved"),
        ("face.a.b.impact_impulse", 2.0 * MOST_MISSED, "not resolved"),
        ("face.a.b.impact_rate", 0.5 * MOST_MISSED, "good"),
        ("face.a.b.contact_share", 2.0 * MOST_MISSED, "not resolved"),
        ("face.a.b.rms_force", 2.0 * MOST_MISSED, "not resolved"),
        ("face.a.b.rms_force", 0.5 * MOST_MISSED, "good"),
        ("face.a.b.mean_force", 1.0, "good"),
        ("face.a.b.work_rate", 1.0, "good"),
        ("probe.a.b.impact_rate", 1.0, "good"),
    ],
)
def test_only_figures_that_count_impacts_are_doubted(name: str, share: float, verdict: str) -> None:
    """By the face that they are of."""
    figure = StatisticFigure(name, "1/s", Interval(0.9, 1.0, 1.1), 100.0, 0.1, "good", 10.0)
    assert figure.doubted(Doubts({"a.b": share, "c": 1.0})).verdict == verdict
    assert figure.doubted(Doubts()).verdict == "good"
