"""Doubts on figures of random motions: by impacts that steps missed, and by the bias of a scheme."""

from __future__ import annotations

import numpy as np
import pytest

from gapbeam.solver.diagnostics.statistics.batch_interval import Interval
from gapbeam.solver.diagnostics.statistics.run_statistics import SUMMED, RunStatistics
from gapbeam.solver.diagnostics.statistics.statistic_figures import Doubts, StatisticFigure, may_be_asked
from gapbeam.solver.integrators.scheme_choice import USUAL, scheme_of
from gapbeam.solver.integrators.time_scheme import NoiseBias, bias_at
from gapbeam.solver.messages.errors import IntervalNotMet
from gapbeam.solver.run.stop_rule import StopRule, refuse_not_met, statistics_words

TABLE = (NoiseBias(1.0, -0.3, 0.4, -0.5, -0.8, 0.0), NoiseBias(2.0, -0.2, 0.1, -0.4, -0.2, 0.0))
RATE, RMS = "face.stop.impact_rate", "probe.tip.rms"


def gathered() -> RunStatistics:
    """Return statistics of a face that closes at random, and a probe, over many relaxation times."""
    rng = np.random.default_rng(5)
    count, interval = 4000, 1.0e-3
    place = np.zeros((count, 1, 3))
    place[:, 0, -1] = rng.standard_normal(count)
    sums = {name: np.cumsum(1.0 + rng.random((count, 1)), axis=0) for name in SUMMED}
    sums |= {"sliding_work": sums["impulse"], "work_by_mode": np.repeat(sums["impulse"][:, :, None] / 3.0, 3, axis=2)}
    found = RunStatistics(("stop",), ("tip",), False, interval, slides=True)
    found.see(sums | {"time": interval * np.arange(count), "displacement": place, "acceleration_absolute": place})
    return found


def test_biases_between_and_beyond_rows() -> None:
    """Even in the logarithm of the steps; half a row of the last ratio later; never smaller below the first row."""
    assert bias_at(TABLE, 1.0) == TABLE[0]
    assert bias_at(TABLE, 2.0) == pytest.approx(TABLE[1])
    assert bias_at(TABLE, 2.0**0.5) == pytest.approx((2.0**0.5, -0.25, 0.25, -0.45, -0.5, 0.0))
    assert bias_at(TABLE, 4.0) == pytest.approx((4.0, -0.2 * 2 / 3, 0.025, -0.32, -0.05, 0.0))
    assert bias_at(TABLE, 0.3) == (0.3, *TABLE[0][1:])
    assert bias_at((), 2.0) is None


def test_tables_hold_for_usual_parameters_only() -> None:
    assert USUAL.measured_bias
    assert scheme_of("generalized-alpha").measured_bias
    assert not scheme_of("generalized-alpha", rho_inf=0.1).measured_bias
    assert not scheme_of("central-difference").measured_bias
    assert not scheme_of("moreau-jean", restitution=1.0).measured_bias


def test_a_bias_is_a_doubt_where_it_is_wider_than_the_interval() -> None:
    """Of faces by the steps in their contacts, of probes by half of what the energy lacks."""
    doubts = Doubts(energy=-0.2, contacts={"stop": 2.0}, table=TABLE)
    expected = {"contact_share": 0.1, "mean_force": -0.4, "rms_force": -0.1, "impact_rate": 0.0, "work_rate": -0.5}
    for figure, bias in expected.items():
        assert doubts.bias(f"face.stop.{figure}") == pytest.approx(bias), figure
    assert doubts.bias("face.stop.approach_speed") is None
    assert doubts.bias("face.other.mean_force") == -0.2, "no contact: by the energy"
    assert (doubts.bias(RMS), doubts.bias("probe.tip.lateral_rms")) == (-0.1, -0.1)
    assert doubts.bias("probe.tip.mean") is None
    assert doubts.on(RMS, 0.05) == "biased"
    assert doubts.on(RMS, 0.15) is None
    figure = StatisticFigure(RMS, "m", Interval(1.0, 0.95, 1.05), 100.0, 0.1, "good", 10.0)
    assert figure.doubted(doubts).verdict == "biased"
    assert "10.0% too small" in doubts.words(RMS, "biased")


