"""Rigid sections that do not go with the rest of a case: what is said, and what to try."""

from __future__ import annotations

from pathlib import Path

import pytest

from gapbeam.solver.case.case import case_to_toml
from gapbeam.solver.case.reading.case_reader import read_case, read_case_text
from gapbeam.solver.case.solution_tables import ReducedModel
from gapbeam.studies.error_estimate.companions import FINEST, FINEST_MODES, companions_of
from tests.shared.case_texts import BEAM, assert_says, faults_of, written

HOLES = """
[[support]]
name = "a"
from = 0.0
to = 0.02
clearance = 1e-4
region = "hole"
[[support]]
name = "b"
from = 0.5
to = 0.52
clearance = 1e-4
region = "hole"
"""
GOOD = (
    BEAM.replace("width = 0.02\n", 'width = 0.012\nsection = "round"\n')
    + '[mesh]\ndimension = 3\n[model]\ntype = "reduced"\nsections = "rigid"\n'
    + HOLES
)
RIGID = 'sections = "rigid"\n'

BAD = {
    "a slot around a flat section": (
        GOOD.replace('"hole"', '"slot"').replace('"round"', '"rectangle"'),
        ["slot a", "or slots around a round section", "leave sections out"],
    ),
    "a slice": (GOOD.replace('"hole"', '"slot"').replace("dimension = 3", "dimension = 2"), ["slot a", "(3D)"]),
    "one plane": (GOOD.replace('"hole"', '"stop"', 1), ["stop a", "one plane alone", 'type = "beam"']),
    "base and gland": (
        GOOD.replace(HOLES, "[support]\nlength = 0.05\nclearance = 1e-4\n").replace('"round"', '"rectangle"'),
        ["rigid, with the slot support", "supports around the beam"],
    ),
    "every interface DOF": (
        GOOD.replace(RIGID, RIGID + 'contact = "all"\n'),
        ["all motions of the surface", "leave one"],
    ),
    "held faces": (GOOD.replace(RIGID, RIGID + 'interface = "fixed"\n'), ['interface = "free"', "leave interface out"]),
    "friction": (
        GOOD + "[contact.friction]\ncoefficient = 0.2\n",
        ["coefficient of 0.2", 'contact = "all" and sections = "deformable"'],
    ),
    "stations of sections that deform": (
        GOOD.replace(RIGID, "stations = 6\n"),
        ["6, with sections that deform", 'sections = "rigid", or leave stations out'],
    ),
    "no station": (GOOD.replace(RIGID, RIGID + "stations = 0\n"), ["stations", "0", "1"]),
    "another word": (GOOD.replace('"rigid"', '"stiff"'), ["stiff", "deformable", "rigid"]),
    "sections of beam elements": (GOOD.replace('"reduced"', '"beam"'), ["sections"]),
}


@pytest.mark.parametrize("name", BAD)
def test_what_does_not_fit_is_refused(name: str, tmp_path: Path) -> None:
    """Each contradiction is found, with what was found, what is expected and what to try."""
    text, words = BAD[name]
    assert_says("\n".join(map(str, faults_of(written(tmp_path, text)))), words)


@pytest.mark.parametrize("region", ['"slot"', '{ type = "polygon", walls = [0.0, 180.0] }'])
def test_a_slot_around_a_round_section_is_taken(region: str, tmp_path: Path) -> None:
    """The advice for a slot is true: around a round section it has rigid sections, as two walls have."""
    case = read_case(written(tmp_path, GOOD.replace('"hole"', region, 1)))
    assert case.model.rings == 8
    assert read_case_text(case_to_toml(case)) == case


def test_friction_goes_with_sections_that_deform(tmp_path: Path) -> None:
    """The advice for friction is true, too."""
    text = GOOD.replace(RIGID, 'sections = "deformable"\ncontact = "all"\n') + "[contact.friction]\ncoefficient = 0.2\n"
    assert read_case(written(tmp_path, text)).model.rings is None


def test_error_estimates_name_what_sections_leave_out(tmp_path: Path) -> None:
    """Companions have rigid sections as the run has; what these leave out is said."""
    case = read_case(written(tmp_path, GOOD.replace(RIGID, RIGID + "stations = 5\n")))
    plan = companions_of(case, 1e-4, 1e9, True)
    assert any('sections = "rigid" leaves out' in one for one in plan.left_out)
    models = {one.name: ReducedModel.model_validate(dict(one.changes["model"])) for one in plan.companions}
    assert {name: model.rings for name, model in models.items()} == dict.fromkeys(models, 5) | {FINEST: 7}
    assert models[FINEST].modes == FINEST_MODES
