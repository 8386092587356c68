"""Verdicts on scenes that rest, move a little, or move without a change of contact: nothing is wrong with them."""

from __future__ import annotations

from dataclasses import replace
from math import inf
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI

import gapbeam
from gapbeam.solver.case.solution_tables import AssumptionLimits, Gates
from gapbeam.solver.diagnostics.assumption import Assumption, FrequencyContent, vibrating_share
from gapbeam.solver.diagnostics.energy_ledger import Ledger
from gapbeam.solver.messages.errors import CaseError
from gapbeam.solver.models.model import build_model
from gapbeam.solver.run import scene_summary
from gapbeam.solver.run.assumptions import frequency_findings, motion_findings
from gapbeam.solver.run.assumptions.frequency_findings import RESONANT, RIGID, of_resonance, of_step
from gapbeam.solver.run.assumptions.motion_findings import BESIDE_CLEARANCE, INSIDE, RESTRAINED
from gapbeam.solver.run.verdict import UNDER_NOISE
from gapbeam.studies.trials.response import respond
from gapbeam.studies.trials.starts import seated
from tests.shared.command import DEMO
from tests.shared.models import COARSE, GRAVITY, beam_model

FORCE = {"type": "harmonic_force", "point": 0.51}
SCENES: dict[str, tuple[dict[str, Any], ...]] = {
    "gravity alone": (GRAVITY,),
    "an amplitude of 0": (GRAVITY, FORCE | {"amplitude": 0.0, "frequency": 20.0}),
    "a force of 1e-12 N": (GRAVITY, FORCE | {"amplitude": 1.0e-12, "frequency": 20.0}),
    "a quasi-static force": (GRAVITY, FORCE | {"amplitude": 1.0e-3, "frequency": 0.5}),
    "quasi-static shaking": (GRAVITY, {"type": "base_motion", "amplitude": 1.0e-3, "frequency": 0.5}),
}


@pytest.mark.parametrize("kind", ["full", "rigid", "beam"])
@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("steps", [1, 40])
def test_nothing_is_wrong_with_a_scene_at_rest(kind: str, scene: str, steps: int) -> None:
    """Status 0, and no assumption is passed: a free vibration by round-off is no resonance."""
    model = beam_model(
        {"mesh": COARSE, "model": {"type": kind}, "damping": {"mass": 4.4, "stiffness": 9.4e-6}},
        SCENES[scene],
        {"tip": 0.51},
    )
    found = respond(model, seated(model).state, steps, model.step, watched=True)
    assert found.verdict == "passed", found.message
    assert found.created == 0.0
    true = [RESTRAINED.name] + [RIGID.name] * ("quasi" in scene)  # it strains in the seat; a contact rings
    passed = [one for one in found.findings if one.assumption.name not in true]
    assert [one.words for one in passed if one.verdict != "holds"] == []


@pytest.mark.parametrize("preload", [0.0, 3.0])
@pytest.mark.parametrize(
    ("slow", "ringing", "share"), [(1.0, 0.0, 0.02), (1.0, 0.1, 0.12), (0.0, 1.0, 1.0), (1.0, 2.0, 0.71)]
)
def test_vibrations_are_weighed_beside_slow_motion(preload: float, slow: float, ringing: float, share: float) -> None:
    """A mass on a spring under F sin(r w t) rings with an amplitude e F/k: it vibrates by r + e where e is small."""
    times = np.linspace(0.0, 2000.0, 40001)  # w = k = F = 1, r = 1/50
    moved = slow * np.sin(0.02 * times) + ringing * np.sin(times)
    speed = 0.02 * slow * np.cos(0.02 * times) + ringing * np.cos(times)
    history = {
        "time": times,
        "kinetic_energy": 0.5 * speed**2,
        "strain_energy": np.zeros_like(times),
        "contact_energy": 0.5 * (preload + moved) ** 2,
        "load_work": np.stack([preload * moved, -moved], axis=1),
    }
    assert vibrating_share(history, [True, False]) == pytest.approx(share, rel=0.1)


SHAKEN = {"type": "harmonic_force", "name": "shaker", "point": 0.3, "amplitude": 1.0, "frequency": 3000.0}
STEPPED = {"type": "step_force", "name": "jump", "point": 0.3, "amplitude": 1.0}


