"""The model that "auto" stands for: which, why, and what is refused."""

from __future__ import annotations

from math import pi
from pathlib import Path

import numpy as np
import pytest

from gapbeam.solver.case.case import case_to_toml
from gapbeam.solver.case.checks.case_warnings import warnings
from gapbeam.solver.case.computed_defaults import overhang_frequency
from gapbeam.solver.case.model_choice import bending_wavelength, graded_places
from gapbeam.solver.case.reading.case_reader import read_case, read_case_text
from gapbeam.solver.case.solution_tables import RIGID_SHARE, THICKNESS_OF_WAVE, BeamModel
from gapbeam.solver.memory.memory_check import offer_simpler
from gapbeam.solver.messages.errors import CaseError
from gapbeam.solver.models.body import body_key
from tests.shared.command import CASE_FOLDER, DEMO

CASES = sorted(CASE_FOLDER.glob("*.toml"))
EXPLICIT = {"time.scheme": "central-difference", "contact.stiffness": 1e11, "time.step": 1e-7, "time.end": 1e-4}
CHOSEN = {"valve": "reduced", "clamped": "reduced"}
"""Shipped cases on which no beam model is chosen: the overhang of the valve is short, the clamped beam is squeezed."""


@pytest.mark.parametrize("path", CASES, ids=lambda path: path.stem)
def test_choices_of_the_shipped_cases(path: Path) -> None:
    """Slender beams whose motion is asked for are beams, of the dimension of the case; others are solids."""
    case = read_case(path, {"model": "auto"})
    assert case.model.type == CHOSEN.get(path.stem, "beam")
    assert case.mesh.dimension == read_case(path).mesh.dimension
    assert "not rigid" in case.model.reasons[1]
    assert case.model.reasons[-1].startswith(case.model.type)


@pytest.mark.parametrize(
    ("changes", "model", "contact"),
    [
        ({"model": {"type": "auto", "wanted": "forces"}}, "reduced", "shapes"),
        ({"model": {"type": "auto", "wanted": "pressures"}}, "reduced", "all"),
        ({"output.stress": True}, "reduced", "shapes"),
        ({"contact.friction": {"coefficient": 0.2}}, "beam", None),
        ({"contact.friction": {"coefficient": 0.2}, "output.stress": True}, "reduced", "all"),
        ({"contact.formulation": {"type": "nitsche"}, "time.scheme": "implicit-midpoint"}, "full", None),
        (EXPLICIT, "full", None),
        ({"time.frequency": 3e4, "time.step": "auto"}, "reduced", "shapes"),
    ],
)
def test_what_a_case_asks_for_decides(changes: dict[str, object], model: str, contact: str | None) -> None:
    """Results, friction, formulation, scheme and frequencies exclude models, and the simplest left is taken."""
    case = read_case(DEMO, {"model": "auto", **changes})
    assert case.model.type == model, case.model.reasons
    assert getattr(case.model, "contact", None) == contact


def test_a_soft_contact_on_a_stiff_beam_is_rigid() -> None:
    """The frequency of the supported part on the contact, sqrt(K / (rho h)) / 2 pi, stays far below bending."""
    thick = {"model": "auto", "beam.thickness": 0.03, "load.shaker.frequency": 2.0, "time.end": 1.0}
    first = overhang_frequency(read_case(DEMO, thick))
    for share, model in ((0.9, "rigid"), (1.1, "beam")):
        stiffness = 7919.0 * 0.03 * (2.0 * pi * share * RIGID_SHARE * first) ** 2
        assert read_case(DEMO, {**thick, "contact.stiffness": stiffness}).model.type == model


def test_a_plane_scene_stays_plane_and_a_hole_asks_for_the_solid() -> None:
    """Where the case leaves the dimension out, it is 2 unless something asks for 3."""
    assert read_case(DEMO, {"model": "auto", "mesh.dimension": None}).mesh.dimension == 2
    holes = read_case((CASE_FOLDER / "tube-holes.toml"), {"model": "auto", "mesh.dimension": None})
    assert holes.mesh.dimension == 3
    assert "beam on the solid: the simplest model that is left" in holes.model.reasons
    aslant = {"model": "auto", "mesh.dimension": None, "mesh.cell": None, "load.shaker.direction": [0, 1, 1]}
    read = read_case(DEMO, aslant)
    assert read.mesh.dimension == 3
    assert any("on the slice" in reason for reason in read.model.reasons)


def test_choices_can_be_written_read_and_shared() -> None:
    """The case as it was run holds choice and reasons; reasons do not keep bodies from being shared."""
    case = read_case(DEMO, {"model": "auto"})
    again = read_case_text(case_to_toml(case))
    assert again.model == case.model
    assert read_case(DEMO, {"model": "auto"}) == case
    assert body_key(case) == body_key(read_case(DEMO, {"model": "beam"}))


def test_elements_are_as_short_as_supports_ask_for() -> None:
    """Five elements in each support, and graded ones between: equal ones would be 5 * 1.2 / 0.02 = 300."""
    case = read_case((CASE_FOLDER / "baffles.toml"), {"model": "auto"})
    assert isinstance(case.model, BeamModel)
    assert case.model.graded
    assert case.model.elements < 0.5 * 300
    places = graded_places(case, case.model.elements)
    for one in case.layout.supports:
        assert np.sum((places > one.start - 1e-9) & (places < one.end + 1e-9)) >= 6


