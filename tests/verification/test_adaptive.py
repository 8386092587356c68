"""Adaptive steps: impacts are resolved, flight and rest cost nothing, and what was tried leaves no trace."""

from __future__ import annotations

import json
from functools import cache
from itertools import pairwise
from math import acos, cos, pi, sin, sqrt
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

import gapbeam
from gapbeam.solver.case.checks.all_checks import contradictions_in
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.contact.laws.contact_law import kelvin_voigt
from gapbeam.solver.diagnostics.energy_ledger import Ledger, enter_step, open_ledger
from gapbeam.solver.integrators.scheme_choice import scheme_of
from gapbeam.solver.march.simulation import march_of_model
from gapbeam.solver.march.stepwise_march import EffectiveOperators, March, Resolution, march
from gapbeam.solver.system.semi_discrete import State, Step
from gapbeam.studies.trials.response import try_case
from tests.shared.command import DEMO, RATTLE, alone, called_in_turn, on_ranks, settings
from tests.shared.models import COARSE, beam_case, beam_model, seat_of, thrown
from tests.shared.toys import SCHEMES, ledger_of, start, stopped_oscillator

# A mass of 1 kg falls 5 cm on a spring, again and again.
GRAVITY, HEIGHT, STIFFNESS, END = 9.81, 0.05, 1.0e6, 1.0
OMEGA = sqrt(STIFFNESS)
DURATION = pi / OMEGA
COARSE_STEP = 0.02  # s, over six times an impact
LIMITS = {"growth": 0.0025, "loss": 0.008}


class Bounces(NamedTuple):
    """What a march of the mass leaves."""

    steps: list[Step]
    ledger: Ledger

    @property
    def peak(self) -> float:
        """Largest contact force, N."""
        return max(float(step.stage.pressure[0]) for step in self.steps)

    @property
    def place(self) -> float:
        """Displacement at the end, m."""
        return float(self.steps[-1].new.u[0, 0])

    @property
    def tried(self) -> int:
        """Steps that were accepted or halved."""
        return len(self.steps) + sum(step.refinements + step.failures for step in self.steps)


@cache
def bounced(scheme: str, dt: float, adaptive: bool, halvings: int = 8) -> Bounces:
    """March the mass for a second."""
    system, law = stopped_oscillator(1.0, 0.0, HEIGHT, 0.0, lambda _: GRAVITY), kelvin_voigt(STIFFNESS)
    resolution = Resolution(DURATION, **LIMITS) if adaptive else None
    operators = EffectiveOperators(system, SCHEMES[scheme])
    plan = March(system, law, SCHEMES[scheme], operators, dt, round(END / dt), halvings, resolution=resolution)
    steps = list(march(plan, start(system)))
    return Bounces(steps, ledger_of(system, law, start(system), steps))


def exact_peak() -> float:
    """M g + sqrt((m g)^2 + K m v^2), N, with v^2 = 2 g h."""
    return GRAVITY + sqrt(GRAVITY**2 + STIFFNESS * 2.0 * GRAVITY * HEIGHT)


def exact_place(time: float) -> float:
    """Free fall, then u = h + s + (v/omega) sin - s cos on the spring with the sag s = m g / K, and up again."""
    speed, sag = sqrt(2.0 * GRAVITY * HEIGHT), GRAVITY / STIFFNESS
    fall = speed / GRAVITY
    touch = (2.0 * pi - 2.0 * acos(sag / sqrt(sag**2 + (speed / OMEGA) ** 2))) / OMEGA
    phase = time % (2.0 * fall + touch)
    if fall < phase < fall + touch:
        angle = OMEGA * (phase - fall)
        return HEIGHT + sag - sag * cos(angle) + speed / OMEGA * sin(angle)
    flight = phase if phase <= fall else phase - (2.0 * fall + touch)
    return 0.5 * GRAVITY * flight**2


