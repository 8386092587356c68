"""Round holes that do not go with the rest of a case: what is said, and what to try."""

from __future__ import annotations

from pathlib import Path

import pytest

from gapbeam.solver.case.case import case_to_toml
from gapbeam.solver.case.reading.case_reader import read_case, read_case_text
from gapbeam.solver.messages.errors import CaseError
from tests.shared.case_texts import BEAM, assert_says, faults_of, written

HEAD = (
    BEAM.replace("width = 0.02\n", 'width = 0.012\nsection = "round"\n')
    + '[mesh]\ndimension = 3\n[model]\ntype = "reduced"\n'
)
HOLE = '[[support]]\nname = "a"\nfrom = 0.0\nto = 0.02\nclearance = 1e-4\nregion = "hole"\n'
OTHER = HOLE.replace('"a"', '"b"').replace("0.0\n", "0.5\n").replace("0.02", "0.52")
GOOD = HEAD + HOLE + OTHER


def walls(keys: str) -> str:
    """Return the case with a polygon."""
    return GOOD.replace('region = "hole"', f'region = {{ type = "polygon"{", " * bool(keys)}{keys} }}', 1)


def profile(angles: str, recesses: str) -> str:
    """Return the case with a profile."""
    return walls("").replace('"polygon"', f'"profile", angles = {angles}, recesses = {recesses}')


def circle(more: str = "", model: str = 'sections = "rigid"\n') -> str:
    """Return the case with circles, another model or more tables."""
    text = GOOD.replace('region = "hole"', 'region = { type = "hole", contact = "circle" }')
    return text.replace('type = "reduced"\n', 'type = "reduced"\n' + model) + more


BAD = {
    "a circle that deforms": (circle(model=""), ["contact", "reduced, whose sections deform", 'sections = "rigid"']),
    "a full circle": (
        circle(model="").replace('type = "reduced"', 'type = "full"'),
        ["the model full, whose sections deform", 'contact = "points"'],
    ),
    "a squeezed circle": (
        circle().replace("clearance = 1e-4", "clearance = -1e-5", 1),
        ["circle, with a clearance of -1e-05 m", "no direction of contact"],
    ),
    "a circle by generalized-alpha": (
        circle().replace("[time]\n", '[time]\nscheme = "generalized-alpha"\n'),
        ["[time] scheme", "generalized-alpha, with a hole that is met as a circle", "discrete-gradient"],
    ),
    "a circle by multipliers": (
        circle('[contact]\nformulation = "augmented-lagrangian"\n'),
        ["[contact] formulation", "augmented-lagrangian, with a hole that is met as a circle", "penalty"],
    ),
    "a circle that yields": (
        circle('[contact]\nlaw = { type = "elastic-plastic", yield_pressure = 2e6 }\n'),
        ["the law elastic-plastic, which keeps what has yielded"],
    ),
    "a circle that sticks": (
        circle("[contact]\nfriction = { coefficient = 0.1, static_coefficient = 0.2 }\n"),
        ["static_coefficient", "never sticks to a point"],
    ),
    "a circle of a support that sticks": (
        circle().replace("clearance = 1e-4", "clearance = 1e-4\nfriction = 0.1\nstatic_friction = 0.2", 1),
        ["[[support]]", "static_friction", "0.2, with a hole that is met as a circle", "leave static_friction out"],
    ),
    "a circle with a body": (
        circle().replace("clearance = 1e-4", "clearance = 1e-4\nbody = { mass = 1.0, stiffness = 1e6 }", 1),
        ["circle, of a support with a body of its own", "holes that stand still or move as loads say"],
    ),
    "a circle that closes": (
        circle(
            '[[load]]\ntype = "clearance_change"\nname = "m"\nsupport = "a"\n'
            "times = [0.0, 0.1]\nchanges = [0.0, -1.5e-4]\n"
        ),
        ["changes", "-0.00015 m, which leaves no play in a, a hole that is met as a circle", "above -0.0001 m"],
    ),
    "a circle that wears by points": (
        circle('[wear]\ncoefficient = 2e-14\narea = 1e-3\ngrowth = "local"\n'),
        ["[wear] growth", "local, with a hole that is met as a circle", "even"],
    ),
    "a circle of harmonics": (
        circle('[analysis]\ntype = "periodic"\nmethod = "harmonic-balance"\n'),
        ["[analysis] method", "harmonic-balance, with a hole that is met as a circle", "shooting"],
    ),
    "a circle of squares": (circle().replace('"circle"', '"square"', 1), ["square", "points", "circle"]),
    "a square beam": (GOOD.replace('section = "round"\n', ""), ["hole", "rectangle", "round section", '"slot"']),
    "a slice": (GOOD.replace("dimension = 3", "dimension = 2"), ["dimension", "3", "equally wide"]),
    "nitsche": (
        GOOD.replace('type = "reduced"', 'type = "full"') + '[contact]\nformulation = "nitsche"\n',
        ["nitsche, with a hole", "penalty"],
    ),
    "out of line": (
        GOOD.replace("clearance = 1e-4", "clearance = 1e-4\noffset = 2e-4", 1),
        ["0.0002 m", "0.0001 m in the wall", "smaller offset"],
    ),
    "a slot in a hole": (
        GOOD + '[[support]]\nname = "c"\nfrom = 0.51\nto = 0.53\nclearance = 1e-4\n',
        ["b and c both stand below and above"],
    ),
    "points": (GOOD + "[contact]\npoints = [0.01, 0.51]\n", ["no points on a round section"]),
    "a mesh file": (
        GOOD.replace("dimension = 3", 'dimension = 3\nfile = "tube.msh"'),
        ["hole, with a mesh file", "leave file out"],
    ),
    "an unknown region": (GOOD.replace('"hole"', '"ring"', 1), ["ring", "hole", "slot", "stop"]),
    "no walls": (walls(""), ["walls", "nothing", "directions of the walls"]),
    "an empty list of walls": (walls("walls = []"), ["walls", "1 to 24 numbers"]),
    "the same wall twice": (walls("walls = [30.0, 150.0, 390.0]"), ["390", "at least 15 degrees apart"]),
    "walls that nearly agree": (walls("walls = [-179.5, 0.0, 180.0]"), ["at least 15 degrees apart"]),
    "a recess too few": (walls("walls = [-45.0, 45.0], recesses = [0.0]"), ["1 for 2 walls", "or none"]),
    "walls that are words": (walls('walls = ["left", "right"]'), ["walls", "left"]),
    "a wall in the beam": (
        walls("walls = [-45.0, 45.0]").replace("clearance = 1e-4", "clearance = 1e-4\nlateral = 3e-4", 1),
        ["lateral", "in the wall", "smaller lateral"],
    ),
    "angles that go back": (profile("[0.0, 180.0, 90.0]", "[0.0, 0.0, 0.0]"), ["ascending order"]),
    "more than a turn": (profile("[0.0, 180.0, 360.0]", "[0.0, 0.0, 0.0]"), ["repeats the first", "less than 360"]),
    "two angles": (profile("[0.0, 180.0]", "[0.0, 0.0]"), ["angles", "3 to 3600 numbers"]),
    "recesses of another number": (profile("[0.0, 90.0, 180.0]", "[0.0, 0.0]"), ["2 for 3 angles"]),
    "a steep profile": (profile("[0.0, 1.0, 180.0]", "[0.0, 2e-4, 0.0]"), ["slope of", '"polygon"']),
    "a polygon around a square beam": (
        walls("walls = [-45.0, 45.0]").replace('section = "round"\n', ""),
        ["polygon, around the section", "round section"],
    ),
    "a slot moved aside": (
        GOOD.replace("clearance = 1e-4", "clearance = 1e-4\nlateral = 1e-5", 1).replace('"hole"', '"slot"', 1),
        ["lateral", "for a slot", "no lateral offset"],
    ),
    "a steep support": (GOOD.replace("clearance = 1e-4", "clearance = 1e-4\ntilt = 5.0", 1), ["tilt", "5", "0.1"]),
}


