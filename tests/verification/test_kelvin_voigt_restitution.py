"""The damping of the linear law from a restitution: closed forms, and a mass that returns as fast as asked.

Source: the damped oscillator during one contact. A mass on K d + c d' with zeta = c / (2 sqrt(K m)) and
s = sqrt(1 - zeta^2) leaves with e = exp(-pi zeta / s) where d is zero again (adhesive), and with
e = exp(-(zeta / s) (pi - 2 asin zeta)) where the force is zero (clipped).
"""

from __future__ import annotations

from math import asin, exp, pi, sqrt
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from gapbeam.solver.case.case import Case, case_to_toml
from gapbeam.solver.case.checks.case_warnings import warnings
from gapbeam.solver.case.computed_defaults import Default, contact_damping
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.contact.laws.contact_law import make_law
from gapbeam.solver.contact.laws.law_choice import kelvin_voigt_ratio, kelvin_voigt_restitution
from gapbeam.solver.models.model import build_model
from tests.shared.case_texts import assert_says, faults_of, spoiled, written
from tests.shared.models import COARSE, beam_case
from tests.shared.toys import SCHEMES, start, steps_of, stopped_oscillator

STIFFNESS, SPEED = 1.0e4, 0.7
RATIO_OF_08 = float(brentq(lambda z: exp(-z / sqrt(1.0 - z * z) * (pi - 2.0 * asin(z))) - 0.8, 0.01, 0.5, xtol=1e-15))
"""The damping ratio of a clipped restitution of 0.8."""


def damped(restitution: float, **contact: Any) -> Case:
    """A case whose supported part weighs 1 kg/m^2, with the damping of a restitution."""
    law = {"type": "kelvin-voigt", "restitution": restitution}
    return beam_case(
        {
            "beam": {"thickness": 0.01},
            "material": {"density": 100.0},
            "contact": {"stiffness": STIFFNESS, "law": law, **contact},
        }
    )


def computed(case: Case, stiffness: float = STIFFNESS) -> Default:
    """The damping of a case."""
    default = contact_damping(case, stiffness)
    assert default is not None
    return default


@pytest.mark.parametrize("restitution", [0.999999, 0.95, 0.8, 0.5, 0.2, 0.14])
@pytest.mark.parametrize("adhesive", [False, True])
def test_ratio_solves_the_closed_form(restitution: float, adhesive: bool) -> None:
    """The damping ratio put into the closed form gives the restitution back, to 1e-12."""
    zeta = kelvin_voigt_ratio(restitution, adhesive)
    assert 0.0 < zeta < 1.0
    s = sqrt((1.0 - zeta) * (1.0 + zeta))
    angle = pi if adhesive else pi - 2.0 * asin(zeta)
    assert exp(-zeta / s * angle) == pytest.approx(restitution, rel=1e-12)
    assert kelvin_voigt_restitution(zeta, adhesive) == pytest.approx(restitution, rel=1e-12)


@pytest.mark.parametrize("restitution", [0.13, 0.1, 0.01])
def test_ratio_beyond_critical_damping(restitution: float) -> None:
    """A clipped contact returns less than exp(-2) by a ratio above 1: against an adaptive integrator, to 1e-8."""
    zeta = kelvin_voigt_ratio(restitution, False)
    assert zeta > 1.0

    def force(_time: float, state: np.ndarray) -> float:
        return float(state[0] + 2.0 * zeta * state[1])

    force.terminal, force.direction = True, -1.0  # type: ignore[attr-defined]
    motion = solve_ivp(
        lambda time, state: [state[1], -force(time, state)],
        (0.0, 1.0e3),
        [0.0, 1.0],
        method="DOP853",
        events=force,
        rtol=1e-12,
        atol=1e-15,
    )
    assert -motion.y_events[0][0, 1] == pytest.approx(restitution, abs=1e-8)


def test_ratio_at_critical_damping() -> None:
    """The clipped closed form is smooth at zeta = 1, where it is exp(-2); a face that may pull never lets go there."""
    around = [kelvin_voigt_restitution(zeta, False) for zeta in (1.0 - 1e-9, 1.0, 1.0 + 1e-9)]
    assert around == pytest.approx([exp(-2.0)] * 3, rel=1e-8)
    assert kelvin_voigt_restitution(1.0, True) == 0.0