def test_impacts_within_a_step_are_resolved() -> None:
    """Steps of six impacts: the peak force, off by 90 %, comes to 1.5 %, and the place after five bounces to 0.05 mm.

    Source: closed forms of free fall and of a mass on a spring.
    """
    coarse, adaptive = bounced("discrete-gradient", COARSE_STEP, False), bounced("discrete-gradient", COARSE_STEP, True)
    assert abs(coarse.peak / exact_peak() - 1.0) > 0.85
    assert abs(adaptive.peak / exact_peak() - 1.0) < 0.015
    assert abs(coarse.place - exact_place(END)) > 0.04
    assert abs(adaptive.place - exact_place(END)) < 5e-5


def test_it_is_cheaper_than_short_steps() -> None:
    """Steps of a tenth of an impact everywhere give the same, to 1.5 %, for over ten times as many."""
    adaptive = bounced("discrete-gradient", COARSE_STEP, True)
    fine = bounced("discrete-gradient", END / 3200, False)
    assert adaptive.peak == pytest.approx(fine.peak, rel=0.015)
    assert adaptive.place == pytest.approx(fine.place, abs=5e-5)
    assert 10 * adaptive.tried < fine.tried == 3200


def test_every_impact_has_its_ten_steps_and_flight_has_whole_ones() -> None:
    """No step in contact is longer than a tenth of an impact; most whole steps of flight are not halved at all."""
    steps = bounced("discrete-gradient", COARSE_STEP, True).steps
    touched = [step for step in steps if step.old.depth[0] > 0.0 or step.new.depth[0] > 0.0]
    assert len(touched) >= 40
    assert max(step.size for step in touched) <= 0.1 * DURATION
    whole = [step for step in steps if step.size > 0.99 * COARSE_STEP]
    assert len(whole) == round(END / COARSE_STEP) - 5
    assert all(step.refinements == 0 and not step.unresolved for step in whole)


def test_free_flight_and_rest_are_not_halved() -> None:
    """Without an impact every step is whole: a mass that flies, and a beam on its seat however stiff the contact is."""
    system, law = stopped_oscillator(1.0, 0.0, 10.0, 0.0, lambda _: GRAVITY), kelvin_voigt(STIFFNESS)
    scheme, resolution = scheme_of("discrete-gradient"), Resolution(DURATION, **LIMITS)
    plan = March(system, law, scheme, EffectiveOperators(system, scheme), 0.02, 40, resolution=resolution)
    flight = list(march(plan, start(system)))
    model = beam_model({"mesh": COARSE})
    operators = EffectiveOperators(model.system, scheme)
    resolution = Resolution(model.contact_duration, **LIMITS)
    plan = March(model.system, model.law, scheme, operators, 1e-4, 40, resolution=resolution)
    rest = list(march(plan, seat_of(model).state))
    assert rest[-1].new.depth.max() > 0.0
    for steps in (flight, rest):
        assert len(steps) == 40
        assert not any(step.refinements or step.unresolved for step in steps)


def test_rejected_steps_leave_no_trace() -> None:
    """Steps of the sizes that were accepted, taken by hand from one another, give the same motion to the last bit."""
    system, law, scheme = (
        stopped_oscillator(1.0, 0.0, HEIGHT, 0.0, lambda _: GRAVITY),
        kelvin_voigt(STIFFNESS),
        scheme_of("discrete-gradient"),
    )
    operators = EffectiveOperators(system, scheme)
    resolution = Resolution(DURATION, **LIMITS)
    plan = March(system, law, scheme, operators, 2.0**-6, 40, 8, resolution=resolution)
    steps = list(march(plan, start(system)))
    assert sum(step.refinements for step in steps) > 20
    assert len(steps) == 40 + sum(step.refinements for step in steps)
    for before, after in pairwise(steps):
        assert after.old is (before.refreshed or before.new)
    for step in steps:
        again = scheme.advance(system, operators.at(step.size), law, step.old, step.size)
        assert again.new.u[0, 0] == step.new.u[0, 0]
    assert [step.new.time for step in steps if step.completes] == [2.0**-6 * number for number in range(1, 41)]