@pytest.mark.parametrize("name", BAD)
def test_holes_that_do_not_fit_are_refused(name: str, tmp_path: Path) -> None:
    """With the key, what was found, what was expected and what to try."""
    whole, words = BAD[name]
    assert_says("\n".join(map(str, faults_of(written(tmp_path, whole)))), words)


REGION, STIFFNESS = 'region = { type = "hole", contact = "circle" }', "support_stiffness = 1e6"
NO_WAYS = ("a circle that deforms", "a circle of squares")  # the stiffness of the whole keeps sections; a wrong word
WAYS = [REGION, f'region = "hole"\n{STIFFNESS}', f"{REGION}\n{STIFFNESS}"]


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("name", [name for name, (text, _) in BAD.items() if REGION in text and name not in NO_WAYS])
def test_advice_to_take_points_leaves_no_circle(name: str, way: str, tmp_path: Path) -> None:
    """Advice followed to the letter at all holes, however a circle was asked for, leaves no fault that names one."""
    text = BAD[name][0].replace(REGION, way)
    for fault in faults_of(written(tmp_path, text)):
        hint = fault.hint or ""
        if 'contact = "points"' in hint:
            text = text.replace('contact = "circle"', 'contact = "points"')
        if "stiffness, per area" in hint:
            text = text.replace(STIFFNESS, "stiffness = 1e10")
    try:
        read_case(written(tmp_path, text))
    except CaseError as refused:
        assert "circle" not in str(refused)  # noqa: PT017


def test_a_beam_rests_in_holes_alone(tmp_path: Path) -> None:
    """A hole carries the weight; the case is written as it was read."""
    case = read_case(written(tmp_path, GOOD))
    assert read_case_text(case_to_toml(case)) == case
    assert [face.name for face in case.layout.faces] == ["a_hole", "b_hole"]
    assert [length for _, length in case.layout.spans()] == pytest.approx([0.48])
