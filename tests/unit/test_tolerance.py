"""A tolerance holds over the span of the case, or is not promised: errors that grow with time, and every doubt."""

from __future__ import annotations

import json
from dataclasses import replace
from math import inf
from pathlib import Path

import numpy as np
import pytest

from gapbeam.commands.tradeoff import level_within
from gapbeam.postprocess.signals.steady_figures import WindowFigure
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.messages.errors import UserError
from gapbeam.studies.tradeoff import run_tradeoff
from gapbeam.studies.tradeoff.level_errors import Grounds, Judged, choice, doubts, judged, nearest, window_differences
from gapbeam.studies.tradeoff.level_measurement import Level, MeasuredLevel, plan_levels, windows_over
from gapbeam.studies.tradeoff.run_tradeoff import stored_choice, study_key
from gapbeam.studies.tradeoff.tradeoff_study import _span
from tests.shared.command import DEMO
from tests.shared.history_labels import LABELS

FREQUENCY, END = 20.0, 10.0
TOLERANCE = 0.02


def resonance(detuned: float, step: float = 5e-4) -> MeasuredLevel:
    """Return x = sin(2 pi f t) sin(pi d t) / (pi d): a resonance that grows as t, and beats where detuned by d, Hz."""
    time = np.arange(int(END / step + 1e-9) + 1) * step
    x = 1e-3 * np.sin(2 * np.pi * FREQUENCY * time) * time * np.sinc(detuned * time)
    a = np.gradient(np.gradient(x, step), step)
    along = {"displacement": x, "velocity": np.gradient(x, step), "acceleration_absolute": a}
    records = {name: np.stack([0 * y, y], axis=-1)[:, None, :] for name, y in along.items()}
    force = np.full((time.size, 2), 40.0)
    records |= {"time": time, "contact_force": force, "impulse": 40.0 * np.stack([time, time], 1)}
    made = MeasuredLevel(frequency=FREQUENCY, records=records, labels=LABELS, set_up=1.0, per_second=2.0)
    made.span, made.windows = END, windows_over(made._history(round(END * FREQUENCY)), FREQUENCY, END)
    return made


def test_windows_cover_a_record_from_its_start_to_its_end() -> None:
    """200 forcing periods: one window of 12 from the start and 16 up to the end; ranges grow with the motion."""
    windows = resonance(0.0).windows
    ranges = windows["tip peak-to-peak displacement"]
    assert ranges.shape == windows["tip harmonic 1"].shape == windows["base impulse"].shape == (17,)
    assert ranges[0] == pytest.approx(2e-3 * 12 / FREQUENCY, rel=0.05)
    assert ranges[-1] == pytest.approx(2e-3 * END, rel=0.01)
    assert np.all(np.diff(ranges) > 0.0)


def test_windows_are_the_same_for_steps_that_miss_the_end() -> None:
    """200 forcing periods in steps of 0.7 ms end 0.2 ms early: as many windows, and ranges that differ by little."""
    exact, early = resonance(0.0), resonance(0.0, 7e-4)
    assert early.records["time"][-1] < END - 1e-4
    assert window_differences(early.windows, exact.windows)["displacement"] < 0.02


def test_errors_are_those_of_the_whole_span() -> None:
    """Detuned by 0.05 Hz: at the end sin(pi/2)/(pi/2) of the amplitude is left, 36 % less; in 8 periods, 0.1 % less."""
    level, reference, other = Level("reduced 2D", {}), resonance(0.0), resonance(0.05)
    whole = judged(level, other, reference, 8, END)
    assert whole.covered == END
    assert whole.errors["displacement"] == pytest.approx(1.0 - 2.0 / np.pi, abs=0.02)
    other.windows = {}
    begin = judged(level, other, reference, 8, END)
    assert begin.covered == pytest.approx(8 / FREQUENCY)
    assert begin.error < 2e-3
    assert begin.inside(TOLERANCE)
    assert not whole.inside(TOLERANCE)