def test_energy_balances_over_halved_steps() -> None:
    """A beam thrown at its gland: nothing created or lost, and no residual beyond round-off, over steps of 13 sizes."""
    model = beam_model({"mesh": COARSE})
    system, scheme, law, first = model.system, scheme_of("discrete-gradient"), kelvin_voigt(2.0e12), thrown(model)
    resolution = Resolution(pi * sqrt(7919.0 * 0.012 / 2.0e12), **LIMITS)
    plan = March(system, law, scheme, EffectiveOperators(system, scheme), 1e-4, 60, resolution=resolution)
    steps = list(march(plan, first))
    assert len(steps) > 100
    assert sum(step.refreshed is not None for step in steps) >= 2
    ledger = ledger_of(system, law, first, steps)
    assert abs(ledger.residual) < ledger.round_off < 1e-6 * ledger.largest_kinetic
    assert abs(ledger.algorithmic) < ledger.round_off


@pytest.mark.parametrize("dt", [0.02, 0.01, 0.005])
def test_newmark_creates_less(dt: float) -> None:
    """What the trapezoidal rule creates in a second, over 90 % of the energy, is gone: it loses under 3 %."""
    coarse, adaptive = (bounced("newmark", dt, chosen).ledger for chosen in (False, True))
    energy = GRAVITY * HEIGHT
    assert -coarse.algorithmic > 0.9 * energy
    assert -0.03 * energy < -adaptive.algorithmic < 0.0


@pytest.mark.slow(minutes=0.1)
@alone
def test_newmark_creates_less_on_a_beam() -> None:
    """The demo shaken hard on 2.4 E/h: more than half the energy exchanged again, and none with adaptive steps."""
    given = [
        *RATTLE,
        "time.scheme=newmark",
        "contact.stiffness=1e14",
        "time.end=0.06",
        "gates.accept_energy_growth=true",
    ]
    coarse, adaptive = (try_case(read_case(DEMO, [*given, f"time.adaptive={on}"])) for on in ("false", "true"))
    assert coarse.created > 0.5
    assert -0.05 < adaptive.created < 0.0025


def test_steps_that_change_the_energy_are_halved() -> None:
    """The implicit midpoint takes at most 0.8 % of the energy in a step, or the step is marked."""
    steps = bounced("implicit-midpoint", 0.005, True, 20).steps
    assert largest_loss(steps) <= LIMITS["loss"]
    assert largest_loss(bounced("implicit-midpoint", 0.005, False).steps) > 0.5
    assert min(step.size for step in steps) < 0.05 * DURATION < 0.1 * DURATION
    marked = bounced("implicit-midpoint", COARSE_STEP, True, 5).steps
    assert largest_loss([step for step in marked if not step.unresolved]) <= LIMITS["loss"] < largest_loss(marked)


def largest_loss(steps: list[Step]) -> float:
    """Return the largest share of the energy that a step lost, while there is a millionth of it left."""
    system, law = stopped_oscillator(1.0, 0.0, HEIGHT, 0.0, lambda _: GRAVITY), kelvin_voigt(STIFFNESS)
    losses = []
    for step in steps:
        before = open_ledger(system, law, step.old)
        if before.start > 1e-6 * GRAVITY * HEIGHT:
            losses.append(enter_step(system, law, before, step).algorithmic / before.start)
    return max(losses)


def test_the_limit_of_halvings_does_not_fail() -> None:
    """Two halvings where seven are needed: quarters go on, those at impacts are marked, and nothing is raised."""
    limited = bounced("discrete-gradient", COARSE_STEP, True, 2)
    assert min(step.size for step in limited.steps) == pytest.approx(COARSE_STEP / 4.0, rel=1e-9)
    marked = [step for step in limited.steps if step.unresolved]
    assert len(marked) >= 5
    assert all(step.size == pytest.approx(COARSE_STEP / 4.0, rel=1e-9) for step in marked)
    assert abs(limited.peak / exact_peak() - 1.0) < abs(
        bounced("discrete-gradient", COARSE_STEP, False).peak / exact_peak() - 1.0
    )
    assert abs(limited.ledger.algorithmic) < 1e-10


