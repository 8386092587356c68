"""time.step = "auto": the rule, soft and rigid contact, whole steps, and where the number is reported."""

from __future__ import annotations

from math import pi, sqrt
from pathlib import Path
from typing import Any

import pytest

import gapbeam
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.checks.case_warnings import warnings
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.messages.errors import CaseError
from gapbeam.solver.models.time_step import (
    contact_duration,
    frequency_of_interest,
    rounded_down,
    time_step,
    with_time_step,
)
from gapbeam.studies.trials.response import try_case
from tests.shared.command import DEMO, RATTLE, alone, called, settings
from tests.shared.models import COARSE, GRAVITY, beam_case, beam_model

RIGID = 1.0e15  # Pa/m
SECOND = 4.694091132974174**2 * 0.012 / sqrt(12.0) * sqrt(2.1e11 / 7919.0) / (2.0 * pi * 0.46**2)  # Hz
MASS = 7919.0 * 0.012  # kg/m^2


def shaker(frequency: float) -> dict[str, Any]:
    """A force of a frequency (Hz), named after it."""
    name = f"f{round(1000.0 * frequency)}"
    return {"type": "harmonic_force", "name": name, "point": 0.15, "amplitude": 5.0, "frequency": frequency}


def case_of(*frequencies: float, output: dict[str, Any] | None = None, **time: Any) -> Case:
    """The beam under these forcing frequencies, with the step left open."""
    changes = {"time": {"step": "auto", "end": 0.6, **time}, "output": output or {}, "mesh": COARSE}
    return beam_case(changes, (GRAVITY, *(shaker(frequency) for frequency in frequencies)))


def test_frequency_of_interest() -> None:
    """The second bending mode of the overhang, 296 Hz; five times the forcing where that is more; or as given."""
    assert pytest.approx(295.6, abs=0.1) == SECOND
    assert frequency_of_interest(case_of())[0] == pytest.approx(SECOND, rel=1e-12)
    assert frequency_of_interest(case_of(20.0))[0] == pytest.approx(SECOND, rel=1e-12)
    assert frequency_of_interest(case_of(20.0, 80.0)) == (400.0, "5 times the highest forcing frequency")
    assert frequency_of_interest(case_of(80.0, frequency=150.0)) == (150.0, "time.frequency")


def test_fifty_steps_in_a_period_of_interest() -> None:
    """With a rigid contact 1/(50 f), rounded down to whole steps in the run; the report says why and at what cost."""
    chosen = time_step(case_of(frequency=1000.0, end=0.0101), RIGID)
    assert chosen.value == pytest.approx(0.0101 / 505, rel=1e-12)
    assert (chosen.key, chosen.unit) == ("time.step", "s")
    for text in ("50 steps", "1000 Hz, time.frequency", "are rigid on that time scale", "time.adaptive", "time.end"):
        assert text in chosen.reason
    assert chosen.consequence.startswith("half: twice the time, periods at 1000 Hz 0.033 % too long; double: ")


def test_duration_of_an_impact() -> None:
    """Half a period of the thickness of the beam on the contact; of the slope at 1 % of the clearance for Hertz's."""
    assert contact_duration(case_of(), 4.0e12) == pytest.approx(pi * sqrt(MASS / 4.0e12), rel=1e-12)
    hertz = beam_case({"contact": {"law": {"type": "hunt-crossley", "exponent": 1.5, "restitution": 0.8}}})
    slope = 1.5 * 4.0e15 * sqrt(0.107e-5)
    assert contact_duration(hertz, 4.0e15) == pytest.approx(pi * sqrt(MASS / slope), rel=1e-12)


@pytest.mark.parametrize(
    ("ratio", "share"), [(9.9, 20 / 2 / 9.9 / 400), (5.0, 20 / 2 / 5.0 / 400), (1.0, 1 / 50), (10.1, 1 / 50)]
)
def test_soft_contacts_get_twenty_steps(ratio: float, share: float) -> None:
    """A contact of `ratio` times the frequency of interest: T_c/20 = 1/(40 ratio f) below ten, if shorter."""
    frequency = 200.0
    stiffness = MASS * (2.0 * pi * ratio * frequency) ** 2
    chosen = time_step(case_of(frequency=frequency, end=100.0), stiffness)
    assert chosen.value == pytest.approx(share / frequency, rel=1e-3)
    assert ("20 steps in a contact" in chosen.reason) == (1.25 < ratio < 10.0)


@pytest.mark.parametrize(
    ("ratio", "force", "share"),
    [(0.1, 1.0, 1 / 40 / 0.1), (0.1, 20.0, SECOND / 5000), (1.0, 1.0, 1 / 40), (2.0, 1.0, 1 / 80)],
    ids=["contact", "load", "near its bending", "stiff contact"],
)
def test_rigid_bodies_do_not_bend(ratio: float, force: float, share: float) -> None:
    """T_c/20 = 1/(40 ratio SECOND) where that is longer than their bending asks for, or 1/50 of five times a load."""
    case = beam_case(
        {"time": {"step": "auto", "end": 1000.0}, "mesh": COARSE, "model": {"type": "rigid"}},
        (GRAVITY, shaker(force)),
    )
    chosen = time_step(case, MASS * (2.0 * pi * ratio * SECOND) ** 2)
    assert chosen.value == pytest.approx(share / SECOND, rel=0.03)
    assert chosen.value <= share / SECOND * (1.0 + 1e-9)
    assert ("does not bend" in chosen.reason) == (ratio < 1.25)