def test_a_scene_that_no_model_takes_is_refused_with_each_reason() -> None:
    """Explicit steps need the full model and modal damping another one: the message has every model."""
    with pytest.raises(CaseError) as error:
        read_case(DEMO, {"model": "auto", "damping": {"ratio": 0.01}, **EXPLICIT})
    words = str(error.value)
    assert "no model fits" in words
    assert all(f"not {name} on the slice" in words for name in ("rigid", "beam", "reduced", "full"))


def test_faults_of_the_scene_are_those_that_all_models_have() -> None:
    """A probe beside the beam is reported as it is with any model, once."""
    with pytest.raises(CaseError) as error:
        read_case(DEMO, {"model": "auto", "probe.tip.point": 0.6})
    with pytest.raises(CaseError) as given:
        read_case(DEMO, {"probe.tip.point": 0.6})
    assert str(error.value) == str(given.value)


def test_the_limit_of_beams_is_that_which_runs_are_judged_by() -> None:
    """Thickness over wavelength just above the limit gives a solid, just below it a beam."""
    found = {}
    for share in (0.98, 1.02):
        wavelength = 0.012 / (share * THICKNESS_OF_WAVE)
        low, high = 1.0, 1.0e6  # bisect the frequency whose waves are that long
        piece = read_case(DEMO).profile.pieces[0]
        for _ in range(100):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if bending_wavelength(piece, middle) > wavelength else (low, middle)
        found[share] = read_case(DEMO, {"model": "auto", "time.frequency": low, "time.step": "auto"}).model.type
    assert found == {0.98: "beam", 1.02: "reduced"}


@pytest.mark.parametrize(("support", "spacing"), [(0.05, "equal"), (0.02, "graded"), (0.008, "graded")])
def test_a_beam_without_a_number_of_elements_gets_enough(support: float, spacing: str) -> None:
    """Five elements lie in the shortest support, and no warning is left; a number that is given stays, and warns."""
    short = {"model": "beam", "support.length": support}
    case = read_case(DEMO, short)
    assert (case.model.type, case.model.spacing) == ("beam", spacing)
    assert not [line for line in warnings(case) if "elements" in line]
    if spacing == "graded":
        places = graded_places(case, case.model.elements)
        assert np.sum(places < support * (1.0 + 1e-9)) >= 6
        assert [line for line in warnings(read_case(DEMO, {**short, "model.elements": 102})) if "elements" in line]
    assert read_case_text(case_to_toml(case)).model == case.model


FLAT, RUB = {"beam.section": "rectangle"}, {"contact.friction": {"coefficient": 0.2}}


@pytest.mark.parametrize(
    ("changes", "stations"),
    [
        (RUB, 8),
        ({"model.elements": 40}, 8),
        ({"model.stations": 3}, 3),
        ({"support": [{"name": "pad", "from": 0.0, "to": 0.01, "clearance": 1e-4, "region": "slot"}], **FLAT}, None),
        ({"support": [{"name": "pad", "from": 0.0, "to": 0.01, "clearance": 1e-4, "region": "slot"}], **RUB}, 8),
        ({"support": [{"name": "pad", "from": 0.0, "to": 0.01, "clearance": 1e-4, "region": "slot"}]}, 8),
    ],
    ids=["holes", "with a number of elements", "given", "a flat section in a slot", "friction in a slot", "in a slot"],
)
def test_a_beam_in_holes_touches_at_a_few_sections(changes: dict[str, object], stations: int | None) -> None:
    """All points of the mesh, over a thousand in a hole, carry the same forces (`test_graded_beams`)."""
    holes = {"model": {"type": "beam"}, "contact.stiffness": 1.0e11}
    case = read_case(CASE_FOLDER / "tube-holes.toml", {**holes, **changes})
    assert case.model.stations == stations


@pytest.mark.parametrize(
    ("name", "changes", "words"),
    [
        ("li2013", {}, "beam elements"),
        ("li2013", {"model": "reduced"}, "beam elements"),
        ("li2013", {"model": "beam"}, ""),
        ("li2013", {"output.stress": True}, ""),
        ("demo", {}, ""),
        ("demo", {"beam.thickness": 8.0e-4, "mesh": {}}, "beam elements"),
        ("demo", {"beam.thickness": 8.0e-4, "mesh": {}, "model": "reduced"}, ""),
    ],
)
def test_a_solid_is_not_set_up_unsaid_where_a_beam_would_do(
    name: str, changes: dict[str, object], words: str, caplog: pytest.LogCaptureFixture
) -> None:
    """A fuel rod without [model] was meshed as a solid for minutes, a sheet of 0.8 mm marched as a slice for 17.

    Slices are set up in seconds, and steps of reduced ones cost little.
    """
    with caplog.at_level("INFO", "gapbeam"):
        offer_simpler(read_case(CASE_FOLDER / f"{name}.toml", changes))
    said = [one.getMessage() for one in caplog.records]
    assert len(said) == bool(words)
    assert all(f"model=auto would take {words}" in one for one in said)