@pytest.mark.slow(minutes=0.3)
@alone
def test_a_beam_that_lands_comes_nearer_to_short_steps(tmp_path: Path) -> None:
    """Two periods of the demo: the impulse of the gland comes 2.5 times closer to that of steps of 2e-5 s.

    For a quarter more solves, with a tenth of the impulse in contacts that are not resolved.
    """
    gentle = {"time.end": 0.1, "load.shaker.ramp": 0.02, "output.fields_interval": 0.1}
    found = {}
    for name, settled in {
        "coarse": {},
        "adaptive": {"time.adaptive": True},
        "fine": {"time.step": 2e-5},
    }.items():
        outcome = gapbeam.run(DEMO, gentle | settled, tmp_path / name)
        assert outcome.exit_status == 0, outcome.message
        impulse = gapbeam.open_results(tmp_path / name).history["impulse"].sel(face="gland").values[-1]
        found[name] = (float(impulse), outcome.summary)
    fine = found["fine"][0]
    assert abs(found["adaptive"][0] - fine) < 0.4 * abs(found["coarse"][0] - fine)
    convergence = found["adaptive"][1]["convergence"]
    assert 1000 < convergence["steps"] + convergence["halvings_adaptive"] < 1250
    shares = [found[name][1]["contact_episodes"]["share_of_impulse_in_short_episodes"] for name in found]
    assert shares[1] < 0.2 * shares[0]
    assert abs(found["adaptive"][1]["energy"]["relative_residual"]) < 1e-6


SOFT = (*RATTLE, "contact.stiffness=2e12", "time.end=5e-3", "time.adaptive=true")


@alone
def test_a_run_counts_both_kinds_of_halvings(tmp_path: Path) -> None:
    """Every halving makes one step more; records stay whole steps, and the case file holds the switch."""
    overrides = [*SOFT, "time.max_iterations=4", "time.max_halvings=12"]
    outcome = gapbeam.run(DEMO, overrides, tmp_path)
    assert outcome.exit_status == 0, outcome.message
    convergence = outcome.summary["convergence"]
    assert convergence["halvings_adaptive"] > 0
    assert convergence["unresolved_steps"] == 0
    assert convergence["steps"] == 50 + convergence["halvings_adaptive"] + convergence["halvings_not_converged"]
    assert convergence["parts_of_halved_steps"] > convergence["halvings_adaptive"]
    results = gapbeam.open_results(tmp_path)
    np.testing.assert_allclose(results.history["time"], 1e-4 * np.arange(51), rtol=1e-12)
    assert results.case["time"]["adaptive"] is True
    assert abs(outcome.summary["energy"]["relative_residual"]) < 1e-6


@alone
def test_a_run_reports_what_it_could_not_resolve(tmp_path: Path) -> None:
    """A contact too stiff for the limit of halvings: status 0, with the number of such steps and what to try."""
    outcome = gapbeam.run(DEMO, [*SOFT, "contact.stiffness=auto", "time.max_halvings=1"], tmp_path)
    assert outcome.exit_status == 0, outcome.message
    count = outcome.summary["convergence"]["unresolved_steps"]
    assert count > 0
    (shown,) = [text for text in outcome.summary["warnings"] if "do not resolve" in text]
    assert shown.startswith(f"{count} steps of 5e-05 s do not resolve")
    for remedy in ("time.max_halvings", "time.step", "contact.stiffness"):
        assert remedy in shown


