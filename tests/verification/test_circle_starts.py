"""Starts that are carried from case to case where holes are met all around: no tube begins deep in its wall."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI

import gapbeam
from gapbeam.solver.models.model import Model, build_model, model_of
from gapbeam.solver.system.semi_discrete import VALUE, State
from gapbeam.studies.trials.response import respond
from gapbeam.studies.trials.starts import carried, kicked, seated
from tests.shared.command import PROJECT
from tests.shared.scaled_cases import scaled_case

WIDE, NARROW = 1.2e-4, 0.4e-4  # m
CASE = PROJECT / "cases" / "tube-holes.toml"
QUICK = ['model={type="beam",elements=8}', "damping.ratios=[0.05,0.05]", "load.shaker.ramp=0.0"]


def keys(clearance: float, contact: str) -> list[str]:
    """Return changes that give both holes of the tube a clearance."""
    region = f'{{type="hole",contact="{contact}"}}'
    return [
        text
        for name in ("left", "right")
        for text in (f"support.{name}.clearance={clearance}", f"support.{name}.region={region}")
    ]


def moving(contact: str, size: float = 1.0) -> tuple[Model, State]:
    """Return a tube of a size in wide holes, and a moment in which it flies aside in both."""
    model = build_model(scaled_case(gapbeam.read_case(CASE, [*QUICK, *keys(WIDE, contact)]), size), MPI.COMM_SELF)
    end = respond(model, seated(model).state, 1037).end
    assert end is not None
    return model, end


@pytest.mark.parametrize("contact", ["circle", "points"])
def test_a_narrower_hole_takes_the_tube_along(contact: str) -> None:
    """No point deeper than any was, moved by the excess or, along two axes, sqrt 2 times that; no energy is added."""
    before, end = moving(contact)
    case = gapbeam.read_case(CASE, [*QUICK, *keys(NARROW, contact)])
    model = model_of(case, before.body)
    operators, ring = model.system.operators, model.system.contact
    values = ring.interface.trace(end.u[VALUE], operators)
    excess = float(ring.depth(values).max())
    sideways = np.abs(before.probes["left_orbit"].evaluate(end.u[VALUE], operators)[1])
    assert sideways > NARROW  # heave and pitch alone would not do
    assert excess > 0.9 * (WIDE - NARROW)
    begin = carried(model, model.case.load, end, before.case.load)
    assert begin.state.depth.max() <= max(float(end.depth.max()), 0.0) + 1e-10
    assert len(begin.notes) == 1
    moved = float(begin.notes[0].split("up to ")[1].split()[0])
    assert 0.98 * excess <= moved <= 1.45 * excess
    strains = [float(x.u[VALUE] @ operators.apply_stiffness(x.u[VALUE])) for x in (end, begin.state)]
    assert strains[1] == pytest.approx(strains[0], rel=0.05)


@pytest.mark.parametrize("size", [2.0**-14, 2.0**10])
def test_tubes_of_every_size_are_taken_along_alike(size: float) -> None:
    """By the same share of the clearance, without bending, and with the same words."""
    found = []
    for one in (1.0, size):
        before, end = moving("circle", one)
        case = scaled_case(gapbeam.read_case(CASE, [*QUICK, *keys(NARROW, "circle")]), one)
        begin = carried(model_of(case, before.body), case.load, end, before.case.load)
        assert len(begin.notes) == 1
        found.append((float(begin.notes[0].split("up to ")[1].split()[0]) / one, begin.state.depth / one))
    assert found[1][0] == pytest.approx(found[0][0], rel=5e-3)
    assert found[1][1] == pytest.approx(found[0][1], abs=1e-6 * WIDE)


def test_kicks_go_aside_in_holes() -> None:
    """Some kick is more aside than up, which heave and pitch and a force upward could not be."""
    model, _ = moving("circle")
    tip, operators = model.probes["tip"], model.system.operators
    speeds = np.array(
        [tip.evaluate(kicked(model, model.case.load, number, 3).state.v[VALUE], operators) for number in range(1, 5)]
    )
    assert np.any(np.abs(speeds[:, 1]) > np.abs(speeds[:, 2]))


def test_a_sweep_carries_tubes_to_narrower_circles(tmp_path: Path) -> None:
    """From the seat and from the point before: all pass, and the walls give no response energy that it never had."""
    changes: list[Any] = [*QUICK, *keys(WIDE, "circle"), "time.end=0.08"]
    wanted = {"support.left.clearance": [WIDE, 0.8e-4, NARROW]}
    result = gapbeam.sweep(CASE, wanted, changes, output=tmp_path / "sweep", workers=1, carry=True)
    assert result.exit_status == 0
    entries = json.loads((tmp_path / "sweep" / "sweep.json").read_text(encoding="utf-8"))
    assert [entry["start"] for entry in entries] == ["seat", "carried", "carried"]
    assert {entry["verdict"] for entry in entries} == {"passed"}
    assert "moved by up to" in " ".join(entries[2]["notes"])
