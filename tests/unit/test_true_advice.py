"""What is said about a case is true of that case: its bending, its motion, its section, the time that is left."""

from __future__ import annotations

import logging
import re
from math import pi, sqrt
from typing import Any

import numpy as np
import pytest

import gapbeam
from gapbeam.meshes.tagged_mesh import Section
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.checks.case_warnings import motion
from gapbeam.solver.case.computed_defaults import bending_words, overhang_frequency
from gapbeam.solver.case.reading.case_reader import read_case_text
from gapbeam.solver.case.solution_tables import Gates
from gapbeam.solver.diagnostics.energy_gates import EnergyGates, remedy_for
from gapbeam.solver.diagnostics.energy_ledger import Ledger
from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.messages.errors import CaseError, EnergyCreated, EnergyLost, NotConverged
from gapbeam.solver.run.output import progress
from gapbeam.solver.run.verdict import judge_run
from gapbeam.studies.modes.theory_comparison import WHOLE, beams_of
from gapbeam.studies.trials.starts import seated
from tests.shared.command import DEMO
from tests.shared.models import COARSE, beam_model

pytestmark = pytest.mark.versions

E, RHO, L, H, B = 2.1e11, 7919.0, 0.510, 0.012, 0.020


def case(*settings: str) -> Case:
    return read_case_text(DEMO.read_text(), settings, "demo")


def hertz(root: float, length: float) -> float:
    """Euler and Bernoulli: f = root^2 / (2 pi l^2) sqrt(E I / rho A)."""
    return root**2 / (2.0 * pi * length**2) * sqrt(E * B * H**3 / 12.0 / (RHO * B * H))


@pytest.mark.parametrize(
    ("settings", "root", "length", "words"),
    [
        ((), 1.8751, 0.46, "clamped overhang"),
        (("support.length=0.509",), 4.7300, 0.51, "free beam"),
        (("support.length=0.509", "contact.points=[0.0, 0.2, 0.509]", "contact.stiffness=1e7"), pi, 0.309,
         "pinned span of 0.309 m"),
    ],
)  # fmt: skip
def test_a_stub_does_not_bend(settings: tuple[str, ...], root: float, length: float, words: str) -> None:
    """The overhang of 1 mm had 1e7 Hz."""
    found = case(*settings)
    assert overhang_frequency(found) == pytest.approx(hertz(root, length), rel=1e-4)
    assert bending_words(found) == words


@pytest.mark.parametrize("kind", ["clamped", "pinned", "guided"])
@pytest.mark.parametrize(("at", "start"), [(0.0, 0.49), (0.51, 0.0), (0.1, 0.4), (0.4, 0.05)])
def test_a_part_that_a_joint_holds_is_no_overhang(kind: str, at: float, start: float) -> None:
    """From a clamp to the stop at the tip a reed bends as a cantilever, which was called an overhang of the stop."""
    text = DEMO.read_text().replace(
        "[support]\nlength = 0.050", f'[[support]]\nname = "stop"\nregion = "stop"\nfrom = {start}\nto = {start + 0.02}'
    )
    joint = f'[[joint]]\nname = "root"\ntype = "{kind}"\npoint = {at}\n'
    found = read_case_text(f"{text}\n{joint}", ["mesh={ dimension = 2 }"], "demo")
    parts = [(0.0, start), (start + 0.02, 0.51)]
    (length,) = [end - begin for begin, end in parts if begin <= at <= end]
    longest = max(end - begin for begin, end in parts)
    assert bending_words(found) == (f"cantilever of {length:g} m" if length == longest else "clamped overhang")


SUPPORT = 'support=[{{ name = "s", from = 0.0, to = 0.05, clearance = 1e-4, {} }}]'


