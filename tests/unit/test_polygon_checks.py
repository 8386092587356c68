"""Polygons that are no cross-section of a case: what is said, and what to try."""

from __future__ import annotations

from pathlib import Path

import pytest

from gapbeam.solver.case.case import case_to_toml
from gapbeam.solver.case.reading.case_reader import read_case, read_case_text
from tests.shared.case_texts import BEAM, assert_says, faults_of, written

HEAD = BEAM.replace("width = 0.02\n", 'width = 0.012\nsection = { type = "polygon", {} }\n') + "[mesh]\ndimension = 3\n"
SUPPORT = "[support]\nlength = 0.05\nclearance = 1e-4\n"
SQUARE = "points = [[0.0, 0.0], [0.012, 0.0], [0.012, 0.012], [0.0, 0.012]]"
DOVETAIL = "points = [[0.0, 0.0], [0.012, 0.0], [0.01, 0.012], [0.002, 0.012]]"
ANGLE = "points = [[0, 0], [0.012, 0], [0.012, 0.004], [0.004, 0.004], [0.004, 0.012], [0, 0.012]]"
CHANNEL = (
    "points = [[0, 0], [0.012, 0], [0.012, 0.002], [0.002, 0.002], [0.002, 0.01], [0.012, 0.01], [0.012, 0.012], "
    "[0, 0.012]]"
)
TEE = (
    "points = [[0.004, 0], [0.008, 0], [0.008, 0.008], [0.012, 0.008], [0.012, 0.012], [0, 0.012], [0, 0.008], "
    "[0.004, 0.008]]"
)
SIDEWAYS = '[[load]]\ntype = "base_motion"\namplitude = 1.0\nfrequency = 20.0\ndirection = [0.0, 1.0, 1.0]\n'
ELEMENTS = '[model]\ntype = "beam"\n'
SEGMENT = '[[segment]]\nname = "tail"\nfrom = 0.3\nto = 0.6\n'


def text(section: str, more: str = "") -> str:
    """Return a case with the keys of a polygon, and further tables."""
    return HEAD.replace("{}", section) + SUPPORT + more


def holed(*holes: str) -> str:
    """Return the case of a square with holes."""
    return text(f"{SQUARE}, holes = [{', '.join(holes)}]")