@pytest.mark.slow(minutes=0.2)
@alone
def test_check_reports_whether_impacts_are_in_reach() -> None:
    """The shortest step against a tenth of an impact: 2.2 us within six halvings of 1e-4 s, and 0.21 us beyond them."""
    soft, stiff = ["time.adaptive=true", "contact.stiffness=2e12"], ["time.adaptive=true"]
    shown = [
        " ".join(done.stdout.split())
        for done in called_in_turn(*(["check", DEMO, *settings(*s)] for s in (soft, stiff)))
    ]
    for words, wanted in zip(shown, ("2.2e-06 s", "2.1e-07 s, which is out of reach"), strict=True):
        assert "adaptive steps down to 1.6e-06 s time.max_halvings = 6; an impact asks for" in words
        assert wanted in words
    assert "out of reach" not in shown[0]


@pytest.mark.slow(minutes=0.3)
@alone
def test_ranks_halve_the_same_steps(tmp_path: Path) -> None:
    """On two ranks as on one: the same counts of steps, halvings and iterations, and the same peak forces to 1e-8."""
    found = []
    for count in (1, 2):
        done = on_ranks(count, "run", DEMO, *settings(*SOFT), "--output", tmp_path / str(count))
        assert done.returncode == 0, done.stderr
        found.append(json.loads((tmp_path / str(count) / "summary.json").read_text(encoding="utf-8")))
    one, two = found
    assert one["convergence"]["halvings_adaptive"] > 10
    for key in ("steps", "halvings_adaptive", "unresolved_steps", "iterations_mean"):
        assert one["convergence"][key] == two["convergence"][key]
    assert one["peak_contact_force"] == pytest.approx(two["peak_contact_force"], rel=1e-8)


def test_only_schemes_that_do_not_conserve_are_watched_for_energy() -> None:
    """The march of a case takes the limits from its gates, and none for the discrete gradient."""
    for scheme, limits in (("implicit-midpoint", (0.001, 0.002)), ("discrete-gradient", (np.inf, np.inf))):
        gates = {"impact_growth": 0.001, "impact_loss": 0.002}
        model = beam_model({"mesh": COARSE, "gates": gates, "time": {"adaptive": True, "scheme": {"type": scheme}}})
        resolution = march_of_model(model, model.case.time.scheme).resolution
        assert resolution is not None
        assert (resolution.growth, resolution.loss) == limits
        assert resolution.contact_duration == pytest.approx(pi * sqrt(7919.0 * 0.012 / model.law.stiffness), rel=1e-12)


def test_impulses_have_no_duration() -> None:
    """Moreau and Jean's scheme with adaptive steps is a contradiction, reported with both ways out."""
    time = {"adaptive": True, "scheme": {"type": "moreau-jean"}}
    (fault,) = contradictions_in(beam_case({"time": time, "contact": {"formulation": {"type": "unilateral"}}}))
    assert fault.key == ("time", "adaptive")
    assert "no duration" in fault.expected
    assert fault.hint == "adaptive = false, or another scheme"


def test_a_face_that_was_closed_at_the_start_is_no_impact() -> None:
    """Closed long since at the start; from its closing on after flight; infinite while open."""
    system, law = stopped_oscillator(gap=HEIGHT), kelvin_voigt(STIFFNESS)
    resolution = Resolution(DURATION, **LIMITS)

    def watched(place: float, time: float, before: State | None) -> State:
        state = start(system, u=place)
        return resolution.watched(system, law, State(time, state.u, state.v, state.depth, state.pressure), before)

    seated = watched(HEIGHT + 1e-6, 0.0, None)
    still = watched(HEIGHT + 2e-6, 1.0, seated)
    opened = watched(HEIGHT - 1e-3, 2.0, still)
    closed = watched(HEIGHT + 1e-6, 3.0, opened)
    held = watched(HEIGHT + 1e-6, 4.0, closed)
    since = [float(state.closed_since[0]) for state in (seated, still, opened, closed, held)]
    assert since == [-np.inf, -np.inf, np.inf, 2.0, 2.0]