@pytest.mark.parametrize(
    ("name", "doubts", "words"),
    [
        (RATE, Doubts({"stop": 0.05}), "5.0% of the impacts"),
        (RMS, Doubts(energy=-0.3), "about 15.0% too small"),
        ("face.stop.impact_work_rate", Doubts(impact_steps=2.0), "counts as impact has 2 steps, and needs 6"),
        ("face.stop.sliding_work_rate", Doubts(impact_steps=5.9), "their sum is not concerned"),
        ("face.stop.impact_work_rate", Doubts({"stop": 0.05}), "5.0% of the impacts"),
    ],
)
def test_a_narrow_interval_in_doubt_is_not_met(name: str, doubts: Doubts, words: str) -> None:
    """Neither the summary nor the exit status say that it is; without the doubt both do."""
    statistics, rule = gathered(), StopRule(name, 0.1, 1.0)
    assert rule.met(statistics)
    refuse_not_met(rule.judge(statistics, 4.0, True, Doubts()))
    found = rule.judge(statistics, 4.0, True, doubts)
    assert (found["met"], found["narrow"], found["time_needed"]) == (False, True, None)
    with pytest.raises(IntervalNotMet, match="does not change that") as ended:
        refuse_not_met(found)
    assert words in str(ended.value)
    wide = rule.judge(statistics, 4.0, False, doubts)
    with pytest.raises(IntervalNotMet, match="besides, ") as ended:
        refuse_not_met(wide)
    assert words in str(ended.value)


def test_a_doubt_on_another_figure_does_not_matter() -> None:
    statistics = gathered()
    for name in (RMS, "face.stop.mean_force"):
        assert StopRule(name, 0.1, 1.0).judge(statistics, 4.0, True, Doubts({"stop": 0.5}))["met"]


def test_the_last_line_counts_doubts() -> None:
    """And says where the figure that ended the run is judged otherwise than good."""
    described = gathered().describe(Doubts({"stop": 0.05}, energy=-0.3))
    words = statistics_words({"statistics": described})
    assert words == "; statistics: 9 not resolved by the step, 4 biased by the scheme"
    assert described["scheme_bias"]["figures"][RMS] == -0.15
    assert described["verdict"] == "biased"
    until = StopRule(RMS, 0.1, 1.0).judge(gathered(), 4.0, True, Doubts())
    words = statistics_words({"statistics": described | {"until": until}})
    assert words.startswith(f"; {RMS} is known within 10.00% at t = 4 s, judged biased (")
    assert "independent samples, relative variance" in words
    assert words.endswith("4 biased by the scheme")
    assert statistics_words({}) == statistics_words({"statistics": gathered().describe()}) == ""


def test_figures_that_may_be_0_are_not_asked_for() -> None:
    """Means and percentiles of probes, along and across; mean forces never are 0."""
    assert not any(map(may_be_asked, ("probe.tip.mean", "probe.tip.lateral_mean", "probe.a.b.low", "probe.a.high")))
    assert all(map(may_be_asked, ("probe.tip.rms", "probe.tip.lateral_rms", "face.a.mean_force", "face.a.work_rate")))


def test_no_bias_is_claimed_where_impacts_are_missed() -> None:
    """Of figures that hang on short touches; mean force and work rate keep theirs."""
    doubts = Doubts({"stop": 0.1}, contacts={"stop": 2.0}, table=TABLE)
    for figure in ("contact_share", "rms_force", "impact_rate"):
        assert doubts.bias(f"face.stop.{figure}") is None
        assert doubts.on(f"face.stop.{figure}", 0.01) == "not resolved"
    assert doubts.bias("face.stop.mean_force") == pytest.approx(-0.4)
    assert doubts.on("face.stop.work_rate", 0.01) == "biased"
    assert set(doubts.describe(["face.stop.contact_share", "face.stop.mean_force"])["figures"]) == {
        "face.stop.mean_force"
    }
