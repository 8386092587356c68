"""Supports that contradict each other, their beam or their loads: what is said, where, and what to try."""

from __future__ import annotations

from pathlib import Path

import pytest

from gapbeam.meshes.rank_zero import ONE_RANK
from gapbeam.solver.case.case import case_to_toml
from gapbeam.solver.case.reading.case_reader import read_case, read_case_text
from gapbeam.solver.models.contact_setting import friction_of
from gapbeam.solver.models.model import build_body
from tests.shared.case_texts import BEAM as HEAD
from tests.shared.case_texts import assert_says, faults_of, written

FRONT = '[[support]]\nname = "front"\nfrom = 0.0\nto = 0.02\nclearance = 2e-4\n'
BACK = '[[support]]\nname = "back"\nfrom = 0.5\nto = 0.52\nclearance = 4e-4\noffset = 1e-4\n'
GOOD = HEAD + FRONT + BACK

BAD = {
    "same name": (GOOD.replace('"back"', '"front"'), ["number 2", '"front"', "also the name of number 1"]),
    "ends before it begins": (
        GOOD.replace("to = 0.52", "to = 0.48"),
        ["back", "0.48 m", "more than from", "swap them"],
    ),
    "no length": (GOOD.replace("to = 0.52", "to = 0.5"), ["more than from, 0.5 m", "a support has a length"]),
    "beyond the beam": (GOOD.replace("to = 0.52", "to = 0.62"), ["0.62 m, beyond the end", "at most", "0.6 m"]),
    "in mm": (
        GOOD.replace("from = 0.5\nto = 0.52", "from = 500.0\nto = 520.0"),
        ["520 m", "is it in mm? In m it is 0.52"],
    ),
    "overlap": (
        GOOD.replace("from = 0.5", "from = 0.01"),
        ["front and back both stand", "below and above", "from x = 0.01 to x = 0.02 m", "try", "from = 0.02"],
    ),
    "overlap of a stop": (
        GOOD + '[[support]]\nname = "s"\nfrom = 0.51\nto = 0.53\nclearance = 1e-4\nregion = {type = "stop"}\n',
        ["back and s both stand below the beam", "from x = 0.51 to x = 0.52"],
    ),
    "nothing below": (
        HEAD + (FRONT + BACK).replace("clearance", 'region = {type = "stop", side = "above"}\nclearance'),
        ["above the beam only, with gravity", "at least one plane below"],
    ),
    "stiffness of a rigid support": (
        GOOD.replace("offset", "stiffness = 1e9\noffset") + '[contact]\nformulation = "unilateral"\n',
        ["back", "stiffness", "1e+09 Pa/m, with the formulation unilateral", "rigid supports", "leave stiffness out"],
    ),
    "damping beside a law that brings its own": (
        GOOD.replace("offset", "damping = 10.0\noffset")
        + '[contact]\nstiffness = 1e12\nlaw = {type = "hunt-crossley", restitution = 0.5}\n',
        ["back", "damping", "10 Pa s/m", "the law hunt-crossley brings its own", "leave damping out"],
    ),
    "damping beside a restitution": (
        GOOD.replace("offset", "damping = 10.0\noffset")
        + '[contact]\nlaw = {type = "kelvin-voigt", restitution = 0.5}\n',
        ["back", "damping", "one of the two", "leave damping out, or give every support its damping"],
    ),
    "static friction of one alone": (
        GOOD.replace("offset", "static_friction = 0.3\noffset"),
        ["back", "static_friction", "0.3, without friction of points that slide", "friction = 0.2 beside"],
    ),
    "static friction below friction": (
        GOOD.replace("offset", "static_friction = 0.1\noffset") + "[contact]\nfriction = { coefficient = 0.2 }\n",
        ["back", "static_friction", "0.1, less than the 0.2 of points that slide", "static_friction = 0.3"],
    ),
    "no stiffness": (GOOD.replace("offset", "stiffness = 0.0\noffset"), ["back", "stiffness", "0.0", "greater than 0"]),
    "negative friction": (
        GOOD.replace("offset", "friction = -0.1\noffset"),
        ["back", "friction", "-0.1", "a number from 0 to 100"],
    ),
    "unknown region": (
        GOOD.replace("offset", 'region = "slit"\noffset'),
        ['"slit"', '"slot", "stop", "hole", "polygon" or "profile"', "slot"],
    ),
    "unknown side": (
        GOOD.replace("offset", 'region = {type = "stop", side = "left"}\noffset'),
        ["side", '"left"', '"below" or "above"'],
    ),
    "side of a slot": (
        GOOD.replace("offset", 'region = {type = "slot", side = "below"}\noffset'),
        ["unknown key `side`", 'type "stop"'],
    ),
    "misspelled key": (GOOD.replace("offset", "ofset"), ["unknown key `ofset`", "did you mean `offset`?"]),
    "key of the table": (GOOD.replace("to = 0.52", "length = 0.02"), ["unknown key `length`"]),
    "missing place": (GOOD.replace("to = 0.52\n", ""), ["number 2", "back", "the key is missing", "to = 0.22"]),
    "missing name": (GOOD.replace('name = "back"\n', ""), ["number 2", "name", "the key is missing"]),
    "negative place": (GOOD.replace("from = 0.0", "from = -0.1"), ["from", "-0.1", "not less than 0"]),
    "text for a number": (GOOD.replace("from = 0.5", 'from = "0.5"'), ['"0.5"', "a number"]),
    "deep interference": (GOOD.replace("4e-4", "-0.01"), ["interference of more than half the thickness"]),
    "no entry": (HEAD + "support = []\n", ["support"]),
    "contact points": (GOOD + "[contact]\npoints = [0.0, 0.02]\n", ["points with [[support]]", "leave points out"]),
    "undeformed within": (
        GOOD.replace("offset = 1e-4", "offset = 3e-4")
        + '[contact]\nformulation = "unilateral"\n[analysis]\ntype = "transient"\nstart = "undeformed"\n',
        ["undeformed, 0.0001 m within the faces", 'start = "seat"'],
    ),
    "almost at a point": (
        GOOD.replace("to = 0.52", "to = 0.5999999"),
        ["the end of the support back", "apart along x"],
    ),
    "deep switch": (GOOD + "[contact]\ntouch_depth = 3e-4\n", ["touch_depth", "far less than the clearance, 0.0002 m"]),
    "long cells": (GOOD + "[mesh]\nsupport_size = 0.03\n", ["at most the length of the support, 0.02 m"]),
    "exciter without mass": (
        GOOD + '[[load]]\ntype = "exciter"\nname = "e"\npoint = 0.51\namplitude = 1.0\nfrequency = 20.0\nmass = 0.1\n'
        'stiffness = 1e4\n[contact]\nmass = "redistributed"\n',
        ["x = 0.51 m, in the support", "above 0.52 m"],
    ),
}


