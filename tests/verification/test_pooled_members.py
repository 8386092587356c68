"""Members of an ensemble, pooled: their interval covers, and members of two motions disagree."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from gapbeam.solver.diagnostics.statistics.batch_interval import interval_of_mean
from gapbeam.solver.diagnostics.statistics.run_statistics import DISAGREE, pooled_figures
from gapbeam.studies.sweep.sweep_tables import ensemble_words, ensembles_of
from tests.verification.test_interval_coverage import ornstein_uhlenbeck

RELAXATIONS = 110
DRAWS = 200


def member(series: np.ndarray, verdict: str = "good", **others: Any) -> dict[str, Any]:
    """Return what the statistics of a member describe: the mean, the rms and the mean square of a record."""
    square = interval_of_mean(series**2, positive=True)
    found = {
        "probe.tip.mean": interval_of_mean(series),
        "probe.tip.rms": square.root(),
        "face.stop.work_rate": square,
        "probe.tip.high": square,
    }
    figures = [
        {"name": name, "unit": "m", "value": one.value, "low": one.low, "high": one.high, "relative": one.relative,
         "effective_samples": 55.0, "verdict": verdict}
        for name, one in found.items()
    ]  # fmt: skip
    return {"seconds": float(len(series)), "burn_in": 0.0, "figures": figures} | others


def ensemble(draw: int, members: int) -> dict[str, dict[str, Any]]:
    series = [ornstein_uhlenbeck(1000 * draw + number, RELAXATIONS) for number in range(members)]
    return {one["name"]: one for one in pooled_figures([member(one) for one in series])}


@pytest.mark.parametrize("members", [2, 6])
def test_pooled_intervals_cover(members: int) -> None:
    """92.5 to 98 % of 200 ensembles hold the mean 0, the rms 1 and the mean square 1; few members disagree."""
    found = [ensemble(draw, members) for draw in range(DRAWS)]
    for name, truth in (("probe.tip.mean", 0.0), ("probe.tip.rms", 1.0), ("face.stop.work_rate", 1.0)):
        held = np.mean([one[name]["low"] <= truth <= one[name]["high"] for one in found])
        assert 0.92 <= held <= 0.985, name
        assert np.mean([one[name]["verdict"] == DISAGREE for one in found]) <= 0.04, name
    assert "probe.tip.high" not in found[0], "percentiles have no mean"


def test_more_members_know_more() -> None:
    """The interval of 8 is half as wide as that of 2, on four times the time; the variance over time stays."""
    few, many = ([ensemble(draw, members)["face.stop.work_rate"] for draw in range(40)] for members in (2, 8))
    widths = [np.mean([one["relative"] for one in found]) for found in (few, many)]
    assert widths[0] / widths[1] == pytest.approx(2.0, rel=0.1)
    variances = [np.mean([one["relative_variance_times_time"] for one in found]) for found in (few, many)]
    assert variances[0] == pytest.approx(variances[1], rel=0.15)
    one = many[0]
    assert one["time_for_2_percent"] == pytest.approx(8 * 2000.0 * (one["relative"] / 0.02) ** 2)
    assert one["effective_samples"] == 8 * 55.0
    expected = (math.log(one["high"] / one["value"]) / 2.0) ** 2 * 8 * 2000.0
    assert one["relative_variance_times_time"] == pytest.approx(expected, rel=0.08)


def test_members_of_two_motions_disagree() -> None:
    series = [ornstein_uhlenbeck(number, RELAXATIONS) * (1.0 if number % 2 else 2.0) for number in range(4)]
    found = {one["name"]: one["verdict"] for one in pooled_figures([member(one) for one in series])}
    assert found["probe.tip.rms"] == DISAGREE
    good = [member(ornstein_uhlenbeck(number, RELAXATIONS)) for number in range(3)]
    short = member(ornstein_uhlenbeck(3, RELAXATIONS), "too short")
    assert {one["verdict"] for one in pooled_figures([*good, short])} == {"too short"}
    assert pooled_figures(good[:1]) == pooled_figures([good[0], good[1] | {"figures": []}]) == []


def test_points_that_differ_in_seeds_only_are_an_ensemble() -> None:
    """By the other keys; what failed, a repeated seed and a point alone are left out."""

    def record(seed: int, velocity: str, **others: Any) -> dict[str, Any]:
        values = {"load.lift.seed": str(seed), "load.lift.spectrum.velocity": velocity}
        found = member(ornstein_uhlenbeck(seed, RELAXATIONS))
        return {"values": values, "verdict": "passed", "statistics": found} | others

    records = [record(seed, velocity) for velocity in ("3", "4") for seed in (1, 2, 3)]
    records += [record(1, "3"), record(4, "4", verdict="failed"), record(1, "5")]
    first, second = ensembles_of(records)
    assert (first.values, first.members) == ({"load.lift.spectrum.velocity": "3"}, 3)
    assert (second.members, second.seconds) == (3, 6000.0)
    words = ensemble_words(second)
    assert "least certain: face.stop.work_rate" in words
    assert "independent samples, relative variance" in words
    assert "of each member" in words
    assert ensembles_of([{"values": {"a": "1"}, "verdict": "passed", "statistics": member(np.ones(2000))}]) == []