BAD = {
    "no points": (text("holes = []"), ["points", "the key is missing"]),
    "two points": (text("points = [[0, 0], [0.012, 0.012]]"), ["a list of 3 to 200 items"]),
    "points in space": (text("points = [[0, 0, 0], [0.012, 0, 0], [0, 0.012, 0]]"), ["each a list of 2 numbers"]),
    "a point given twice": (
        text(SQUARE.replace("[0.012, 0.0]", "[0.012, 0.0], [0.012, 0.0]")),
        ["points 2 and 3 are the same, [0.012, 0]", "leave one of them out"],
    ),
    "closed by the first point": (
        text(SQUARE.replace("]]", "], [0, 0]]")),
        ["points 1 and 5 are the same", "the polygon closes by itself"],
    ),
    "sides that cross": (
        text("points = [[0, 0], [0.012, 0.012], [0.012, 0], [0, 0.012]]"),
        ["the sides from points 1 and 3 meet each other, at [0.006, 0.006]", "one after the other around"],
    ),
    "points in line": (text("points = [[0, 0], [0.006, 0.006], [0.012, 0.012]]"), ["on one line, without area"]),
    "points in mm": (
        text("points = [[0, 0], [12, 0], [12, 12], [0, 12]]"),
        ["points 12 m apart along z, with thickness = 0.012", "are they in mm?"],
    ),
    "another thickness": (text(SQUARE.replace("0.012]", "0.011]")), ["0.011 m apart along z", "thickness = 0.011"]),
    "coordinates swapped": (
        text(SQUARE.replace("0.012]", "0.02]")).replace(
            "thickness = 0.012\nwidth = 0.012", "thickness = 0.012\nwidth = 0.02"
        ),
        ["swap the coordinates?"],
    ),
    "a hole outside": (holed("[[0.02, 0], [0.03, 0], [0.03, 0.01]]"), ["hole 1: outside of the polygon"]),
    "a hole across the outline": (
        holed("[[0.006, 0.006], [0.03, 0.006], [0.03, 0.009]]"),
        ["hole 1: meets the outline at [0.012, 0.006]"],
    ),
    "a hole that leaves no wall": (
        holed("[[0.0, 0.003], [0.006, 0.003], [0.006, 0.009]]"),
        ["hole 1: meets the outline", "a hole that leaves a wall"],
    ),
    "holes that overlap": (
        holed("[[0.002, 0.002], [0.008, 0.002], [0.008, 0.008]]", "[[0.006, 0.003], [0.01, 0.003], [0.01, 0.009]]"),
        ["hole 2: overlaps hole 1", "make one hole of both"],
    ),
    "a hole in a hole": (
        holed(
            "[[0.001, 0.001], [0.011, 0.001], [0.011, 0.011], [0.001, 0.011]]",
            "[[0.004, 0.004], [0.008, 0.004], [0.008, 0.008]]",
        ),
        ["hole 2: overlaps hole 1"],
    ),
    "a hole that crosses itself": (
        holed("[[0.002, 0.002], [0.008, 0.008], [0.008, 0.002], [0.002, 0.008]]"),
        ["hole 1: the sides from points 1 and 3 meet each other"],
    ),
    "a needle": (
        text("points = [[0, 0], [0.012, 0], [0.006, 0.001], [0.006, 0.012], [0, 0.012]]"),
        ["an angle of 9.46232 degrees at", "at least 10 degrees"],
    ),
    "a corner below": (
        text("points = [[0, -0.006], [0.006, 0], [0, 0.006], [-0.006, 0]]"),
        ["whose lowest place is a corner, with a support below it (base)", "a level side there"],
    ),
    "turned axes of a beam": (text(ANGLE, ELEMENTS), ["principal axes are turned", 'model.type = "reduced"']),
    "a channel as a beam": (text(CHANNEL, ELEMENTS), ["its shear center is 0.00941 m beside the bending plane"]),
    "a T in two planes": (
        text(TEE, ELEMENTS + SIDEWAYS),
        ["its centroid is 0.0016 m off the axis", "across its plane"],
    ),
    "a T behind a rectangle": (
        text(TEE, ELEMENTS + SEGMENT + 'section = "rectangle"\n'),
        ["centroids of its sections 0.0016 m above each other"],
    ),
    "inclined sides beside others": (
        text(DOVETAIL, SEGMENT + 'section = "rectangle"\n'),
        ["one polygon all along", "all upright or level"],
    ),
    "a thicker segment": (
        text(SQUARE, SEGMENT + "thickness = 0.02\n"),
        ["0.02 m, with the points of [beam]", "0.012 m apart"],
    ),
    "a slice": (
        text(SQUARE).replace("dimension = 3", "dimension = 2"),
        ['2, with the section "polygon"', "dimension = 3"],
    ),
    "a probe beside it": (
        text(DOVETAIL).replace("point = 0.6", "point = [0.6, 0.0055, 0.005]"),
        ["not in the material", 'section "polygon"'],
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_polygons_that_make_no_section_are_refused(name: str, tmp_path: Path) -> None:
    """With the key, what was found, what was expected and what to try."""
    whole, words = BAD[name]
    assert_says("\n".join(map(str, faults_of(written(tmp_path, whole)))), words)


def test_all_faults_of_a_polygon_are_reported_together(tmp_path: Path) -> None:
    """Its size, its sides and its hole."""
    crossed = "points = [[0, 0], [0.011, 0.012], [0.011, 0], [0, 0.012]], holes = [[[0, 0], [0, 0], [1, 1]]]"
    found = faults_of(written(tmp_path, text(crossed)))
    assert [fault.key[-1] for fault in found] == ["points", "points", "holes"]


@pytest.mark.parametrize(
    "section", [SQUARE, TEE, f"{SQUARE}, holes = [[[0.004, 0.004], [0.008, 0.004], [0.006, 0.008]]]"]
)
def test_polygons_are_written_as_they_were_read(section: str, tmp_path: Path) -> None:
    """The case file that a run leaves behind gives the same case."""
    case = read_case(written(tmp_path, text(section, ELEMENTS)))
    assert read_case_text(case_to_toml(case)) == case


def test_either_way_around_and_from_anywhere_is_the_same_section(tmp_path: Path) -> None:
    """Area, second moments and centroid of a T."""
    moved = "points = [[1.006, 3], [1.006, 3.008], [1.002, 3.008], [1.002, 3.012], [1.014, 3.012], [1.014, 3.008], "
    other = read_case(written(tmp_path, text(moved + "[1.01, 3.008], [1.01, 3]]"))).beam
    one = read_case(written(tmp_path, text(TEE))).beam
    for figure in ("area", "second_moment", "lateral_moment", "centroid"):
        assert getattr(other, figure) == pytest.approx(getattr(one, figure), rel=1e-9, abs=1e-12)


def test_parts_in_the_hollow_of_a_polygon_are_not_joined(tmp_path: Path) -> None:
    """A bar of 4 mm lies within a hole of 6 mm; one of 8 mm meets its walls."""
    tube = f"{SQUARE}, holes = [[[0.003, 0.003], [0.009, 0.003], [0.009, 0.009], [0.003, 0.009]]]"
    tail = SEGMENT + 'section = "rectangle"\nthickness = {0}\nwidth = {0}\n'
    said = "\n".join(map(str, faults_of(written(tmp_path, text(tube, tail.format(0.004))))))
    assert_says(said, ["lies within a hollow of 0.006 m"])
    read_case(written(tmp_path, text(tube, tail.format(0.008))))