def test_no_loss_needs_no_damping() -> None:
    """A restitution of 1 is zeta = 0, and one of 0 is out of reach."""
    assert kelvin_voigt_ratio(1.0, False) == kelvin_voigt_ratio(1.0, True) == 0.0
    for restitution in (0.0, 1.1):
        with pytest.raises(ValueError, match=r"not in \(0, 1\]"):
            kelvin_voigt_ratio(restitution, False)


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("restitution", [0.9, 0.5, 0.1])
@pytest.mark.parametrize("tension", ["clipped", "adhesive"])
@pytest.mark.parametrize(("scheme", "tolerance"), [("discrete-gradient", 1e-6), ("newmark", 3e-3)])
def test_a_mass_returns_as_asked(restitution: float, tension: str, scheme: str, tolerance: float) -> None:
    """The law that the case becomes returns 1 kg on 1 m^2 with the restitution asked for.

    To 1e-6 by the discrete gradient, and to 3e-3 by Newmark, for whom the law jumps at touch.
    """
    case = damped(restitution, tension=tension)
    law = make_law(case.contact.law, STIFFNESS, 1e-9, computed(case).value, adhesive=tension == "adhesive")
    count, duration = 2000, pi / sqrt(STIFFNESS)
    system = stopped_oscillator()
    steps = steps_of(system, law, SCHEMES[scheme], start(system, v=SPEED), 1.5 * duration / count, 2 * count)
    assert steps[-1].new.depth[0] < 0.0
    assert -steps[-1].new.v[0, 0] / SPEED == pytest.approx(restitution, abs=tolerance)


def test_the_default_says_why_and_what_half_and_double_do() -> None:
    """The damping is 2 zeta sqrt(K m) with m = density thickness; with it the restitutions of half and twice that."""
    default = computed(damped(0.8))
    assert default.value == pytest.approx(2.0 * RATIO_OF_08 * sqrt(STIFFNESS * 1.0), rel=1e-10)
    assert (default.key, default.unit) == ("contact.damping", "Pa s/m")
    assert "restitution 0.8, clipped: zeta = 0.07436" in default.reason
    assert "1 kg/m^2, on K = 1e+04 Pa/m" in default.reason
    assert default.consequence == "half: restitution 0.892; double: 0.652"


def test_points_share_the_mass_of_the_supported_part() -> None:
    """Two points carry density x thickness x width x support length / 2 each: 0.5 g here."""
    default = computed(damped(0.8, points=[0.0, 0.05]))
    assert default.value == pytest.approx(2.0 * RATIO_OF_08 * sqrt(STIFFNESS * 0.5e-3), rel=1e-10)
    assert default.unit == "N s/m"


def test_a_law_without_restitution_keeps_its_damping() -> None:
    """contact.damping is taken as given, and nothing is computed."""
    case = beam_case({"contact": {"stiffness": STIFFNESS, "damping": 7.0}})
    assert contact_damping(case, STIFFNESS) is None


def test_the_model_is_damped() -> None:
    """The computed damping reaches the law of the model and is among the defaults, 1e-12."""
    law = {"type": "kelvin-voigt", "restitution": 0.6}
    model = build_model(beam_case({"contact": {"law": law}, "mesh": COARSE}), MPI.COMM_SELF)
    stiffness, damping = model.defaults
    assert (stiffness.key, damping.key) == ("contact.stiffness", "contact.damping")
    zeta = kelvin_voigt_ratio(0.6, False)
    assert damping.value == pytest.approx(2.0 * zeta * sqrt(stiffness.value * 7919.0 * 0.012), rel=1e-12)
    depth = np.full(model.system.contact.size, 1.0e-6)
    damped_part = model.law.damping(depth)
    assert damped_part == pytest.approx(damping.value, rel=1e-12)


BAD = {
    "twice": (
        'damping = 1e4\nlaw = { type = "kelvin-voigt", restitution = 0.8 }',
        ["[contact.law] restitution", "0.8 together with damping = 10000", "one of the two", "leave damping out"],
    ),
    "exact contact": (
        'formulation = "nitsche"\nlaw = { type = "kelvin-voigt", restitution = 0.8 }',
        ["[contact.law] restitution", "0.8 with the formulation nitsche", "no damping", 'formulation = "penalty"'],
    ),
    "no rebound": (
        'law = { type = "kelvin-voigt", restitution = 0.0 }',
        ["[contact.law] restitution", "0.0", "a number greater than 0 and not more than 1"],
    ),
}


@pytest.mark.parametrize(("new", "words"), BAD.values(), ids=BAD)
def test_a_bad_restitution_is_explained(tmp_path: Any, new: str, words: list[str]) -> None:
    """One fault, with where, what was found, what was expected and what to try."""
    (fault,) = faults_of(written(tmp_path, spoiled('stiffness = "auto"', new)))
    assert_says(fault, words)


def test_a_restitution_is_damping(tmp_path: Any) -> None:
    """A case that is damped by nothing else reads back as written, and is not warned to move for ever."""
    text = spoiled('stiffness = "auto"', 'tension = "adhesive"\nlaw = { type = "kelvin-voigt", restitution = 0.8 }')
    case = read_case(written(tmp_path, text.replace("frequencies = [40.0, 300.0]\nratios = [0.01, 0.01]", "")))
    assert warnings(case) == []
    assert read_case(written(tmp_path, case_to_toml(case))) == case