@pytest.mark.parametrize(("text", "words"), BAD.values(), ids=list(BAD))
def test_bad_supports_are_explained(text: str, words: list[str], tmp_path: Path) -> None:
    """One fault, with its place, what was found and what was expected."""
    assert_says("\n".join(map(str, faults_of(written(tmp_path, text)))), words)


def test_all_faults_of_supports_are_reported_at_once(tmp_path: Path) -> None:
    """Three supports with a fault each: three faults, in the order of the file."""
    text = GOOD.replace("to = 0.52", "to = 0.62").replace("from = 0.0", "from = -1.0") + FRONT
    found = [str(fault) for fault in faults_of(written(tmp_path, text))]
    assert [word in message for word, message in zip(("-1", "0.62"), found, strict=False)] == [True, True]


def test_good_supports_are_read_written_and_changed(tmp_path: Path) -> None:
    """A case file comes back equal; overrides reach a support by its name or number, and its region."""
    case = read_case(written(tmp_path, GOOD))
    assert read_case_text(case_to_toml(case)) == case
    assert [one.name for one in case.layout.supports] == ["front", "back"]
    changed = read_case(
        written(tmp_path, GOOD),
        ["support.back.clearance=1e-3", "support.0.region.type=stop", "support.0.region.side=below"],
    )
    assert [face.name for face in changed.layout.faces] == ["front_below", "back_below", "back_above"]
    assert [face.gap for face in changed.layout.faces] == pytest.approx([2e-4, 4e-4, 6e-4])


def test_a_support_rubs_by_its_own_coefficient_alone(tmp_path: Path) -> None:
    """Without [contact.friction] others have none: as where the table has its coefficient, and the others 0."""
    beam = {"model.type": "beam"}
    rubbing = read_case(written(tmp_path, GOOD.replace("offset", "friction = 0.3\noffset")), beam)
    table = (
        GOOD.replace("clearance = 2e-4", "clearance = 2e-4\nfriction = 0.0") + "[contact.friction]\ncoefficient = 0.3\n"
    )
    cases = (rubbing, read_case(written(tmp_path, table), beam))
    bodies = [build_body(one, ONE_RANK) for one in cases]
    found = [friction_of(case, body, 1e-3).coefficient for case, body in zip(cases, bodies, strict=True)]
    assert found[0] == pytest.approx(found[1])
    assert set(found[0]) == {0.0, 0.3}
    assert read_case(written(tmp_path, GOOD.replace("offset", "friction = 0.0\noffset"))).friction is None


def test_the_table_and_the_array_are_distinguished(tmp_path: Path) -> None:
    """[support] still is the base and gland, and an override of its keys does not reach an array."""
    paper = read_case(written(tmp_path, HEAD + "[support]\nlength = 0.05\nclearance = 1e-4\n"))
    assert [face.name for face in paper.layout.faces] == ["base", "gland"]
    (fault,) = faults_of(written(tmp_path, GOOD), ["support.clearance=1e-3"])
    assert_says(fault, ["support.clearance", "front", "back"])