@pytest.mark.parametrize(
    ("case", "step"),
    [
        (case_of(20.0), 0.05 / 740),
        (case_of(20.0, output={"history_interval": 1e-4, "fields_interval": 2.5e-3}), 5e-5),
        (case_of(20.0, output={"history_interval": 3e-4}), 6e-5),
        (case_of(20.0, output={"history_interval": 1e-5}), 1e-5),
        (case_of(20.0, 33.37), 0.05 / 740),
        (case_of(20.0, end=0.60003), 0.05 / 740),
        (case_of(20.0, end=2e-5), 2e-5),
        (case_of(), 0.6 / 8870),
    ],
    ids=["period", "both intervals", "history", "short interval", "two periods", "odd end", "short run", "end"],
)
def test_rounded_down_to_whole_steps(case: Case, step: float) -> None:
    """Intervals always in whole steps; periods and the end where the step stays above a quarter of 67.65 us."""
    value, _ = rounded_down(case, 1.0 / (50.0 * SECOND))
    assert value == pytest.approx(step, rel=1e-12)


def test_intervals_without_a_common_divisor_are_a_fault() -> None:
    """1e-4 and 1.0000001e-4 s: a step of 1e-11 s would be 6e10 steps, which is refused with what to try."""
    case = case_of(20.0, output={"history_interval": 1e-4, "fields_interval": 1.0000001e-4})
    with pytest.raises(CaseError) as refused:
        with_time_step(case, RIGID)
    for text in (
        'time.step = "auto"',
        "whole steps in output.history_interval, output.fields_interval",
        "6e+10 steps",
        "at most 1e+09 steps",
    ):
        assert text in str(refused.value)
    assert refused.value.exit_status == 2


def test_round_off_in_intervals_does_not_count() -> None:
    """3 x 0.1 ms is 0.00030000000000000003 s in Python, with which the step was 1e-20 s, and the case refused."""
    value, _ = rounded_down(case_of(20.0, output={"history_interval": 3 * 1e-4, "fields_interval": 3e-3}), 1e-4)
    assert value == pytest.approx(1e-4, rel=1e-12)


def test_advice_on_intervals_without_a_common_divisor_can_be_followed() -> None:
    """It was an interval of 1e-19 s, of which the step was then 1e-19 s; now both are near those of the case."""
    output = {"history_interval": 8.868034862e-4, "fields_interval": 0.04434017431139}
    with pytest.raises(CaseError) as refused:
        with_time_step(case_of(20.0, output=output), RIGID)
    (fault,) = refused.value.faults
    words = fault.hint.partition(":")[0]
    advised = {key: float(value) for key, _, value in (word.partition(" = ") for word in words.split(", "))}
    for key, value in output.items():
        assert advised[key] == pytest.approx(value, rel=0.05)
    resolved, (chosen,) = with_time_step(case_of(20.0, output=advised), RIGID)
    assert resolved.time.step == chosen.value > 1.0e-5


def test_the_model_holds_the_number() -> None:
    """model.case has the step, which is listed with its reason; a step that was given is left as it is."""
    model = beam_model({"mesh": COARSE, "time": {"step": "auto"}})
    (chosen,) = [default for default in model.defaults if default.key == "time.step"]
    assert model.step == model.case.time.step == chosen.value == pytest.approx(1e-2 / 148, rel=1e-12)
    given = beam_model({"mesh": COARSE})
    assert given.step == given.case.time.step == 1e-4
    assert [default.key for default in given.defaults] == ["contact.stiffness"]


def test_warnings_wait_for_the_number() -> None:
    """None about a step that is open; a frequency of interest that a given step misses is warned of."""
    assert warnings(read_case(DEMO, ["time.step=auto"])) == []
    (line,) = warnings(read_case(DEMO, ["time.frequency=1000"]))
    assert line == "[time] step = 0.0001: 10 steps in a period of the time.frequency, and 50 are good"


def test_a_trial_takes_it() -> None:
    """The grid of `gapbeam stability` may vary over it."""
    trial = try_case(case_of(20.0, end=5e-3))
    assert (trial.verdict, trial.reached) == ("passed", pytest.approx(5e-3))


@alone
def test_a_run_takes_it(tmp_path: Path) -> None:
    """From --set: the run passes, its case file and summary hold the number, and its case file runs again."""
    done = called("run", DEMO, *settings(*RATTLE, "time.step=auto", "time.end=0.01"), "--output", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert "chosen: contact.stiffness = 2.1e+14 Pa/m, time.step = 3.333e-05 s" in done.stderr
    log = (tmp_path / "out" / "run.log").read_text(encoding="utf-8")
    assert "time.step = 3.333e-05 s: 50 steps in a period of 500 Hz, 5 times the highest forcing" in log
    results = gapbeam.open_results(tmp_path / "out")
    assert results.case["time"]["step"] == pytest.approx(1e-4 / 3, rel=1e-15)
    assert results.summary["convergence"]["steps"] == 300
    (text,) = [default for default in results.summary["defaults"] if default["key"] == "time.step"]
    assert text["value"] == results.case["time"]["step"]
    assert read_case(tmp_path / "out" / "case.toml").time.step == text["value"]


@alone
def test_check_shows_it() -> None:
    """Among the computed defaults, with reason and consequence, and as the number of steps."""
    done = called("check", DEMO, *settings("time.step=auto"))
    assert done.returncode == 0, done.stderr
    text = " ".join(done.stdout.split())
    for words in ("time.step 5e-05 s", "of 295.6 Hz", "half: twice the time", "steps 12000 of 5e-05 s"):
        assert words in text
