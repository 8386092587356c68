"""Segments that contradict each other, their beam or the rest of a case: what is said, where, and what to try."""

from __future__ import annotations

from pathlib import Path

import pytest

from gapbeam.solver.case.case import case_to_toml
from gapbeam.solver.case.reading.case_reader import read_case, read_case_text
from tests.shared.case_texts import BEAM as HEAD
from tests.shared.case_texts import assert_says, faults_of, written

SUPPORTS = (
    '[[support]]\nname = "front"\nfrom = 0.0\nto = 0.02\nclearance = 2e-4\n'
    '[[support]]\nname = "back"\nfrom = 0.5\nto = 0.52\nclearance = 4e-4\n'
)
HUB = '[[segment]]\nname = "hub"\nfrom = 0.2\nto = 0.3\nthickness = 0.02\n'
TAIL = '[[segment]]\nname = "tail"\nfrom = 0.4\nto = 0.6\ndensity = 2700.0\nyoung_modulus = 7e10\n'
GOOD = HEAD + SUPPORTS + HUB + TAIL
SOLID = GOOD + "[mesh]\ndimension = 3\n"


def probe(point: str, more: str = "") -> str:
    """Return a probe at a point."""
    return f'[[probe]]\nname = "p"\npoint = {point}\n{more}'


BAD = {
    "same name": (GOOD.replace('"tail"', '"hub"'), ["number 2", '"hub"', "also the name of number 1"]),
    "ends before it begins": (
        GOOD.replace("from = 0.2\nto = 0.3", "from = 0.3\nto = 0.2"),
        ["hub", "0.2 m, where the segment begins at 0.3 m", "swap them"],
    ),
    "no length": (GOOD.replace("from = 0.2\nto = 0.3", "from = 0.3\nto = 0.3"), ["a segment has a length"]),
    "beyond the beam": (
        GOOD.replace("to = 0.6", "to = 0.7"),
        ["0.7 m, beyond the end of the beam", "at most", "0.6 m"],
    ),
    "in mm": (GOOD.replace("from = 0.4\nto = 0.6", "from = 400.0\nto = 600.0"), ["is it in mm? In m it is 0.6"]),
    "overlap": (
        GOOD.replace("from = 0.4", "from = 0.25"),
        ["tail", "the segments hub and tail overlap from x = 0.25 to x = 0.3 m", "from = 0.3"],
    ),
    "nothing of its own": (
        GOOD.replace("thickness = 0.02\n", ""),
        ["as the rest of the beam", "one of thickness, width, section, young_modulus", "leave the segment out"],
    ),
    "wider slice": (
        GOOD.replace("thickness = 0.02\n", "width = 0.03\n"),
        ["hub", "width", "0.03 m, in a slice (dimension = 2)", "dimension = 3 in [mesh]"],
    ),
    "tube in a slice": (
        GOOD.replace("thickness = 0.02\n", 'section = { type = "box", wall = 0.001 }\n') + "[mesh]\ndimension = 2\n",
        ["section", '"box", in a slice (dimension = 2)', "a solid rectangle"],
    ),
    "round beside flat": (
        SOLID.replace("thickness = 0.02\n", 'thickness = 0.02\nsection = "round"\n'),
        ["section", '"round", in a beam of the section "rectangle"', "round sections (round, tube) all along, or none"],
    ),
    "walls too thick": (
        SOLID.replace("thickness = 0.02\n", 'section = { type = "box", wall = 0.02 }\n'),
        ["hub", "section wall", "0.02 m", "less than 0.006 m"],
    ),
    "walls of the beam too thick": (
        SOLID.replace("[beam]\n", '[beam]\nsection = { type = "box", wall = 0.004 }\n').replace(
            'name = "hub"\nfrom = 0.2\nto = 0.3\nthickness = 0.02',
            'name = "hub"\nfrom = 0.2\nto = 0.3\nthickness = 0.007',
        ),
        ["hub", "thickness", "0.007 m, with the wall of [beam]: 0.004 m", "less than 0.0035 m", "of its own"],
    ),
    "tetrahedra": (
        SOLID.replace("thickness = 0.02\n", 'section = { type = "box", wall = 0.002 }\n') + 'cell = "tetrahedron"\n',
        ["[mesh] cell", '"tetrahedron", with the section "box" in the segment hub', "hexahedron"],
    ),
    "a step too small for cells": (
        GOOD.replace("thickness = 0.02\n", "thickness = 0.012001\n"),
        ["hub", "1e-06 m from the thickness of the beam", "cells lie in between", "thickness = 0.012"],
    ),
    "a step too small between segments": (
        GOOD.replace("density = 2700.0", "thickness = 0.020001"),
        ["tail", "1e-06 m from the thickness of the segment hub", "thickness = 0.02"],
    ),
    "an end next to a support": (
        GOOD.replace("to = 0.3\n", "to = 0.49999999\n").replace(TAIL, ""),
        ["the end of the segment hub and the start of the support back", "cells end at both"],
    ),
    "support over a step": (
        GOOD.replace("to = 0.3\n", "to = 0.51\n").replace(TAIL, ""),
        [
            "back",
            "from x = 0.5 to 0.52 m, over the step of the beam at x = 0.51 m",
            "two supports that meet at x = 0.51",
        ],
    ),
    "stress where materials meet": (
        GOOD + probe("[0.4, 0.006]", "stress = true\n"),
        ["probe", "stress", "at x = 0.4 m, where a segment begins or ends", "a point half a thickness away"],
    ),
    "point outside a thin part": (
        GOOD.replace("thickness = 0.02", "thickness = 0.006") + probe("[0.25, 0.005]"),
        ["y = 0.005 m, outside the beam", "y from -0.003 to 0.003 m"],
    ),
    "a formulation of one material": (
        GOOD + '[contact]\nformulation = "nitsche"\n',
        ["nitsche, with another material in the segment tail", 'formulation = "penalty"'],
    ),
    "a tube within the hollow of a tube": (
        SOLID.replace("[beam]\n", '[beam]\nsection = { type = "tube", wall = 0.002 }\n')
        .replace("thickness = 0.012", "thickness = 0.01")
        .replace("width = 0.02\n[material]", "width = 0.01\n[material]"),
        [
            "hub",
            "0.02 m, beside 0.01 m at the start",
            "in a hollow of 0.016 m, and touches no wall",
            "a solid segment between them",
            "thicker than 0.005 m",
        ],
    ),
    "fields of stress of two materials": (
        GOOD + "[output]\nstress = true\n",
        ["output", "true, with another material in the segment tail", "stress = true at a [[probe]] within a segment"],
    ),
    "unknown key": (GOOD.replace("thickness = 0.02", "thicknes = 0.02"), ["thicknes", "did you mean `thickness`"]),
    "no place": (GOOD.replace("from = 0.2\n", ""), ["from", "the key is missing", "start of the segment"]),
    "negative": (GOOD.replace("thickness = 0.02", "thickness = -0.02"), ["thickness", "-0.02", "greater than 0"]),
    "a table": (GOOD.replace("[[segment]]", "[segment]", 1).replace(TAIL, ""), ["[[segment]]", "two brackets"]),
}


