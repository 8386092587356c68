"""Checks, warnings and advice follow the contact that acts at each support: its own keys, or those of [contact]."""

from __future__ import annotations

from typing import Any

import pytest
from mpi4py import MPI

from gapbeam.solver.case.case import Case
from gapbeam.solver.case.checks.case_warnings import warnings
from gapbeam.solver.case.reading.case_reader import read_case_tables
from gapbeam.solver.diagnostics.energy_gates import remedy_for
from gapbeam.solver.messages.errors import CaseError
from gapbeam.solver.models.energy_creation import energy_creator
from gapbeam.solver.models.model import build_model

HERTZ = {"type": "hunt-crossley", "exponent": 1.5, "restitution": 0.8}
FORCE = {"type": "harmonic_force", "name": "f", "point": 0.5, "amplitude": 20.0, "frequency": 20.0}
WHOLE = {"support_stiffness": 1e9, "support_damping": 0.0}
IDLE = "at no support: each brings its own"
LENGTH, WIDTH = 0.05, 0.02  # of a support, m


def case(own: dict[str, Any], contact: dict[str, Any], other: dict[str, Any] | None = None, **more: Any) -> Case:
    """Return a beam on two slots with keys of their own, without damping elsewhere."""
    tables = {
        "beam": {"length": 1.0, "thickness": 0.02, "width": WIDTH},
        "material": {"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": 7850.0},
        "damping": {"mass": 0.0, "stiffness": 0.0},
        "support": [
            {"name": "a", "from": 0.0, "to": LENGTH, "clearance": 1e-4, **own},
            {"name": "b", "from": 0.9, "to": 0.9 + LENGTH, "clearance": 1e-3, **(own if other is None else other)},
        ],
        "contact": contact,
        "model": {"type": "beam"},
        "mesh": {"dimension": 2, "support_size": 0.005},
        "load": [{"type": "gravity"}, FORCE],
        "time": {"end": 0.2, "step": 1e-4},
        **more,
    }  # fmt: skip
    return read_case_tables(tables)


@pytest.mark.parametrize(
    ("own", "contact", "key"),
    [
        ({"damping": 0.0}, {"damping": 1e5}, "damping acts"),
        ({"law": {**HERTZ, "exponent": 1.0, "restitution": 1.0}}, {"damping": 1e5}, "damping acts"),
        ({"friction": 0.0}, {"friction": {"coefficient": 0.2}}, "friction acts"),
        (WHOLE, {"stiffness": 1e12, "damping": 1e5}, "stiffness and damping act"),
    ],
)  # fmt: skip
def test_keys_that_act_nowhere_are_said_and_damp_nothing(
    own: dict[str, Any], contact: dict[str, Any], key: str
) -> None:
    """With one support that takes them they act, and nothing is said."""
    alone = warnings(case(own, contact))
    assert f"[contact] {key} {IDLE}" in alone
    assert any("no damping, neither" in line for line in alone)
    shared = warnings(case(own, contact, {}))
    assert not any(IDLE in line or "no damping" in line for line in shared)


def test_friction_that_acts_nowhere_is_none() -> None:
    """It neither rubs nor holds the beam, and a search for a periodic response takes it."""
    rubbing = {"friction": {"coefficient": 0.2}}
    assert case({"friction": 0.0}, rubbing).friction is None
    assert case({"friction": 0.0}, rubbing, {}).friction is not None
    assert case({"friction": 0.0}, rubbing, analysis={"type": "periodic"}).friction is None
    with pytest.raises(CaseError, match="in the search for a periodic response"):
        case({"friction": 0.0}, rubbing, {}, analysis={"type": "periodic"})


def test_a_stiffness_is_asked_for_only_where_that_of_contact_acts() -> None:
    """A law with an exponent in [contact] needs none where each support brings its own."""
    case({"stiffness": 1e14}, {"law": HERTZ})
    with pytest.raises(CaseError, match="it cannot be computed for a law with an exponent"):
        case({"stiffness": 1e14}, {"law": HERTZ}, {})


def test_no_curve_follows_a_key_that_acts_nowhere() -> None:
    """Its response would be the same everywhere."""
    curve = {"type": "periodic", "continuation": {"key": "contact.stiffness", "low": 1e11, "high": 1e12}}
    with pytest.raises(CaseError, match="acts at no support"):
        case({"support_stiffness": 1e9}, {"stiffness": 1e11}, analysis=curve)
    case({"support_stiffness": 1e9}, {"stiffness": 1e11}, {}, analysis=curve)


@pytest.mark.parametrize(
    ("own", "key", "unit"),
    [
        ({"support_stiffness": 1e13}, "support.a.support_stiffness", LENGTH * WIDTH),
        ({"stiffness": 1e16}, "support.a.stiffness", 1.0),
    ],
)
def test_advice_names_the_stiffest_contact(own: dict[str, Any], key: str, unit: float) -> None:
    """Its stiffness at the limit is accepted, where the scheme creates energy on a stiffer one."""
    newmark = {"end": 0.2, "step": 1e-4, "scheme": "newmark"}
    stiff = build_model(case(own, {"stiffness": 1e12}, {}, time=newmark), MPI.COMM_SELF)
    fault = energy_creator(stiff)
    assert fault is not None
    limit = 2.1e11 / stiff.body.meshed.facet_length
    assert f"{key} = {limit * unit:.3g}" in fault.hint
    name = key.rpartition(".")[2]
    assert (
        energy_creator(build_model(case({name: limit * unit}, {"stiffness": 1e12}, {}, time=newmark), MPI.COMM_SELF))
        is None
    )
    assert f"a softer {key} or contact.stiffness" in remedy_for(stiff.case)
