"""A law with a spring of its own is added by a file and two lines, and is marched with that spring, or refused."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.optimize import brentq

from gapbeam.solver.contact.laws import law_choice
from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.contact.laws.damper import Damper
from gapbeam.solver.contact.laws.law_tables import ChosenLaw
from gapbeam.solver.contact.laws.own_spring import OwnSpring
from gapbeam.solver.contact.laws.own_spring_law import own_spring_law
from gapbeam.solver.contact.laws.springs import Spring
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.system.operators import Array
from tests.programs.made_up_spring import CubicStop
from tests.shared.command import PROJECT, alone, process_environment

K, S, MASS, SPEED, CLEARANCE, AREA = 1.0e6, 5.0e-3, 1.0, 1.0, 1.0e-3, 0.01
CASE = f"""\
title = "a mass of 1 kg meets a cubic stop at 1 m/s"
contact = {{ stiffness = {K}, law = {{ type = "cubic-stop", scale = {S} }} }}
model = {{ type = "rigid" }}
[beam]
length = 1.0
thickness = 0.1
width = 0.01
[material]
young_modulus = 2.1e11
poisson_ratio = 0.3
density = 1000.0
[[support]]
name = "floor"
from = 0.0
to = 1.0
clearance = {CLEARANCE}
region = {{ type = "stop", side = "below" }}
[[joint]]
name = "rail"
type = "guided"
point = 0.5
[[probe]]
name = "mass"
point = 0.5
[analysis]
type = "transient"
start = "undeformed"
[analysis.motion]
velocity = {-SPEED}
[time]
end = 0.03
step = 1.0e-5
[output]
errors = "none"
"""
CHANGES = (
    (
        "from gapbeam.solver.contact.laws.springs",
        "from gapbeam.solver.contact.laws.made_up_spring import CubicStop\nfrom gapbeam.solver.contact.laws.springs",
    ),
    ("PiecewiseLinear | ElasticPlastic,", "PiecewiseLinear | ElasticPlastic | CubicStop,"),
)


def depth_and_half_period(scale: float) -> tuple[float, float]:
    """Return the largest penetration, m, and the duration of the contact, s, by the energy and a quadrature."""

    def stored(depth: float) -> float:
        return AREA * K * (0.5 * depth**2 + 0.25 * depth**4 / scale**2)

    energy = 0.5 * MASS * SPEED**2
    deepest = float(brentq(lambda depth: stored(depth) - energy, 0.0, SPEED * (MASS / K / AREA) ** 0.5, xtol=1e-16))

    def slowness(angle: float) -> float:  # d = deepest sin(angle); (energy - stored) is divided by cos^2 exactly
        left = AREA * K * deepest**2 * (0.5 + 0.25 * (deepest / scale) ** 2 * (1.0 + np.sin(angle) ** 2))
        return float(deepest / np.sqrt(2.0 * left / MASS))

    return deepest, 2.0 * quad(slowness, 0.0, 0.5 * np.pi)[0]


@pytest.mark.slow(minutes=0.5)
@alone
def test_a_cubic_stop_is_marched_with_its_spring(tmp_path: Path) -> None:
    """Force and duration of a contact by quadrature, energy at any step, other engines by name."""
    room = tmp_path / "overlay" / "gapbeam" / "solver" / "contact" / "laws"
    room.mkdir(parents=True)
    shutil.copy(PROJECT / "tests" / "programs" / "made_up_spring.py", room)
    text = Path(law_choice.__file__).read_text(encoding="utf-8")
    for old, new in CHANGES:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    (room / "law_choice.py").write_text(text, encoding="utf-8")
    case = tmp_path / "case.toml"
    case.write_text(CASE, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-m", "tests.programs.use_made_up_spring", tmp_path / "overlay", case, tmp_path],
        cwd=PROJECT,
        env=process_environment(),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    message = json.loads(done.stdout.splitlines()[-1])
    status, words = message["check"]
    assert status == 0, words
    for name, scale in (("fine", S), ("stiff", 1.0e-3), ("stages", S)):
        run, (deepest, half_period) = message[name], depth_and_half_period(scale)
        assert (run["status"], "cubic-stop has a spring of its own" in run["loop"]) == (0, True), run
        force = AREA * K * (deepest + deepest**3 / scale**2)
        assert run["force"] == pytest.approx(force, rel=1.0e-3), name
        lasted = run["time"] - CLEARANCE / SPEED - (run["place"] + CLEARANCE) / SPEED
        assert lasted == pytest.approx(half_period, rel=1.0e-3), name
    energy = 0.5 * MASS * SPEED**2
    for name in ("fine", "coarse"):
        assert message[name]["energy"] == pytest.approx(energy, rel=1.0e-9), "the default scheme conserves at any step"
    assert message["damped"]["energy"] < 0.9 * energy
    assert abs(message["linear"]["force"] - message["fine"]["force"]) > 0.1 * message["linear"]["force"]
    status, words = message["exact"]
    assert (status, "kelvin-voigt, the law that the formulation unilateral knows" in words) == (2, True), words
    status, words = message["sweep"]
    assert (status, "2 of 2" in words) == (0, True), words


def law_of(scale: float, damping: float = 0.0, share: float = 1.0) -> ContactLaw:
    """Return the law of the program, on a body of two points."""
    table, stiffness = CubicStop(type="cubic-stop", scale=scale), share * np.array([K, 2.0 * K])
    plain = ContactLaw(Spring(stiffness), table.damper(damping, 1.0), touch_depth=1.0e-3 * scale)
    own = table.own_spring(stiffness)
    assert own is not None
    return own_spring_law("cubic-stop", plain, own)


@settings(deadline=None, derandomize=True)
@given(
    depths=st.tuples(*[st.floats(-2.0, 4.0)] * 2), scale=st.sampled_from((1.0e-9, 1.0e-3, 1.0)), dt=st.floats(0.1, 1.0)
)
def test_every_form_of_the_law_has_the_spring(depths: tuple[float, float], scale: float, dt: float) -> None:
    """Pressure, slope and the work of a step by the closed forms, at drawn depths, also close to each other."""
    old, new = (np.full(2, scale * one) for one in depths)
    law, stiffness = law_of(scale), np.array([K, 2.0 * K])

    def stored(depth: Array) -> Array:
        closed = np.maximum(depth, 0.0)
        return np.asarray(stiffness * (0.5 * closed**2 + 0.25 * closed**4 / scale**2))

    closed = np.maximum(new, 0.0)
    assert law.static(new).pressure == pytest.approx(stiffness * (closed + closed**3 / scale**2), rel=1e-12)
    assert law.potential(new) == pytest.approx(stored(new), rel=1e-12)
    mean = law.discrete_gradient(old, new, dt)
    size = float(np.max(stored(old) + stored(new)))
    assert mean.pressure * (new - old) == pytest.approx(stored(new) - stored(old), abs=1e-10 * size)
    assert law.implicit(old, new, dt).pressure == pytest.approx(law.static(new).pressure)
    assert law.softened(0.25).static(new).pressure == pytest.approx(0.25 * law.static(new).pressure)
    assert law.endpoint(new, np.zeros(2), 1.0).elastic == pytest.approx(law.static(new).pressure)
    ahead = 1.0e-6 * scale
    if -2.0 * ahead < new[0] < 1.0e-3 * scale:  # the kink at touch has two slopes
        return
    rise = (law.discrete_gradient(old, new + ahead, dt).pressure - mean.pressure) / ahead
    assert rise == pytest.approx(mean.slope, rel=1e-3, abs=1e-3 * float(np.max(stiffness)))


def test_kernels_have_no_table_of_it() -> None:
    """An engine that takes springs K d^n is refused by the name of the law."""
    with pytest.raises(ValueError, match="cubic-stop has a spring of its own"):
        law_of(1.0e-3).table(2)
    assert law_of(1.0e-3).why_not_compiled == "the contact law cubic-stop has a spring of its own"


WRONG: dict[str, tuple[Callable[[Array], Array], Callable[[Array], Array], Callable[[Array], Array]]] = {
    "not the integral of the pressure": (lambda d: d, np.ones_like, lambda d: d**2),
    "not the derivative of the pressure": (lambda d: d**2, lambda d: d, lambda d: d**3 / 3.0),
    "falls": (lambda d: -d, lambda d: -np.ones_like(d), lambda d: -0.5 * d**2),
    "at touch": (lambda d: 1.0 + d, np.ones_like, lambda d: d + 0.5 * d**2),
}


@pytest.mark.parametrize("found", WRONG)
@pytest.mark.parametrize("size", [2.0**-40, 1.0, 2.0**20])
def test_functions_that_do_not_belong_together_are_refused(found: str, size: float) -> None:
    """A potential or a slope of another spring, a pressure that falls or jumps: refused by name, at every size."""
    pressure, slope, potential = WRONG[found]
    own = OwnSpring(
        lambda d: pressure(d / size), lambda d: slope(d / size) / size, lambda d: size * potential(d / size)
    )
    with pytest.raises(UserError, match=f"the law wrong: found .*{found}"):
        own_spring_law("wrong", ContactLaw(Spring(1.0), touch_depth=size), own)


def test_a_damper_in_proportion_to_another_spring_is_refused() -> None:
    """Hunt and Crossley's damper is chi K d^n, whatever spring the law has."""
    law = ContactLaw(Spring(1.0), Damper("hunt-crossley", 1.0), touch_depth=1.0)
    with pytest.raises(UserError, match="hunt-crossley"):
        own_spring_law("cubic-stop", law, OwnSpring(lambda d: d, np.ones_like, lambda d: 0.5 * d**2))


def test_names_that_nothing_asks_for_are_refused() -> None:
    """A law whose author writes a `pressure` would be marched without it."""
    with pytest.raises(TypeError, match=r"Cubic defines pressure, .*`own_spring`"):

        class Cubic(ChosenLaw):
            type: Literal["cubic"]

            def pressure(self, depth: Array) -> Array:
                """Return what nothing asks for."""
                return depth**3
