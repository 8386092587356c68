"""Scheme and contact that are known to create energy: which they are, how stiff a contact may be, who is asked."""

from __future__ import annotations

from typing import Any

import pytest

from gapbeam.solver.messages.errors import Fault, UserError
from gapbeam.solver.models.energy_creation import accepted_energy_creators, energy_creator, refuse_energy_creators
from gapbeam.solver.models.model import Model
from gapbeam.studies.trials.response import respond, try_case
from gapbeam.studies.trials.starts import seated
from tests.shared.models import COARSE, beam_case, beam_model

E, CELL, CLEARANCE = 2.1e11, 12.5e-3, 0.107e-3
LIMIT = E / CELL  # Pa/m, of a penalty
NEWMARK = {"type": "newmark"}


def model_of(scheme: dict[str, Any], contact: dict[str, Any], **gates: bool) -> Model:
    """Return a coarse beam, whose contact facets are 12.5 mm long."""
    return beam_model({"mesh": COARSE, "time": {"scheme": scheme}, "contact": contact, "gates": gates})


CREATORS = (
    NEWMARK,
    {"type": "newmark", "gamma": 0.6, "beta": 0.3025},
    {"type": "hht-alpha"},
    {"type": "hht-alpha", "alpha": 0.15},
    {"type": "generalized-alpha", "rho_inf": 0.6},
)
OTHERS = (
    {"type": "discrete-gradient"},
    {"type": "implicit-midpoint"},
    {"type": "newmark", "gamma": 0.65, "beta": 0.331},
    {"type": "hht-alpha", "alpha": 0.2},
    {"type": "generalized-alpha"},
)


@pytest.mark.parametrize("scheme", CREATORS, ids=str)
def test_creators_are_refused_above_the_limit_and_not_below(scheme: dict[str, Any]) -> None:
    """At 1 E/h and with the stiffness left to `auto` they may run; at 1.01 E/h they may not."""
    assert energy_creator(model_of(scheme, {"stiffness": LIMIT})) is None
    assert energy_creator(model_of(scheme, {})) is None
    fault = energy_creator(model_of(scheme, {"stiffness": 1.01 * LIMIT}))
    assert isinstance(fault, Fault)
    assert fault.found.startswith(f"{scheme['type']} on a contact of 1.697e+13 Pa/m, 1.01 E/h")
    assert "at most 1.68e+13 Pa/m" in fault.expected


@pytest.mark.parametrize("scheme", OTHERS, ids=str)
def test_other_schemes_may_run_on_any_contact(scheme: dict[str, Any]) -> None:
    """Conserving, dissipating and well damped schemes are left to the gates."""
    assert energy_creator(model_of(scheme, {"stiffness": 1.0e18})) is None


@pytest.mark.parametrize("formulation", ["unilateral", "augmented-lagrangian", "nitsche"])
def test_exact_formulations_are_too_stiff(formulation: str) -> None:
    """Refused whatever they are made of, with a soft penalty as the way out; impulses are another matter."""
    fault = energy_creator(model_of(NEWMARK, {"formulation": formulation}))
    assert isinstance(fault, Fault)
    assert f"newmark on the formulation {formulation}" in fault.found
    assert ("E/h" in fault.found) == (formulation != "augmented-lagrangian")  # its penalty is soft, its contact is not
    assert 'contact.formulation = "penalty" with contact.stiffness = 1.68e+13' in fault.hint
    assert energy_creator(model_of({"type": "implicit-midpoint"}, {"formulation": formulation})) is None
    assert energy_creator(model_of({"type": "moreau-jean"}, {"formulation": "unilateral"})) is None


def test_laws_with_an_exponent_are_compared_by_their_slope() -> None:
    """K d^1.5 has the slope 1.5 K d^0.5 at 1 % of the clearance: the limit of K is E/h over 1.5 d^0.5."""
    law = {"type": "hunt-crossley", "exponent": 1.5, "restitution": 0.8}
    most = LIMIT / (1.5 * (0.01 * CLEARANCE) ** 0.5)
    assert energy_creator(model_of(NEWMARK, {"law": law, "stiffness": 0.99 * most})) is None
    fault = energy_creator(model_of(NEWMARK, {"law": law, "stiffness": 1.01 * most}))
    assert isinstance(fault, Fault)
    assert f"at most {most:.4g} Pa/m^1.5, 1 E/h at a depth of 1.1e-06 m" in fault.expected


