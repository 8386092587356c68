"""Stiffness, damping and yield force of whole supports: F = k d for drawn sections, regions and models, by hand."""

from __future__ import annotations

from math import sqrt
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import gapbeam
from gapbeam.solver.messages.errors import CaseError
from gapbeam.solver.run.output.field_files import FieldWriter
from gapbeam.solver.run.output.run_summary import describe_seat
from gapbeam.solver.system.semi_discrete import Snapshots

LENGTH, MIDDLE, FORCE, STIFFNESS = 0.5, 0.25, 1000.0, 5.0e5
GRAVITY = 9.81
FIGURES = {"young_modulus": 2.07e11, "poisson_ratio": 0.3, "density": 7850.0}
HEXAGON = [[-0.25, -0.5], [0.25, -0.5], [0.5, 0.0], [0.25, 0.5], [-0.25, 0.5], [-0.5, 0.0]]
FLAT: dict[str, Any] = {
    "rectangle": "rectangle",
    "box": {"type": "box", "wall": 0.01},
    "i": {"type": "i", "flange": 0.01, "web": 0.008},
    "polygon": {"type": "polygon", "points": HEXAGON},
}
ROUND: dict[str, Any] = {"round": "round", "tube": {"type": "tube", "wall": 0.007}}
PLANES: dict[str, Any] = {"stop": "stop", "slot": "slot"}
AROUND: dict[str, Any] = {
    "hole": "hole",
    "circle": {"type": "hole", "contact": "circle"},
    "walls": {"type": "polygon", "walls": [0.0, 120.0, 240.0]},
}
MODELS: dict[str, Any] = {
    "rigid": {"type": "rigid"},
    "beam": {"type": "beam"},
    "reduced": {"type": "reduced"},
    "rigid sections": {"type": "reduced", "sections": "rigid"},
    "full": {"type": "full"},
}
LOCAL = {"rigid": 1e-5, "beam": 1e-4, "reduced": 6e-3, "rigid sections": 1e-4, "full": 6e-3}
"""What the beam itself gives way in proportion to the support."""


def case(
    section: str, region: str, model: str, size: float = 0.16, support: float = 0.1, dimension: int = 3, **own: Any
) -> dict[str, Any]:
    """Return a guided bar that is pressed on a support of its middle, 1 % of the clearance above it."""
    shape = (FLAT | ROUND)[section]
    if section == "polygon":
        shape = {"type": "polygon", "points": [[size * y, size * z] for y, z in HEXAGON]}
    clearance = 0.0 if region == "stop" else 1.0e-3
    gap = clearance / 2.0 if region == "slot" else clearance
    return {
        "beam": {"length": LENGTH, "thickness": size, "width": size, "section": shape},
        "material": FIGURES,
        "support": [
            {
                "name": "pad",
                "from": MIDDLE - 0.5 * support,
                "to": MIDDLE + 0.5 * support,
                "clearance": clearance,
                "offset": 0.99 * gap,
                "region": (PLANES | AROUND)[region],
                "support_stiffness": STIFFNESS,
                **own,
            }
        ],
        "joint": [{"name": "rail", "type": "guided", "point": MIDDLE}],
        "model": MODELS[model],
        "mesh": {"dimension": dimension, "size": 0.1, "support_size": 0.5 * support, "cells_through_thickness": 2},
        "load": [
            {
                "type": "exciter",
                "name": "press",
                "point": MIDDLE,
                "amplitude": 0.0,
                "frequency": 100.0,
                "preload": -FORCE,
            }
        ],
        "probe": [{"name": "mid", "point": MIDDLE}],
        "time": {"end": 1.0e-3, "step": 1.0e-4},
        "output": {"errors": "none"},
    }


def sunk(tables: dict[str, Any]) -> float:
    """Return how far the support is pressed in at the static seat, m."""
    simulation = gapbeam.model(gapbeam.read_case(tables))
    found = describe_seat(simulation.seat(), simulation.model)
    (support,) = simulation.case.support
    gap = max(face.smallest for face in support.faces) if len(support.faces) == 1 else support.faces[0].gap
    return float(-found["probes"]["mid"][-1] - gap)


def pairs() -> list[tuple[str, str]]:
    """Return all sections in regions that take them."""
    flat = [(section, region) for section in FLAT for region in PLANES]
    return flat + [(section, region) for section in ROUND for region in PLANES | AROUND]


@given(st.sampled_from(pairs()), st.floats(0.02, 0.2), st.floats(0.02, 0.3))
@settings(max_examples=4, deadline=None, derandomize=True)
def test_force_over_displacement_is_the_stiffness(pair: tuple[str, str], size: float, support: float) -> None:
    """A rigid bar of any section sinks by F / k into any region, of any length."""
    size = max(size, 0.05) if pair[0] not in ("rectangle", "round") else size
    found = sunk(case(*pair, "rigid", size, support))
    assert found == pytest.approx(FORCE / STIFFNESS, rel=LOCAL["rigid"])