@pytest.mark.parametrize(
    ("load", "verdict"),
    [(SHAKEN, "failure"), (SHAKEN | {"frequency": 20.0}, "holds"), (STEPPED, "holds"), (None, "holds")],
    ids=["shaken", "shaken slowly", "stepped", "weight"],
)
def test_free_motion_is_no_resonance(load: dict[str, Any] | None, verdict: str) -> None:
    """A motion that loads have not brought is at none, nor what rings after steps and contacts; one they feed is."""
    loads = ({"type": "gravity"}, *([] if load is None else [load]))
    model = beam_model({"mesh": COARSE}, loads, {"tip": 0.51})
    content = FrequencyContent(np.full(100, 3000.0))
    free = Ledger(1.0, 1.0, 0.0, 2.0, np.zeros(len(loads)), largest_kinetic=1.0)
    fed = replace(free, absolute_work=1.5)
    model = replace(model, case=model.case.model_copy(update={"time": model.case.time.model_copy(update={"end": 1.0})}))
    assert of_resonance(model.case, model, content, free, 0).verdict == "holds"
    assert of_resonance(model.case, model, content, fed, 0).verdict == verdict


def test_modes_that_the_step_does_not_resolve_are_named() -> None:
    """The error is the others' own."""
    model = beam_model({"mesh": COARSE}, probes={"tip": 0.51})
    content = FrequencyContent(np.array([100.0] * 40 + [5000.0] * 60))
    found = of_step(model, content, 0.5, "")
    assert found.verdict == "warning"
    assert "modes from 5e+03 Hz on, which carry 60% of it, are not resolved" in found.words
    assert found.estimate == pytest.approx((2.0 * np.pi * 100.0 * model.step) ** 2 / 12.0, rel=1e-2)


SDNV100: dict[str, Any] = {
    "beam": {"length": 0.02, "thickness": 0.2, "width": 0.02},
    "material": {"young_modulus": 2.0e11, "poisson_ratio": 0.0, "density": 8000.0},
    "support": [
        {"name": "wall", "from": 0.0, "to": 0.02, "region": {"type": "stop", "side": "below"}, "clearance": 0.002}
    ],
    "mesh": {
        "dimension": 2, "degree": 1, "size": 0.01, "support_size": 0.01, "edge_size": 0.01,
        "cells_through_thickness": 100,
    },
    "model": {"type": "full"},
    "contact": {"formulation": "unilateral"},
    "probe": [{"name": "front", "point": [0.01, -0.1]}, {"name": "rear", "point": [0.01, 0.1]}],
    "time": {"end": 1.6e-4, "step": 4.0e-7},
    "analysis": {"type": "transient", "start": "undeformed", "motion": {"velocity": -100.0}},
}  # fmt: skip


def test_a_rod_that_hits_a_wall_passes() -> None:
    """Code_aster SDNV100, 1.6e6 N over 8e-5 s: the impulse of 128 N s is right, and unresolved modes are named."""
    model = build_model(gapbeam.read_case(SDNV100), MPI.COMM_SELF)
    found = respond(model, seated(model).state, 400, model.step, watched=True)
    assert found.verdict == "passed", found.message
    assert found.history["impulse"][-1, 0] == pytest.approx(128.0, rel=1e-2)
    words = next(one.words for one in found.findings if one.assumption.name == "step beside the frequencies")
    assert "are not resolved" in words


def test_gates_accept_other_limits() -> None:
    """A warning, a failure or none, each by the name of its assumption."""
    usual = Assumption(RESONANT.name, "", "1", 0.05, 0.5, "")

    def limits(warning: object = None, failure: object = None) -> tuple[float, float | None]:
        key = RESONANT.name.replace(" ", "_")
        found = usual.limited_by(Gates.model_validate({"warnings": {key: warning}, "failures": {key: failure}}))
        return found.limit, found.failure

    assert limits() == (0.05, 0.5)
    assert limits(warning=0.1) == (0.1, 0.5)
    assert limits(warning=0.7) == (0.7, 0.7)
    assert limits(warning="never") == (inf, None)
    assert limits(failure="never") == (0.05, None)
    assert limits(failure=3.0) == (0.05, 3.0)
    assert limits(failure=0.01) == (0.01, 0.01)


def test_every_assumption_can_have_other_limits() -> None:
    """The keys are the names of the assumptions; those of the material and of the energy have keys of their own."""
    found = [one for module in (frequency_findings, motion_findings, scene_summary) for one in vars(module).values()]
    names = {one.name for one in found if isinstance(one, Assumption)} | {
        UNDER_NOISE[0],
        BESIDE_CLEARANCE[0],
        INSIDE[0],
    }
    assert set(AssumptionLimits.model_fields) == {name.replace(" ", "_") for name in names}


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (["gates.failures.small_rotations=1.0"], "small_rotation"),
        (["gates.failures.small_rotation=-1.0"], "greater than 0|above 0|> 0"),
        (["gates.failures.small_rotation=0.2", "gates.warnings.small_rotation=0.3"], "at least the warning"),
    ],
)
def test_limits_that_contradict_are_refused(settings: list[str], words: str) -> None:
    """Unknown names, negative limits, a failure below the warning."""
    with pytest.raises(CaseError, match=words):
        gapbeam.read_case(DEMO, settings)
