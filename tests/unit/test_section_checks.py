"""Cross-sections that do not fit the beam, the mesh or the points of a case: what is said, and what to try."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import gapbeam
from gapbeam.solver.case.case import case_to_toml
from gapbeam.solver.case.reading.case_reader import read_case, read_case_text
from tests.shared.case_texts import BEAM, assert_says, faults_of, written

HEAD = BEAM.replace("width = 0.02\n", "width = 0.012\nsection = {}\n") + "[mesh]\ndimension = 3\n"
SUPPORT = "[support]\nlength = 0.05\nclearance = 1e-4\n"


def text(section: str, old: str = "", new: str = "") -> str:
    """Return a case with a section, something in it replaced."""
    whole = HEAD.replace("{}", section) + SUPPORT
    assert not old or old in whole
    return whole.replace(old, new) if old else whole


TUBE = '{ type = "tube", wall = 0.002 }'
BOX = '{ type = "box", wall = 0.002 }'
PROFILE = '{ type = "i", web = 0.002, flange = 0.002 }'
STRESSED = text('"round"') + '[[probe]]\nname = "p"\npoint = POINT\nstress = true\n'

BAD = {
    "stress of a rigid body": (
        STRESSED.replace("POINT", "0.3") + '[model]\ntype = "rigid"\n',
        ["a rigid body has no stress"],
    ),
    "fields of stress of a rigid body": (
        text('"round"') + '[model]\ntype = "rigid"\n[output]\nstress = true\n',
        ["output", "stress", "true, with the model rigid", 'model.type = "reduced"'],
    ),
    "stress on a hollow axis": (
        STRESSED.replace("POINT", "0.3").replace('"round"', TUBE),
        ["on the axis of the hollow section", "point = [0.3, 0.0, -0.006]", "in the material"],
    ),
    "stress off the material": (
        STRESSED.replace("POINT", "[0.3, 0.0, 0.003]").replace('"round"', TUBE),
        ["not in the material of the section"],
    ),
    "stress that is no switch": (
        STRESSED.replace("true", '"yes"').replace("POINT", "0.3"),
        ["stress", "true or false"],
    ),
    "unknown section": (text('"hexagon"'), ["section", "hexagon", "tube", "round"]),
    "no wall": (text('"tube"'), ["wall", "nothing", "thickness of the wall"]),
    "a wall that fills the tube": (text(TUBE.replace("0.002", "0.006")), ["0.006 m", "less than 0.006 m", "diameter"]),
    "a wall in mm": (text(TUBE.replace("0.002", "2.0")), ["2 m", "is it in mm? In m it is 0.002"]),
    "no wall at all": (text(BOX.replace("0.002", "0.0")), ["wall", "greater than 0"]),
    "a box without hollow": (text(BOX.replace("0.002", "0.007")), ["half of the thickness and of the width"]),
    "a web as wide as the flanges": (text(PROFILE.replace("web = 0.002", "web = 0.012")), ["less than 0.012 m"]),
    "flanges without a web": (text(PROFILE.replace("flange = 0.002", "flange = 0.006")), ["half of the thickness"]),
    "an oval tube": (text(TUBE, "width = 0.012", "width = 0.02"), ["thickness and width both", "width = 0.012"]),
    "an oval bar": (text('"round"', "width = 0.012", "width = 0.02"), ["the outer diameter"]),
    "a slice": (text(TUBE, "dimension = 3", "dimension = 2"), ["2, with the section", "equally wide", "dimension = 3"]),
    "tetrahedra": (
        text(TUBE, "dimension = 3", 'dimension = 3\ncell = "tetrahedron"'),
        ["tetrahedron", "layers", "leave cell out"],
    ),
    "linear cells": (
        text(TUBE, "dimension = 3", "dimension = 3\ndegree = 1"),
        ["[mesh] degree", '1, with the section "tube"', "strain curved cells where the beam only turns", "degree = 2"],
    ),
    "a probe in the bore": (
        text(TUBE, "point = 0.6", "point = [0.6, 0.0, 0.002]"),
        ["not in the material", "point = 0.6 for the axis", "average"],
    ),
    "a probe beside the web": (
        text(PROFILE, "point = 0.6", "point = [0.6, 0.004, 0.001]"),
        ["not in the material", 'section "i"'],
    ),
    "a probe outside": (text(TUBE, "point = 0.6", "point = [0.6, 0.0, 0.008]"), ["outside the beam"]),
    "points on a tube": (
        text(TUBE) + "[contact]\npoints = [0.01, 0.04]\n",
        ["2 points", "touches along lines", "leave points out"],
    ),
    "a wall of a rectangle": (text('{ type = "rectangle", wall = 0.002 }'), ["wall"]),
}


@pytest.mark.parametrize("name", BAD)
def test_sections_that_do_not_fit_are_refused(name: str, tmp_path: Path) -> None:
    """With the key, what was found, what was expected and what to try."""
    whole, words = BAD[name]
    assert_says("\n".join(map(str, faults_of(written(tmp_path, whole)))), words)


@pytest.mark.parametrize("section", [TUBE, BOX, PROFILE, '"round"', '"rectangle"'])
def test_sections_are_written_as_they_were_read(section: str, tmp_path: Path) -> None:
    """The case file that a run leaves behind gives the same case."""
    case = read_case(written(tmp_path, text(section)))
    assert read_case_text(case_to_toml(case)) == case


@pytest.mark.parametrize("point", ["[0.6, 0.0, 0.006]", "[0.6, 0.006, 0.0]", "[0.6, 0.0, -0.004]", "[0.6, 0.0, 0.0]"])
def test_points_on_the_surfaces_of_a_tube_are_points_of_it(point: str, tmp_path: Path) -> None:
    """Outside, inside, and the axis."""
    case = read_case(written(tmp_path, text(TUBE, "point = 0.6", f"point = {point}")))
    assert case.beam.hollow


TABLES = {
    "material": {"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": 7850.0},
    "support": {"length": 0.05, "clearance": 1e-4},
    "time": {"end": 0.1},
}
HOLLOW = {"from": 0.2, "to": 0.3, "name": "a", "section": {"type": "box", "wall": 0.002}}


@pytest.mark.parametrize(
    ("beam", "others", "width", "dimension"),
    [
        ({"section": "round", "thickness": 0.02}, {}, 0.02, 3),
        ({"section": {"type": "tube", "wall": 0.002}, "thickness": 0.02}, {}, 0.02, 3),
        ({"section": {"type": "box", "wall": 0.002}, "thickness": 0.02, "width": 0.03}, {}, 0.03, 3),
        ({"thickness": 0.02, "width": 0.03}, {}, 0.03, 2),
        ({"thickness": 0.02, "width": 0.02}, {"segment": [HOLLOW]}, 0.02, 3),
    ],
)  # fmt: skip
def test_sections_imply_width_and_dimension(
    beam: dict[str, Any], others: dict[str, Any], width: float, dimension: int
) -> None:
    """A round section is as wide as thick, and what a slice cannot be has a mesh of the solid."""
    case = gapbeam.read_case(TABLES | {"beam": {"length": 0.5, **beam}} | others)
    assert (case.beam.width, case.mesh.dimension) == (width, dimension)


@pytest.mark.parametrize("thickness", [-0.01, "0.01", True])
def test_a_wrong_thickness_of_a_round_section_is_one_fault(thickness: object) -> None:
    """The width that is left out is no second one; with its thickness left out as well, both are missing."""
    with pytest.raises(gapbeam.CaseError) as raised:
        gapbeam.read_case(TABLES | {"beam": {"length": 0.5, "section": "round", "thickness": thickness}})
    assert [fault.key for fault in raised.value.faults] == [("beam", "thickness")]


def test_a_slice_of_a_round_section_that_is_asked_for_is_refused() -> None:
    """A dimension of the file stands."""
    tables = TABLES | {"beam": {"length": 0.5, "section": "round", "thickness": 0.02}, "mesh": {"dimension": 2}}
    with pytest.raises(gapbeam.CaseError, match="dimension = 3 in"):
        gapbeam.read_case(tables)


def test_keys_of_other_programs_are_one_fault_each() -> None:
    """A diameter is no missing thickness and width besides, and start and end no missing from and to."""
    tables = TABLES | {
        "beam": {"length": 0.5, "section": "round", "diameter": 0.02},
        "support": [{"name": "a", "start": 0.0, "end": 0.05, "clearance": 1e-4}],
    }
    with pytest.raises(gapbeam.CaseError) as raised:
        gapbeam.read_case(tables)
    said = {str(fault.key[-1]): fault.hint for fault in raised.value.faults}
    assert said == {
        "diameter": "did you mean `thickness`?", "start": "did you mean `from`?", "end": "did you mean `to`?"
    }  # fmt: skip


@pytest.mark.parametrize(("value", "word"), [([0.03, 0.03], "ratios"), (0.03, "ratio")])
def test_of_keys_that_are_near_the_one_that_takes_the_value_was_meant(value: object, word: str) -> None:
    """A list is no single ratio."""
    tables = TABLES | {"beam": {"length": 0.5, "thickness": 0.02, "width": 0.02}, "damping": {"ratiso": value}}
    with pytest.raises(gapbeam.CaseError) as raised:
        gapbeam.read_case(tables)
    assert f"did you mean `{word}`?" in [fault.hint for fault in raised.value.faults]