@pytest.mark.parametrize("model", ["beam", "reduced"])
@pytest.mark.parametrize(("section", "region"), [("tube", "stop"), ("tube", "hole")])
def test_models_sink_alike(section: str, region: str, model: str) -> None:
    """Beams and solids sink by F / k, and by what gives way in themselves."""
    found = sunk(case(section, region, model))
    assert -1e-5 < found * STIFFNESS / FORCE - 1.0 < LOCAL[model]


@pytest.mark.slow(minutes=0.5)
@pytest.mark.parametrize("model", list(MODELS))
@pytest.mark.parametrize(("section", "region"), pairs())
def test_every_pair_in_every_model(section: str, region: str, model: str) -> None:
    """The same for all sections, regions and models that go together."""
    tables = case(section, region, model)
    if model == "rigid sections" and region in PLANES:
        pytest.skip("rigid sections are for supports around the beam")
    if model == "full" and region in ("hole", "circle"):
        with pytest.raises(CaseError, match=r"\[model\]|model full"):
            gapbeam.read_case(tables)
        return
    assert -1e-5 < sunk(tables) * STIFFNESS / FORCE - 1.0 < LOCAL[model]


@pytest.mark.parametrize("model", ["rigid", "reduced", "full"])
def test_slices_sink_alike(model: str) -> None:
    """So does a slice in the bending plane."""
    found = sunk(case("rectangle", "slot", model, dimension=2))
    assert -1e-5 < found * STIFFNESS / FORCE - 1.0 < LOCAL[model]


@pytest.mark.parametrize("section", ["rectangle", "tube"])
def test_a_power_law_of_a_whole_support(section: str) -> None:
    """F = k d^1.5, with k in N/m^1.5."""
    law = {"type": "hunt-crossley", "exponent": 1.5, "restitution": 0.9}
    found = sunk(case(section, "stop", "rigid", law=law, support_stiffness=STIFFNESS))
    assert found == pytest.approx((FORCE / STIFFNESS) ** (2.0 / 3.0), rel=1e-4)


def fallen(tables: dict[str, Any], output: Path) -> tuple[np.ndarray, np.ndarray]:
    """Return times, s, and the displacement downward, m, of a rigid bar that falls on its support."""
    tables |= {"analysis": {"type": "transient", "start": "undeformed"}}
    tables["load"] = [{"type": "gravity", "acceleration": GRAVITY}]
    done = gapbeam.run(tables, output=output)
    history = gapbeam.open_results(output).history
    assert done.summary is not None, done.message
    return np.array(history["time"]), -np.array(history["displacement"].sel(probe="mid", component="z"))


@pytest.mark.parametrize(
    ("section", "region"), [("tube", "stop"), pytest.param("tube", "hole", marks=pytest.mark.slow(minutes=0.5))]
)
def test_a_bar_on_a_whole_damper(section: str, region: str, tmp_path: Path) -> None:
    """The sag comes with a vibration that decays by exp(-zeta w t), m x'' + c x' + k x = m g from the touch on."""
    tables = case(section, region, "rigid")
    mass = float(gapbeam.read_case(tables).profile.mass)
    rate, ratio, gap = sqrt(STIFFNESS / mass), 0.1, 1.0e-4
    turn, sag, speed = rate * sqrt(1.0 - ratio**2), mass * GRAVITY / STIFFNESS, sqrt(2.0 * GRAVITY * gap)
    tables["support"][0] |= {"support_damping": 2.0 * ratio * mass * rate, "clearance": gap, "offset": 0.0}
    tables |= {"contact": {"tension": "adhesive"}, "time": {"end": 6.0 / turn, "step": 2.0e-3 / turn}}
    times, moved = fallen(tables, tmp_path / "run")
    since = times - sqrt(2.0 * gap / GRAVITY)
    swing = -sag * np.cos(turn * since) + (speed - ratio * rate * sag) / turn * np.sin(turn * since)
    expected = sag + np.exp(-ratio * rate * since) * swing
    pressed = (since > 0.0) & (np.cumsum((since > 0.0) & (expected < 0.0)) == 0)
    assert np.abs(moved - gap - expected)[pressed].max() < 5e-3 * sag


def test_a_bar_on_a_stop_that_yields_as_a_whole(tmp_path: Path) -> None:
    """A fall by h of a tube ends where m g (h + d) = F_y d - F_y^2 / (2 k)."""
    height, force, stiffness = 0.02, 4000.0, 2.0e7
    tables = case("tube", "stop", "rigid", law={"type": "elastic-plastic", "yield_force": force})
    weight = float(gapbeam.read_case(tables).profile.mass) * GRAVITY
    tables["support"][0] |= {"clearance": height, "offset": 0.0, "support_stiffness": stiffness}
    tables["time"] = {"end": 0.085, "step": 5.0e-5}
    _, moved = fallen(tables, tmp_path / "run")
    depth = (weight * height + 0.5 * force**2 / stiffness) / (force - weight)
    assert moved.max() - height == pytest.approx(depth, rel=2e-3)