@pytest.mark.parametrize("name", BAD)
def test_a_contradiction_is_explained(name: str, tmp_path: Path) -> None:
    """One fault, with its place, what was found and what helps."""
    text, words = BAD[name]
    faults = faults_of(written(tmp_path, text))
    assert len(faults) == 1, faults
    assert_says(faults[0], words)


@pytest.mark.parametrize(("hollow", "solid"), [("tube", "round"), ("box", "rectangle")])
@pytest.mark.parametrize("inner", ["hub", "rest"])
def test_what_is_advised_joins_a_part_within_a_hollow(hollow: str, solid: str, inner: str, tmp_path: Path) -> None:
    """Solid caps of the thicker part; a wall a little thinner than advised is refused again."""
    thin, thick = 0.01, 0.02

    def text(wall: float, cap: str = "") -> str:
        beam, hub = (thin, thick) if inner == "rest" else (thick, thin)
        walls = f'section = {{ type = "{hollow}", wall = {wall} }}\n'
        whole = HEAD.replace("thickness = 0.012\nwidth = 0.02\n", f"thickness = {beam}\nwidth = {beam}\n{walls}")
        return (
            whole + SUPPORTS + HUB.replace("0.02\n", f"{hub}\nwidth = {hub}\n{walls}") + cap + "[mesh]\ndimension = 3\n"
        )

    size = f'thickness = {thick}\nwidth = {thick}\nsection = "{solid}"\n'
    caps = "".join(
        f'[[segment]]\nname = "cap{i}"\nfrom = {a}\nto = {b}\n{size}'
        for i, (a, b) in enumerate(((0.19, 0.2), (0.3, 0.31)))
    )
    (fault,) = faults_of(written(tmp_path, text(0.002)))
    assert_says(fault, ["touches no wall", "a solid segment between them", "thicker than 0.005 m"])
    assert read_case(written(tmp_path, text(0.002, caps))).segment
    assert faults_of(written(tmp_path, text(0.00499)))


def test_a_mesh_file_has_no_segments(tmp_path: Path) -> None:
    (tmp_path / "beam.msh").touch()
    faults = faults_of(written(tmp_path, GOOD + '[mesh]\nfile = "beam.msh"\n'))
    assert_says(faults[0], ["[mesh] file", "with the segment hub", "cells end where segments do"])


def test_a_case_with_segments_is_written_and_read_again(tmp_path: Path) -> None:
    case = read_case(written(tmp_path, SOLID), ["segment.hub.thickness=0.03"])
    assert read_case_text(case_to_toml(case)) == case
    assert case.profile.at(0.25).beam.thickness == 0.03
    assert case.profile.at(0.5).material.yield_stress is None


def test_round_segments_are_as_wide_as_thick(tmp_path: Path) -> None:
    """A journal needs its diameter once."""
    text = SOLID.replace("[beam]\n", '[beam]\nsection = "round"\n').replace("width = 0.02", "width = 0.012")
    journal = read_case(written(tmp_path, text)).profile.at(0.25).beam
    assert (journal.thickness, journal.width, journal.section.type) == (0.02, 0.02, "round")


def test_points_on_either_side_of_a_step_are_in_the_beam(tmp_path: Path) -> None:
    """At x = 0.2 the hub of 20 mm begins; 8 mm off the axis is in it, and beside the thin part."""
    read_case(written(tmp_path, GOOD + probe("[0.2, 0.008]")))


def test_a_segment_may_be_as_the_beam(tmp_path: Path) -> None:
    """A sweep over its thickness passes through the thickness of the beam."""
    case = read_case(written(tmp_path, HEAD + SUPPORTS + HUB), ["segment.hub.thickness=0.012"])
    assert case.profile.prismatic
