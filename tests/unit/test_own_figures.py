"""Figures of one's own: statistics in closed form, places and keys that are refused, rotations, errors, sweeps."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import norm

import gapbeam
from gapbeam.postprocess.study_figures.sweep_branches import census, draw_map, heights
from gapbeam.solver.diagnostics.statistics.run_statistics import RunStatistics
from tests.shared.models import BEAM

AMPLITUDE, PERIODS = 3.0, 25
TIMES = np.linspace(0.0, 5.0, 20_001)
SINE = AMPLITUDE * np.sin(2.0 * np.pi * PERIODS / 5.0 * TIMES)


def value_of(series: np.ndarray, **keys: Any) -> float:
    """Return a figure of the displacement of a probe."""
    found = gapbeam.figure("a", "displacement", "tip", **keys).value(TIMES, series)
    assert found.value is not None, found.reason
    return found.value


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        ({"statistic": "mean", "magnitude": True}, 2.0 / np.pi * AMPLITUDE),
        ({"statistic": "rms"}, AMPLITUDE / np.sqrt(2.0)),
        ({"statistic": "share", "limit": 0.5 * AMPLITUDE}, 1.0 / 3.0),
        ({"statistic": "quantile", "level": 0.9}, AMPLITUDE * np.sin(0.4 * np.pi)),
        ({"statistic": "peak-to-peak"}, 2.0 * AMPLITUDE),
        ({"statistic": "value", "time": 0.05}, AMPLITUDE),
        ({"statistic": "time-of-minimum", "end": 0.2}, 0.15),
        ({"statistic": "maximum", "start": 0.1, "end": 0.2 - 1e-9}, 0.0),
        ({"statistic": "mean", "start": 4.8, "end": 4.9}, 2.0 / np.pi * AMPLITUDE),
        ({"statistic": "probability", "limit": 0.9 * AMPLITUDE, "duration": 0.1}, 0.5),
    ],
    ids=str,
)
def test_statistics_of_a_sine_are_those_of_textbooks(keys: dict[str, Any], expected: float) -> None:
    series = np.abs(SINE) if keys.get("magnitude") else SINE
    assert value_of(series, **keys) == pytest.approx(expected, rel=2e-3, abs=1e-4)


@pytest.mark.parametrize("level", [0.03, 0.31, 0.5, 0.9, 0.97])
@pytest.mark.parametrize("records", [9, 10, 11, 25])
def test_quantiles_are_of_the_lines_between_few_records(level: float, records: int) -> None:
    """A sawtooth is A level at any level, however few records a period has, and however uneven they are."""
    times = np.linspace(0.0, 1.0, records) ** 1.7
    series = AMPLITUDE * np.where(times > 0.4, (1.0 - times) / 0.6, times / 0.4)
    times, series = np.append(times, 0.4), np.append(series, AMPLITUDE)
    order = np.argsort(times, kind="stable")
    one = gapbeam.figure("a", "displacement", "tip", statistic="quantile", level=level)
    assert one.value(times[order], series[order]).value == pytest.approx(AMPLITUDE * level, rel=1e-9)


@pytest.mark.parametrize("level", [0.2, 0.4, 0.6, 0.8])
def test_quantiles_of_what_rests_are_where_it_rests(level: float) -> None:
    """0 for half of the time, then a line from 0 to 1: 0 up to the level 0.5, and 2 level - 1 beyond."""
    one = gapbeam.figure("a", "displacement", "tip", statistic="quantile", level=level)
    value = one.value(np.array([0.0, 0.1, 0.5, 1.0]), np.array([0.0, 0.0, 0.0, 1.0])).value
    assert value == pytest.approx(max(2.0 * level - 1.0, 0.0), abs=1e-12)


@pytest.mark.parametrize("limit", [0.0, 0.3, 0.8, 1.5])
def test_windows_are_those_that_pass_the_limit_at_their_ends_or_between(limit: float) -> None:
    """Against each window on its own, by many more records than a window has or fewer."""
    draw = np.random.default_rng(2)
    for count, duration in ((400, 0.011), (60, 0.05), (12, 0.02)):
        t = np.concatenate([[0.0], np.sort(draw.random(count - 2)), [1.0]])
        x = np.round(draw.standard_normal(count), 1)
        one = gapbeam.figure("a", "displacement", "tip", statistic="probability", limit=limit, duration=duration)
        edges = duration * np.arange(int(1.0 / duration + 1e-9) + 1)
        t, x = np.append(t, edges), np.append(x, np.interp(edges, t, x))
        passed = [x[(t >= begin) & (t <= end)].max() > limit for begin, end in pairwise(edges)]
        order = np.argsort(t, kind="stable")
        assert one.value(t[order], x[order]).value == pytest.approx(np.mean(passed))


def test_a_limit_that_is_never_passed_has_an_upper_bound() -> None:
    """Clopper and Pearson: none of n windows, an upper end of 1 - 0.025^(1/n); all of n, a lower one of 0.025^(1/n)."""
    never = gapbeam.figure("a", "displacement", "tip", statistic="probability", limit=9.0, duration=0.25)
    found = never.value(TIMES, SINE)
    assert (found.value, found.low, found.high) == (0.0, 0.0, pytest.approx(1.0 - 0.025 ** (1 / 20)))
    always = never.model_copy(update={"limit": 0.0}).value(TIMES, SINE)
    assert (always.value, always.low, always.high) == (1.0, pytest.approx(0.025 ** (1 / 20)), 1.0)


def test_records_that_end_early_give_no_figure() -> None:
    found = gapbeam.figure("a", "displacement", "tip", end=6.0).value(TIMES, SINE)
    assert found.value is None
    assert "5 s" in found.reason


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"quantity": "displacment"}, "expected one of displacement"),
        ({"statistic": "share"}, "without limit"),
        ({"limit": 1.0}, 'limit with statistic = "maximum"'),
        ({"start": 2.0, "end": 1.0}, "more than start"),
        ({"statistic": "most"}, "expected 'value'"),
        ({"quantity": "kinetic_energy", "place": "tip"}, "no place"),
    ],
)
def test_keys_that_do_not_fit_are_refused(keys: dict[str, Any], words: str) -> None:
    with pytest.raises(gapbeam.UserError) as refused:
        gapbeam.figure("a", **{"quantity": "displacement", **keys})
    assert words in str(refused.value)


def beam_with(*figures: dict[str, Any], model: str = "beam", **tables: Any) -> dict[str, Any]:
    """Return the tables of a beam with a tip whose rotation is recorded, and figures."""
    probe = [{"name": "tip", "point": 0.51, "rotation": True}]
    return BEAM | {"model": model, "probe": probe, "figure": list(figures)} | tables


@pytest.mark.parametrize(
    ("figure", "words"),
    [
        ({"quantity": "contact_force", "place": "glnd"}, 'did you mean "gland"'),
        ({"quantity": "axial_stress", "place": "tip"}, "stress = true"),
        ({"quantity": "displacement", "place": "tip", "end": 1.0}, "time.end = 0.01"),
        ({"quantity": "velocity", "place": "tip", "component": "w"}, "one of x, y, z"),
        ({"quantity": "contact_force", "place": "base", "component": "y"}, "contact_force has none"),
        ({"quantity": "kinetic_energy", "component": "y"}, "kinetic_energy has none"),
    ],
)
def test_a_case_refuses_figures_that_it_does_not_record(figure: dict[str, Any], words: str) -> None:
    with pytest.raises(gapbeam.CaseError) as refused:
        gapbeam.read_case(beam_with({"name": "a"} | figure))
    assert words in str(refused.value)


@pytest.mark.parametrize("model", ["beam", "full"])
def test_the_slope_of_a_cantilever_is_that_of_beam_theory(model: str, tmp_path: Path) -> None:
    """P L^2 / (2 E I) at the tip of a clamped beam that P lifts into the play: shear does not turn sections."""
    figures = (
        {"name": "slope", "quantity": "rotation", "place": "tip", "statistic": "value", "time": 0.0},
        {"name": "held", "quantity": "joint_force", "place": "clamp", "component": "vertical", "statistic": "mean"},
    )
    outcome = gapbeam.run(
        beam_with(
            *figures, model=model, load=[{"type": "constant_force", "point": 0.51, "amplitude": 2.0}],
            support={"length": 0.05, "clearance": 2e-3},
            joint=[{"type": "clamped", "name": "clamp", "point": 0.0}], time={"end": 1e-3, "step": 1e-4},
            output={"errors": "none"},
        ),
        output=tmp_path / "a",
    )  # fmt: skip
    slope = 2.0 * 0.51**2 / (2.0 * 2.1e11 * 0.02 * 0.012**3 / 12.0)
    assert outcome.summary["figures"]["slope"]["value"] == pytest.approx(slope, rel=2e-3)
    assert outcome.summary["figures"]["held"]["value"] == pytest.approx(-2.0, rel=1e-3)


def test_figures_of_a_run_have_errors_and_a_row_in_the_closing_table(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The maximum of the tip is that of its record; its error is in the table of the run."""
    monkeypatch.setenv("GAPBEAM_ERRORS", "companions")
    peak = {"name": "peak", "quantity": "displacement", "place": "tip", "magnitude": True}
    outcome = gapbeam.run(
        beam_with(peak, load=[{"type": "gravity"}, {"type": "harmonic_force", "name": "shaker", "point": 0.15,
                  "amplitude": 20.0, "frequency": 100.0}]), output=tmp_path / "a"
    )  # fmt: skip
    history = gapbeam.open_results(tmp_path / "a").history
    record = np.abs(history["displacement"].sel(probe="tip").values[:, -1]).max()
    assert outcome.summary["figures"]["peak"]["value"] == pytest.approx(record, rel=1e-12)
    [error] = [one for one in outcome.summary["errors"]["figures"] if one["name"] == "peak"]
    assert 0.0 < error["error"] < 0.1 * record
    assert outcome.summary["closing"]["rows"][0]["figure"] == "peak"