@pytest.mark.parametrize(
    ("own", "words"),
    [
        ({"stiffness": 1.0e8}, ["support_stiffness", "together with stiffness", "leave stiffness out"]),
        ({"support_stiffness": None, "support_damping": 3.0}, ["without support_stiffness"]),
        ({"support_damping": 3.0, "damping": 2.0}, ["support_damping", "leave damping out"]),
        ({"region": {"type": "hole", "contact": "points"}, "clearance": 1e-4}, ['contact = "circle"']),
        (
            {"region": {"type": "profile", "angles": [-90.0, 0.0, 90.0], "recesses": [0.0, 0.0, 0.0]}},
            ["in a profile", "stiffness, per area"],
        ),
        (
            {"support_stiffness": None, "law": {"type": "elastic-plastic", "yield_force": 5.0}, "stiffness": 1e8},
            ["yield_force", "support_stiffness at every support"],
        ),
        (
            {"law": {"type": "elastic-plastic", "yield_force": 5.0, "yield_pressure": 1.0}},
            ["yield_force", "one of the two"],
        ),
        ({"law": {"type": "elastic-plastic"}}, ["no yield_pressure and no yield_force"]),
    ],
)
def test_contradictions(own: dict[str, Any], words: list[str]) -> None:
    """Figures of whole supports are refused where they say nothing, or the same as others."""
    tables = case("tube", "stop", "rigid")
    for key, value in own.items():
        if value is None:
            del tables["support"][0][key]
        else:
            tables["support"][0][key] = value
    tables["support"][0]["offset"] = 0.0
    with pytest.raises(CaseError) as caught:
        gapbeam.read_case(tables)
    for word in words:
        assert word in str(caught.value)


@pytest.mark.parametrize("own", [{}, {"support_stiffness": None}])
@pytest.mark.parametrize("model", ["rigid", "beam", "reduced", "rigid sections"])
@pytest.mark.parametrize("region", [*PLANES, *AROUND])
def test_fields_hold_the_pressure_of_every_support(
    region: str, model: str, own: dict[str, Any], tmp_path: Path
) -> None:
    """Forces at contact points reach the nodes of the face: lines of walls in a beam model had no way to them."""
    tables = case("tube", region, model, **own) | {"contact": {"stiffness": 1.0e9}}
    if model == "rigid sections" and region in PLANES:
        pytest.skip("rigid sections are for supports around the beam")
    if region == "circle" and own:
        pytest.skip("a circle needs a stiffness of the whole support")
    simulation = gapbeam.model(gapbeam.read_case(tables))
    made, seat = simulation.model, simulation.seat()
    writer = FieldWriter(tmp_path, made.case, made)
    writer.write(Snapshots.of_states([seat.state]), made)
    writer.close()
    with h5py.File(tmp_path / "fields.h5") as file:
        points, pressure = file["points"][:], file["contact_pressure/0"][:]
    assert (pressure >= 0.0).all()
    weights = np.where(pressure > 1.0e-3 * pressure.max(), pressure, 0.0)
    assert weights.max() > 0.0
    assert float(weights @ points[:, 0]) / weights.sum() == pytest.approx(MIDDLE, abs=0.02)
    assert float(weights @ points[:, 2]) < 0.0  # it is pressed from below


@pytest.mark.parametrize("model", ["rigid", "beam"])
@pytest.mark.parametrize("section", ["tube", "box"])
@pytest.mark.parametrize("depth", [0.02, 0.2, 2.0])
def test_a_pipe_sinks_into_soft_soil(depth: float, section: str, model: str) -> None:
    """The end that sticks out presses the edge of the soil: F = k d in its middle, however deep; 1.17 m was refused."""
    shape = (FLAT | ROUND)[section]
    tables = {
        "beam": {"length": 12.0, "thickness": 0.3, "width": 0.3, "section": shape},
        "material": FIGURES,
        "support": [{"name": "soil", "from": 0.0, "to": 9.0, "clearance": 0.0, "region": "stop"}],
        "model": MODELS[model],
        "load": [{"type": "gravity", "acceleration": GRAVITY}],
        "probe": [{"name": "mid", "point": 4.5}],
        "time": {"end": 1.0e-2, "step": 1.0e-3},
        "output": {"errors": "none"},
    }
    mass = float(gapbeam.read_case({**tables, "contact": {"stiffness": 1e9}}).profile.mass)
    tables["support"][0]["support_stiffness"] = mass * GRAVITY / depth
    simulation = gapbeam.model(gapbeam.read_case(tables))
    found = describe_seat(simulation.seat(), simulation.model)
    assert float(found["probes"]["mid"][-1]) == pytest.approx(-depth, rel=0.1)