def one(error: float = 0.005, covered: float = END, seconds: float = 1.0, means: float | None = None) -> Judged:
    """Return a level that was never run."""
    return Judged(
        Level(f"level of {seconds:g} s", {}), MeasuredLevel(), {"displacement": error}, None, seconds, covered, means
    )


SURE = Grounds(END, {"displacement": 0.004})


def test_each_doubt_is_named() -> None:
    """A level outside, an uncertain reference, both together, a part of the span, a chaotic motion: and no doubt."""
    assert doubts(one(), TOLERANCE, SURE) == []
    (outside,) = doubts(one(0.3), TOLERANCE, SURE)
    assert outside == "level of 1 s is 30 % off the reference (displacement)"
    (uncertain,) = doubts(one(), TOLERANCE, replace(SURE, uncertainty={"displacement": 0.058}))
    assert uncertain == "the reference itself is uncertain by 5.8 % (displacement)"
    (together,) = doubts(one(0.015), TOLERANCE, replace(SURE, uncertainty={"displacement": 0.015}))
    assert "add up to 3 % (displacement)" in together
    (short,) = doubts(one(covered=4.0), TOLERANCE, replace(SURE, cut="the march would take 900 s"))
    assert short == "errors cover the first 4 s of 10 s only: the march would take 900 s"
    wild = replace(SURE, chaotic=True)
    assert doubts(one(covered=0.4, means=0.019), TOLERANCE, wild) == []
    (means,) = doubts(one(covered=0.4, means=0.2), TOLERANCE, wild)
    assert means == "the motion can be predicted for 0.4 s only, and means beyond that are known to 20 % only"
    (unknown,) = doubts(one(covered=0.4), TOLERANCE, wild)
    assert "means beyond that are not known" in unknown
    other_cycle = replace(one(means=inf), statistics=inf)
    assert doubts(other_cycle, TOLERANCE, SURE) == ["level of 1 s is in another cycle than the reference"]


def test_what_promises_is_taken_before_what_is_cheaper() -> None:
    """A full model that was followed for 0.1 s only is no promise; the nearest is one whose errors cover the case."""
    cheap, dear = one(covered=0.1, seconds=1.0), one(seconds=5.0)
    assert choice([cheap, dear], TOLERANCE, SURE) is dear
    assert choice([cheap], TOLERANCE, SURE) is cheap
    assert choice([one(0.3)], TOLERANCE, SURE) is None
    far, near, brief = one(0.3), one(0.1, seconds=9.0), one(0.05, covered=0.1)
    assert nearest([far, near, brief], SURE) is near
    assert nearest([], SURE) is None


def test_means_of_a_chaotic_motion_are_known_to_their_scatter() -> None:
    """Means of ten windows with 5 %: the difference of two is known to 2 sqrt(2) 5 % / sqrt(10), beyond what it is."""
    windows = np.random.default_rng(0).normal(1.0, 0.05, 10)
    reference, other = resonance(0.0), resonance(0.0)
    for measured, values in ((reference, windows), (other, windows + 0.01)):
        measured.words, measured.long = ["no cycle"], {"tip peak-to-peak displacement": WindowFigure("m", values)}
    found = judged(Level("reduced 2D", {}), other, reference, 8, END)
    assert found.statistics == 0.0
    scatter = 2.0 * 2.0**0.5 * windows.std(ddof=1) / 10**0.5
    assert found.means == pytest.approx((0.01 + scatter) / windows.mean(), rel=1e-6)