def test_the_share_of_noise_above_a_limit_has_an_interval() -> None:
    """White noise: 1 - Phi(1) of the time above one standard deviation, within the 95 % interval widened by half."""
    count, step = 40_000, 1e-3
    one = gapbeam.figure("over", "displacement", "tip", statistic="share", limit=2.0)
    found = RunStatistics((), ("tip",), False, step, own=(one,), labels={"probe": ("tip",), "component": ("x", "y")})
    moved = np.zeros((count, 1, 2))
    moved[:, 0, 1] = 2.0 * np.random.default_rng(3).standard_normal(count)
    none = np.zeros((count, 0))
    rows = dict.fromkeys(("contact_time", "impulse", "closings", "approach_speeds", "force_square"), none)
    found.see(rows | {"time": step * np.arange(count), "displacement": moved, "acceleration_absolute": moved})
    [share] = [figure for figure in found.figures() if figure.name == "over"]
    assert share.verdict == "good"
    assert share.interval.value == pytest.approx(norm.sf(1.0), abs=0.75 * (share.interval.high - share.interval.low))


@pytest.mark.parametrize("level", [0.05, 0.5, 0.9])
def test_quantiles_of_noise_have_an_interval(level: float) -> None:
    """Noise that forgets in ten records: its quantile lies in the interval, widened by half, of 20 draws."""
    count, step = 20_000, 1e-3
    one = gapbeam.figure("high", "displacement", "tip", statistic="quantile", level=level)
    missed = 0
    for seed in range(20):
        white = np.random.default_rng(seed).standard_normal(count) * np.sqrt(1.0 - 0.9**2)
        x = lfilter([1.0], [1.0, -0.9], white)
        found = RunStatistics(
            (), ("tip",), False, step, own=(one,), labels={"probe": ("tip",), "component": ("x", "y")}
        )
        moved = np.zeros((count, 1, 2))
        moved[:, 0, 1] = x
        none = np.zeros((count, 0))
        rows = dict.fromkeys(("contact_time", "impulse", "closings", "approach_speeds", "force_square"), none)
        found.see(rows | {"time": step * np.arange(count), "displacement": moved, "acceleration_absolute": moved})
        [high] = [figure for figure in found.figures() if figure.name == "high"]
        middle, width = high.interval.value, high.interval.high - high.interval.low
        assert 0.0 < width < 1.0
        missed += abs(middle - norm.ppf(level)) > 0.75 * width
    assert missed <= 2


