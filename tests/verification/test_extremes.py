"""Extremes of every figure: the default scheme answers with a closed energy balance, or says clearly why not."""

from __future__ import annotations

from itertools import islice
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mpi4py import MPI

from gapbeam.solver.case.case import Case
from gapbeam.solver.case.checks.all_checks import contradictions_in
from gapbeam.solver.march.simulation import march_of_model
from gapbeam.solver.march.stepwise_march import march
from gapbeam.solver.models.model import build_model
from gapbeam.solver.seat.static_seat import find_seat
from gapbeam.solver.system.semi_discrete import STIFFNESS, VALUE
from gapbeam.studies.trials.response import TrialResponse, try_case

STEPS = 60
RESIDUAL = 1e-6  # of the energy exchanged, once that is above round-off


def extreme_case(
    clearance: float,
    poisson: float,
    slenderness: float,
    force: float,
    frequency: float,
    ratio: float,
    stiffness: float | str,
    steps_per_period: int,
    degree: int,
) -> Case:
    """A steel beam in plane strain with these figures; its step follows the forcing."""
    length = 0.51
    tables: dict[str, Any] = {
        "beam": {"length": length, "thickness": length / slenderness, "width": 0.02},
        "material": {"young_modulus": 2.1e11, "poisson_ratio": poisson, "density": 7919.0},
        "damping": {"frequencies": [40.0, 300.0], "ratios": [ratio, ratio]},
        "support": {"length": 0.05, "clearance": clearance},
        "mesh": {
            "dimension": 2,
            "plane": "strain",
            "degree": degree,
            "size": 0.06,
            "support_size": 12.5e-3,
            "cells_through_thickness": 2,
        },
        "contact": {"stiffness": stiffness},
        "load": [
            {"type": "gravity"},
            {"type": "harmonic_force", "point": 0.15, "amplitude": force, "frequency": frequency},
        ],
        "time": {
            "step": 1.0 / (frequency * steps_per_period),
            "end": STEPS / (frequency * steps_per_period),
        },
    }
    return Case.model_validate(tables)


def judged(case: Case) -> TrialResponse:
    """Try a case; what must hold for every case holds."""
    trial = try_case(case)
    figures = (trial.created, trial.residual, trial.penetration, trial.peak_force)
    if trial.verdict == "passed":
        assert trial.reached == pytest.approx(case.time.end)
        assert all(np.isfinite(figures))
        assert trial.created < RESIDUAL
    else:
        assert len(trial.message) > 40, "an error that says what to try"
    return trial


@pytest.mark.parametrize("clearance", [0.0, 1e-9, 8e-6, 1e-4, 1e-2, -6e-6, -1e-4])
@pytest.mark.parametrize("force", [0.0, 10.0, 1e4])
def test_clearances_and_forces(clearance: float, force: float) -> None:
    """Every clearance under every force passes."""
    trial = judged(extreme_case(clearance, 0.3, 42.5, force, 20.0, 0.01, "auto", 200, 2))
    assert trial.verdict == "passed", trial.message


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.49, 0.4999])
@pytest.mark.parametrize("slenderness", [5.0, 50.0, 500.0])
def test_shapes_and_materials(poisson: float, slenderness: float) -> None:
    """From stubby to hair-thin, from cork to rubber; a hair of rubber is refused for round-off."""
    trial = judged(extreme_case(1e-4, poisson, slenderness, 50.0, 20.0, 0.01, "auto", 200, 2))
    if (slenderness, poisson) == (500.0, 0.4999):
        assert trial.verdict == "refused"
        assert "round-off in the stiffness of the mesh" in trial.message
    else:
        assert trial.verdict == "passed", trial.message


@pytest.mark.parametrize("frequency", [0.01, 1.0, 200.0, 2e4])
@pytest.mark.parametrize("ratio", [0.0, 0.01, 3.0])
def test_frequencies_and_damping(frequency: float, ratio: float) -> None:
    """From quasi-static to ultrasonic, undamped and beyond critical damping."""
    trial = judged(extreme_case(1e-4, 0.3, 42.5, 200.0, frequency, ratio, "auto", 40, 2))
    assert trial.verdict == "passed", trial.message


@pytest.mark.parametrize(
    ("clearance", "slenderness", "force", "steps_per_period", "degree"),
    [(0.0, 5.0, 1.0, 20, 1), (-1e-4, 498.0, 568.0, 384, 2)],
    ids=["steps of 5 s", "base and gland press with 1e7 N"],
)
def test_what_is_carried_along_stays_exact_where_contact_alone_holds(
    clearance: float, slenderness: float, force: float, steps_per_period: int, degree: int
) -> None:
    """K u and the penetration after ten steps against new products, to 1e-5; 1e-3 goes where a free flight cancels."""
    case = extreme_case(clearance, 0.0, slenderness, force, 0.01, 0.0, "auto", steps_per_period, degree)
    model = build_model(case, MPI.COMM_SELF)
    contact, operators = model.system.contact, model.system.operators
    start = find_seat(model.system, model.law, model.seat_springs).state
    for step in islice(march(march_of_model(model, case.time.scheme), start), 10):
        end = step.new
    true = operators.apply_stiffness(end.u[VALUE])
    assert np.abs(end.u[STIFFNESS] - true).max() < 1e-5 * np.abs(true).max()
    depth = contact.depth(contact.interface.trace(end.u[VALUE], operators))
    assert np.abs(end.depth - depth).max() < 1e-5 * np.abs(depth).max()


CASES = st.builds(
    extreme_case,
    clearance=st.sampled_from([0.0, 1e-9, 1e-6, 1e-4, 1e-3, 1e-2, -1e-6, -1e-4]),
    poisson=st.floats(0.0, 0.4999),
    slenderness=st.floats(5.0, 500.0),
    force=st.floats(0.0, 1e4),
    frequency=st.floats(-2.0, 4.3).map(lambda power: 10.0**power),
    ratio=st.sampled_from([0.0, 0.001, 0.05, 1.0, 5.0]),
    stiffness=st.one_of(st.just("auto"), st.floats(8.0, 18.0).map(lambda power: 10.0**power)),
    steps_per_period=st.integers(20, 5000),
    degree=st.sampled_from([1, 2]),
)


@settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(case=CASES)
def test_no_draw_passes_with_created_energy(case: Case) -> None:
    """Whatever is drawn: a closed balance or a clear error, never a quiet wrong answer."""
    if not contradictions_in(case):
        judged(case)