def explicit_model(restitution: float, step: float | str, **contact: Any) -> Model:
    """Return a coarse plastic beam on a soft contact, damped by its speed at touch, for explicit steps."""
    law = {"type": "hunt-crossley", "restitution": restitution}
    return beam_model(
        {
            "material": {"young_modulus": 3.0e9, "density": 1200.0},
            "mesh": {"size": 0.06, "support_size": 12.5e-3, "cells_through_thickness": 2},
            "time": {"scheme": {"type": "central-difference"}, "step": step, "end": 1.0e-3},
            "contact": {"stiffness": 1.0e11, "law": law, **contact},
            "gates": {"accept_energy_growth": True},
        },
        ({"type": "gravity"}, {"type": "harmonic_force", "point": 0.51, "amplitude": 0.5, "frequency": 60.0}),
    )


def test_explicit_steps_do_not_bear_damping_by_the_speed_at_touch() -> None:
    """From the seat a tenth of the computed step creates more energy than there was; what is asked for does not.

    With shorter steps, round-off of the seat decides when the growth begins.
    """
    computed = explicit_model(0.5, "auto")
    fault = energy_creator(computed)
    assert isinstance(fault, Fault)
    assert "central-difference on the law hunt-crossley" in fault.found
    most = float(fault.expected.split("at most ")[1].split(" s,")[0])
    assert most < 0.01 * computed.step
    bearable = explicit_model(0.5, most)
    assert energy_creator(bearable) is None
    grown, kept = (
        respond(one, seated(one).state, steps).created
        for one, steps in ((explicit_model(0.5, 0.1 * computed.step), 200), (bearable, 200))
    )
    assert grown > 0.5
    assert kept < 0.05


def test_explicit_steps_bear_springs_and_massless_contact() -> None:
    """Without loss there is no damper, and massless contact nodes are solved for."""
    assert energy_creator(explicit_model(1.0, "auto")) is None
    assert energy_creator(explicit_model(0.5, "auto", mass="redistributed")) is None


def test_acceptance_is_by_name_and_reported() -> None:
    """Refused with status 2, found and ways out in the message; accepted with a warning; nothing about soft contact."""
    stiff, soft = {"stiffness": 1.0e15}, {"stiffness": 1.0e13}
    made = model_of(NEWMARK, stiff)
    with pytest.raises(UserError) as refused:
        refuse_energy_creators(made.case, made)
    assert refused.value.exit_status == 2
    for words in ("nothing was run", "found: ", "expected: ", "try: ", "gates.accept_energy_growth = true"):
        assert words in str(refused.value)
    accepted = model_of(NEWMARK, stiff, accept_energy_growth=True)
    refuse_energy_creators(accepted.case, accepted)
    (warning,) = accepted_energy_creators(accepted)
    assert "newmark on a contact of 1e+15 Pa/m, 59.5 E/h" in warning
    assert "accepted by name" in warning
    bearable = model_of(NEWMARK, soft)
    refuse_energy_creators(bearable.case, bearable)
    assert accepted_energy_creators(model_of(NEWMARK, soft, accept_energy_growth=True)) == []


def test_trials_go_on_trying_them() -> None:
    """A trial is made to find out: it runs what a run refuses."""
    case = beam_case(
        {"mesh": COARSE, "time": {"scheme": NEWMARK, "end": 1.0e-3}, "contact": {"stiffness": 1.0e15}},
    )
    assert try_case(case).reached == pytest.approx(1.0e-3)


@pytest.mark.parametrize(("restitution", "theta"), [(1.0, 0.51), (0.8, 0.7), (0.2, 1.0)])
def test_impulses_with_too_large_a_theta_are_refused_with_its_bound(restitution: float, theta: float) -> None:
    """Theta of at most 1 / (1 + e) may run, also as the message writes it."""
    scheme = {"type": "moreau-jean", "theta": theta, "restitution": restitution}
    fault = energy_creator(model_of(scheme, {"formulation": "unilateral"}))
    assert isinstance(fault, Fault)
    written = fault.hint.split(";")[0].removeprefix("theta = ")
    assert float(written) == pytest.approx(1.0 / (1.0 + restitution), rel=1e-5)
    safe = scheme | {"theta": float(written)}
    assert energy_creator(model_of(safe, {"formulation": "unilateral"})) is None
    accepted = accepted_energy_creators(model_of(scheme, {"formulation": "unilateral"}, accept_energy_growth=True))
    assert [words.split(":")[0] for words in accepted] == [fault.found.split(":")[0]]