def record_of(amplitude: float, verdict: str = "passed", **values: str) -> dict[str, Any]:
    """Return the record of a response of a sweep."""
    figures = {
        "tip displacement": {"mean": amplitude, "scatter": 0.0, "unit": "m"},
        "top": {"mean": 10.0 * amplitude, "scatter": 0.0, "unit": "m", "own": True},
    }
    return {
        "values": values, "direction": "", "start": "seat", "verdict": verdict, "response": "period 1", "notes": [],
        "figures": figures, "message": "", "repeats_within": 0.0,
    }  # fmt: skip


def test_starts_given_by_keys_are_starts_of_one_point() -> None:
    """Two responses of a bistable point, found from starts that a key gives, coexist there."""
    records = [
        record_of(1.0, **{"analysis.start": "seat", "a": "1"}),
        record_of(2.0, **{"analysis.start": "undeformed", "a": "1"}),
        record_of(2.0, **{"analysis.start": "seat", "a": "2"}),
    ]
    points = census(records, 0.02)
    assert [(point.values, point.coexisting) for point in points] == [({"a": "1"}, 2), ({"a": "2"}, 1)]
    assert points[0].branches[1].reached_from == ["seat analysis.start = undeformed"]


def test_a_map_has_the_figures_of_its_points(tmp_path: Path) -> None:
    """Z = x + 10 y over a grid; a point that did not pass is a hole."""
    pairs = [(x, y) for x in range(3) for y in range(4)]
    records = [
        record_of(x + 10.0 * y, "passed" if (x, y) != (1, 2) else "energy created", a=str(x), b=str(y))
        for x, y in pairs
    ]
    points = census(records, 0.02)
    expected = 10.0 * (np.arange(3)[None] + 10.0 * np.arange(4)[:, None])
    expected[2, 1] = np.nan
    np.testing.assert_allclose(heights(points, "top"), expected)
    assert draw_map(points, tmp_path / "map.png") == tmp_path / "map.png"
    assert draw_map(points[:6], tmp_path / "none.png") is None
