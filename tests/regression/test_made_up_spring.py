"""A law with a spring of its own is added by a file and a few lines, and is marched with that spring, or refused."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from gapbeam.solver.contact.laws import law_choice
from gapbeam.solver.contact.laws.contact_law import make_law
from gapbeam.solver.contact.laws.damper import Damper
from gapbeam.solver.contact.laws.law_choice import SPRINGS
from gapbeam.solver.contact.laws.law_tables import ChosenLaw
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
        "from gapbeam.solver.contact.laws.made_up_spring import CubicStop, cubic_spring\n"
        "from gapbeam.solver.contact.laws.springs",
    ),
    ("PiecewiseLinear | ElasticPlastic,", "PiecewiseLinear | ElasticPlastic | CubicStop,"),
    ('SPRINGS = {"": 0}', 'SPRINGS = {"": 0, "cubic-stop": 1}'),
    (
        'not known."""\n    return nan',
        'not known."""\n    if formula == 1:\n        return cubic_spring(at, depth)\n    return nan',
    ),
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
    """Force and duration of a contact by quadrature, energy at any step, all forms of the law by closed forms.

    Machine code is not taken from the cache of the package, which does not know the law.
    """
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
        env={**process_environment(), "NUMBA_CACHE_DIR": str(tmp_path / "machine_code")},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    message = json.loads(done.stdout.splitlines()[-1])
    status, words = message["check"]
    assert status == 0, words
    for name, scale in (("fine", S), ("stiff", 1.0e-3)):
        run, (deepest, half_period) = message[name], depth_and_half_period(scale)
        assert (run["status"], run["loop"]) == (0, "compiled"), run
        force = AREA * K * (deepest + deepest**3 / scale**2)
        assert run["force"] == pytest.approx(force, rel=1.0e-3), name
        lasted = run["time"] - CLEARANCE / SPEED - (run["place"] + CLEARANCE) / SPEED
        assert lasted == pytest.approx(half_period, rel=1.0e-3), name
    assert max(message["missed"].values()) < 1e-9, message["missed"]
    energy = 0.5 * MASS * SPEED**2
    for name in ("fine", "coarse"):
        assert message[name]["energy"] == pytest.approx(energy, rel=1.0e-9), "the default scheme conserves at any step"
    assert message["damped"]["energy"] < 0.9 * energy
    assert abs(message["linear"]["force"] - message["fine"]["force"]) > 0.1 * message["linear"]["force"]
    status, words = message["exact"]
    assert (status, "kelvin-voigt, the law that the formulation unilateral knows" in words) == (2, True), words
    status, words = message["sweep"]
    assert (status, "2 of 2" in words) == (0, True), words


class Proportional(CubicStop):
    """A cubic stop with a damper that knows K d^n."""

    def damper(self, damping: float | Array, areas: float | Array) -> Damper:
        """Return Hunt and Crossley's damper."""
        del damping, areas
        return Damper("hunt-crossley", 1.0)


def test_a_spring_without_a_formula_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """A law without a number, or without a line; Hunt and Crossley's damper is chi K d^n, whatever spring there is."""
    table = CubicStop(type="cubic-stop", scale=S)
    with pytest.raises(ValueError, match="no spring formula of a law 'cubic-stop'"):
        make_law(table, K, 1.0e-8)
    monkeypatch.setitem(SPRINGS, "cubic-stop", 1)
    with pytest.raises(UserError, match="cubic-stop: found a potential"):  # its number has no line
        make_law(table, K, 1.0e-8)
    with pytest.raises(UserError, match="cubic-stop: found the damper hunt-crossley"):
        make_law(Proportional(type="cubic-stop", scale=S), K, 1.0e-8)


def test_names_that_nothing_asks_for_are_refused() -> None:
    """A law whose author writes a `pressure` would be marched without it."""
    with pytest.raises(TypeError, match=r"Cubic defines pressure, .*`own_spring`"):

        class Cubic(ChosenLaw):
            type: Literal["cubic"]

            def pressure(self, depth: Array) -> Array:
                """Return what nothing asks for."""
                return depth**3