@pytest.mark.parametrize(
    "exact",
    [
        ("model=rigid",),
        ('model={ type = "reduced", modes = 4 }',),
        ("output.points=true",),
        (SUPPORT.format("stiffness = 1e9"),),
        (SUPPORT.format('law = { type = "hunt-crossley", restitution = 0.8 }'),),
    ],
)
@pytest.mark.parametrize("scheme", ["moreau-jean", "implicit-midpoint"])
def test_the_penalty_formulation_is_advised_with_a_scheme_that_takes_it(exact: tuple[str, ...], scheme: str) -> None:
    """A scheme of impulses refused it next, though nothing but the advice had been followed."""
    given = (*exact, "contact.formulation=unilateral", f"time.scheme={scheme}")
    with pytest.raises(CaseError) as refused:
        case(*given)
    words = str(refused.value)
    keys = re.findall(r'(formulation|scheme) = "([a-z-]+)" in \[(contact|time)\]', words)
    assert ("formulation", "penalty", "contact") in keys, words
    case(*given, *(f"{table}.{key}={value}" for key, value, table in keys))


def test_a_falling_beam_moves() -> None:
    """Gravity alone moves a beam that starts undeformed, and none that starts on its seat."""
    seated, falling = case(), case("analysis.start=undeformed")
    only = [replace_loads(one) for one in (seated, falling)]
    assert ["in motion" in line for line in motion(only[0])].count(True) == 1
    assert not any("in motion" in line for line in motion(only[1]))


@pytest.mark.parametrize(("key", "value"), [("velocity", -3.0), ("velocity", 1e-6), ("displacement", 2e-3)])
def test_a_support_that_is_thrown_moves_the_beam(key: str, value: float) -> None:
    """A tool that falls on a plank is a body of a support: it sets the beam in motion, without a load."""
    text = DEMO.read_text().replace(
        "[support]\nlength = 0.050", '[[support]]\nname = "tool"\nregion = "stop"\nfrom = 0.0\nto = 0.05\nBODY'
    )
    thrown, still = (
        read_case_text(
            text.replace("BODY", f"body = {{ mass = 1.0, stiffness = 1e3{own} }}"),
            ["analysis.start=seat", "model.type=beam"],
        )
        for own in (f", {key} = {value}", "")
    )
    assert not any("in motion" in line for line in motion(replace_loads(thrown)))
    assert any("in motion" in line for line in motion(replace_loads(still)))


def test_schemes_that_are_advised_against_created_energy_are_not_refused() -> None:
    """The discrete gradient, which has no potential in Nitsche's method with theta = 0, and the midpoint rule there."""
    ledger = Ledger(2.0, 0.0, 0.0, 1.0, np.zeros(0), algorithmic=-1.0, exchanged=1.0)
    model = beam_model({"mesh": COARSE, "time": {"scheme": "newmark"}})
    gates = EnergyGates(Gates(), model.system.contact, remedy=remedy_for(model.case))
    with pytest.raises(EnergyCreated) as created:
        gates.let_pass(0.0, True, ledger)
    assert "Try the scheme discrete-gradient, a smaller time.step or a softer contact.stiffness" in str(created.value)
    lost = case('contact.formulation={ type = "nitsche", theta = 0 }', "time.scheme=newmark")
    assert remedy_for(lost) == "Try the scheme implicit-midpoint or a smaller time.step"
    case('contact.formulation={ type = "nitsche", theta = 1 }', "time.scheme=discrete-gradient")
    other = 'contact.formulation={ type = "nitsche", theta = 0 }'
    with pytest.raises(CaseError):
        case(other, "time.scheme=discrete-gradient")
    case(other, "time.scheme=implicit-midpoint")


@pytest.mark.parametrize(
    ("keys", "advised"),
    [
        ({"time": {"scheme": "implicit-midpoint"}}, True),
        ({"time": {"scheme": "discrete-gradient"}}, False),
        ({"time": {"scheme": "implicit-midpoint"}, "contact": {"formulation": "augmented-lagrangian"}}, False),
    ],
)
def test_a_conserving_scheme_is_advised_where_it_can_be_taken(keys: dict[str, Any], advised: bool) -> None:
    """Not where it was used, and not where contact has no potential: it would be refused there."""
    model = beam_model({"mesh": COARSE, **keys})
    lossy = Ledger(0.5, 0.0, 0.0, 1.0, np.zeros(0), algorithmic=0.5, exchanged=1.0)
    accounts = Accounts.opened(model.system, model.law, seated(model).state, model.step)
    accounts.ledger = lossy
    with pytest.raises(EnergyLost, match=r"took 0.5 J, 50.0% .* [Tt]ry a smaller time.step") as lost:
        judge_run(model.case, accounts, [])
    assert ("discrete-gradient, which takes none" in str(lost.value)) == advised


