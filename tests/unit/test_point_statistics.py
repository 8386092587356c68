"""Statistics of every contact point: few blocks, behind the same burn-in, kept and restored."""

from __future__ import annotations

import numpy as np
import pytest

from gapbeam.solver.diagnostics.statistics.batch_interval import BlockEnds
from gapbeam.solver.diagnostics.statistics.run_statistics import FEW, SUMMED, PointStatistics

INTERVAL, COUNT, POINTS = 1.0e-3, 5000, 3


def empty() -> PointStatistics:
    return PointStatistics(("stop",), (), False, INTERVAL, slides=True, points=POINTS, most_blocks=FEW)


def records(first: int, last: int) -> dict[str, np.ndarray]:
    """Return records of a face whose points slide at the rates 1, 2 and 3 W, with noise."""
    done = np.cumsum((1.0 + np.arange(POINTS)) * np.random.default_rng(2).exponential(size=(COUNT, POINTS)), axis=0)
    work = INTERVAL * done
    rows = {name: work.sum(axis=1, keepdims=True) for name in (*SUMMED, "sliding_work")}
    parts = work.sum(axis=1)[:, None, None] * np.array([0.25, 0.75, 0.0])
    rows |= {"time": INTERVAL * np.arange(COUNT), "point_work": work, "work_by_mode": parts}
    return {name: values[first:last] for name, values in rows.items()}


def test_points_and_parts_have_the_rates_that_they_were_given() -> None:
    """Each within its interval, which is some 10 % wide; the part that nothing does has no event."""
    found = empty()
    found.see(records(0, COUNT))
    assert FEW / 2 <= len(found.point_blocks.changes) <= FEW
    for rate, one in zip((1.0, 2.0, 3.0), found.work_rates(), strict=True):
        assert one.low < rate < one.high
        assert one.relative < 0.15
    figures = {one.name: one for one in found.figures()}
    assert figures["face.stop.impact_work_rate"].interval.value == pytest.approx(
        0.25 * figures["face.stop.work_rate"].interval.value, rel=1e-9
    )
    assert figures["face.stop.sticking_work_rate"].verdict == "no event"


def test_statistics_go_on_where_they_were_kept() -> None:
    whole, part = empty(), empty()
    whole.see(records(0, COUNT))
    part.see(records(0, 1234))
    after = empty()
    after.restore(part.as_json())
    after.see(records(1234, COUNT))
    assert after.work_rates() == whole.work_rates()
    assert after.figures() == whole.figures()
    with pytest.raises(ValueError, match="reshape"):
        empty().restore(part.as_json() | {"point_work": [0.0]})


def test_records_at_other_distances_are_left_out() -> None:
    """As those of all other figures: points still add up to their face."""
    rows = records(0, COUNT)
    kept = np.ones(COUNT, dtype=bool)
    kept[2000:2007] = False
    found = empty()
    found.see({name: values[:1500] for name, values in rows.items()})
    found.see({name: values[kept][1500:] for name, values in rows.items()})
    whole = {one.name: one for one in found.figures()}["face.stop.work_rate"].interval.value
    assert sum(one.value for one in found.work_rates()) == pytest.approx(whole, rel=0.02)
    blocks = BlockEnds(1, 4)
    blocks.begin(np.zeros(1))
    for last in range(1, 12):
        blocks.add(np.array([[float(last**2)]]))
    assert blocks.length == 4
    assert blocks.changes[:, 0] == pytest.approx([4.0, 12.0])


def test_short_records_have_none() -> None:
    short = empty()
    short.see(records(0, 40))
    assert short.work_rates() == []
    assert short.point_series().shape == (0, POINTS)