def test_a_span_that_is_too_dear_is_cut_and_says_why() -> None:
    """All levels but the full ones march over it: cost, what was allowed, and the remedy; never less than a period."""
    plan = plan_levels(read_case(DEMO))
    first = MeasuredLevel(per_second=2.0)
    count = len(plan.family) + sum(not level.full for level in plan.levels)
    assert _span(END, FREQUENCY, plan, first, count * END * 2.0) == (END, "")
    part, why = _span(END, FREQUENCY, plan, first, count * END)
    assert part == pytest.approx(END / 2)
    assert f"would take about {20 * count} s, and {10 * count} s were allowed" in why
    assert "more `minutes=`" in why
    assert _span(END, FREQUENCY, plan, first, 1e-9)[0] == 1.0 / FREQUENCY


def write_stored(folder: Path, case: Case, levels: list[Judged], grounds: Grounds) -> None:
    """Write what a run reads of a trade-off."""
    rows = [
        {
            "name": one.level.name, "changes": dict(one.level.changes), "verdict": "passed", "errors": one.errors,
            "covered": one.covered, "statistics_beyond_scatter": one.statistics, "means_known_to": one.means,
            "other_cycle": False, "seconds_of_the_case": one.seconds,
        }
        for one in levels
    ]  # fmt: skip
    study = {
        "key": study_key(case), "fixed": {"output.history_interval": None}, "rungs": rows, "end": grounds.end,
        "uncertainty": dict(grounds.uncertainty), "chaotic": grounds.chaotic, "not_covered_because": grounds.cut,
    }  # fmt: skip
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "tradeoff.json").write_text(json.dumps(study), encoding="utf-8")


def test_a_stored_study_serves_no_longer_case(tmp_path: Path) -> None:
    """It serves cases up to the end of its own, with its doubts; one without an end was made when none was known."""
    case = read_case(DEMO)
    end = case.time.end
    uncertain = Grounds(end, {"displacement": 0.058})
    write_stored(tmp_path, case, [one(covered=end)], uncertain)
    found = stored_choice(tmp_path, case, TOLERANCE)
    assert found is not None
    assert found.doubts == ("the reference itself is uncertain by 5.8 % (displacement)",)
    sure = stored_choice(tmp_path, case, 0.1)
    assert sure is not None
    assert sure.doubts == ()
    shorter = stored_choice(tmp_path, read_case(DEMO, [f"time.end={end / 2}"]), 0.1)
    assert shorter is not None
    assert shorter.covered == end / 2
    assert shorter.doubts == ()
    doubtful = stored_choice(tmp_path, read_case(DEMO, [f"time.end={end / 2}"]), TOLERANCE)
    assert doubtful is not None
    assert (
        doubtful.doubts[1] == f"errors are those up to t = {end:g} s: a trade-off of this shorter case may promise more"
    )
    assert stored_choice(tmp_path, read_case(DEMO, [f"time.end={2 * end}"]), 0.1) is None
    path = tmp_path / "tradeoff.json"
    study = json.loads(path.read_text(encoding="utf-8"))
    path.write_text(json.dumps(study | {"rungs": []}), encoding="utf-8")
    with pytest.raises(UserError, match="every fidelity level failed"):
        stored_choice(tmp_path, case, TOLERANCE)
    del study["end"]
    path.write_text(json.dumps(study), encoding="utf-8")
    assert stored_choice(tmp_path, case, TOLERANCE) is None


def test_a_study_that_a_run_needs_takes_half_of_its_wall_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """`run --tolerance --wall-time 200s` measured models for 280 s; without a limit a study takes its usual minutes."""
    allowed: list[float] = []

    def study(case: Path, folder: Path, _fixed: object, _tolerance: float, minutes: float, **_: bool) -> None:
        allowed.append(minutes)
        write_stored(folder, read_case(case), [one(covered=END)], Grounds(END, {}))

    monkeypatch.setattr(run_tradeoff, "run_tradeoff", study)
    for wall_time in (None, 200.0):
        monkeypatch.setattr(run_tradeoff, "tradeoff_folder", lambda _, name=str(wall_time): tmp_path / name)
        level_within(DEMO, [], "2%", wall_time)
    assert allowed == pytest.approx([run_tradeoff.MINUTES, 100.0 / 60.0])