def replace_loads(found: Case) -> Case:
    """Keep gravity only."""
    return found.model_copy(update={"load": tuple(load for load in found.load if load.static)})


def test_theory_of_an_i_section() -> None:
    """F of an I section of 20 x 12 mm, flanges 3 mm, web 4 mm: sqrt(I / A) decides, not the box around it."""
    area = B * H - (B - 0.004) * (H - 0.006)
    second = (B * H**3 - (B - 0.004) * (H - 0.006) ** 3) / 12.0
    box, mine = beams_of(case())[WHOLE], beams_of(case(), Section(area * L, area, second))[WHOLE]
    assert mine.mass == pytest.approx(RHO * area)
    ratio = mine.frequency_unit / box.frequency_unit
    assert ratio == pytest.approx(sqrt(second / area * 12.0) / H)
    assert ratio == pytest.approx(1.22, abs=0.01)  # the 22 % that were blamed on the mesh


def test_time_left_leaves_out_the_compilation(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """A first block of 64 steps that takes 28 s to compile, then 1000 steps a second: 99.9 s are left, not hours."""
    now = [0.0]
    monkeypatch.setattr(progress.time, "perf_counter", lambda: now[0])
    with caplog.at_level(logging.INFO, "gapbeam"), progress.ProgressLine(11.0, None, quiet=False) as line:
        line._bar = None
        line._quiet = False
        now[0] = 28.0
        line.advance(0.0064, 64, "contact: base")
        assert caplog.messages == []
        now[0] = 38.0
        line.advance(1.0064, 10_000, "contact: base")
    [message] = caplog.messages
    assert "1000 steps/s" in message
    assert message.endswith(f"{10.0 * (11.0 - 1.0064):.0f} s left")


@pytest.mark.parametrize(("steps", "words"), [(1, "0.10 steps/s"), (23, "2.3 steps/s"), (230, "23 steps/s")])
def test_slow_steps_have_a_speed(
    steps: int, words: str, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Steps of ten seconds are no 0 steps/s, and a run that has passed its end by round-off has not -0 s left."""
    now = [0.0]
    monkeypatch.setattr(progress.time, "perf_counter", lambda: now[0])
    with caplog.at_level(logging.INFO, "gapbeam"), progress.ProgressLine(1.0, 0.3, quiet=False) as line:
        line._bar = None
        line.advance(0.5, 1, "contact: base")
        now[0] = 10.0
        line.advance(1.0 + 1e-15, steps, "contact: base")
    [message] = caplog.messages
    assert words in message
    assert message.endswith(", 0 s left")


def test_a_seat_that_is_not_found_has_a_place_and_a_remedy_that_works() -> None:
    """Gravity pulls the beam out of its support: the message says where, and the undeformed start needs no seat."""
    pulled = case("restraint.axial=1e-9", "model.type=reduced", "time.end=0.001", "load.gravity.direction=[1.0, 0.0]")
    with pytest.raises(NotConverged, match=r"no static seat was found: .*at x = .* m ") as refused:
        gapbeam.model(pulled).seat()
    words = str(refused.value)  # round-off decides whether the spring or the iteration gives out first
    assert "[restraint]" in words or "restraint.axial" in words
    falling = gapbeam.model(gapbeam.read_case(pulled, {"analysis.start": "undeformed"}))
    assert isinstance(falling.seat_or_failure(), NotConverged)
    assert len(list(falling.march(steps=5))) == 5
