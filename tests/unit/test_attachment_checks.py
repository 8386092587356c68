"""Joints, masses and fluids that contradict each other, their beam or their model: what is said, and what to try."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gapbeam.solver.case.case import case_to_toml
from gapbeam.solver.case.reading.case_reader import read_case, read_case_text
from gapbeam.solver.loads.attachments import MeanMotion, bending_rank
from gapbeam.solver.system.operators import Array
from tests.shared.case_texts import BEAM, assert_says, faults_of, written

HEAD = (
    BEAM
    + """[[support]]
name = "stop"
from = 0.58
to = 0.6
clearance = 1e-3
"""
)
ROOT = '[[joint]]\nname = "root"\ntype = "clamped"\npoint = 0.0\n'
SPRING = '[[joint]]\nname = "spring"\ntype = "elastic"\npoint = 0.3\nstiffness = { vertical = 1e5 }\n'
BALL = '[[mass]]\nname = "ball"\npoint = 0.5\nmass = 0.2\n'
WATER = '[[fluid]]\nname = "water"\nfrom = 0.1\nto = 0.5\nadded_mass = 1.0\n'
GOOD = HEAD + ROOT + SPRING + BALL + WATER

BAD = {
    "same name of joints": (GOOD.replace('"spring"', '"root"'), ["number 2", '"root"', "every joint"]),
    "same name of masses": (GOOD + BALL.replace("0.5", "0.4"), ["number 2", '"ball"', "every mass"]),
    "joint off the beam": (GOOD.replace("point = 0.3", "point = 0.7"), ["x = 0.7 m, outside the beam", "0.6 m"]),
    "joint in mm": (GOOD.replace("point = 0.3", "point = 300.0"), ["is it in mm? In m it is 0.3"]),
    "mass off the beam": (GOOD.replace("point = 0.5", "point = -0.5"), ["x = -0.5 m, outside the beam"]),
    "joints in one place": (
        GOOD.replace("point = 0.3", "point = 0.0"),
        ["0 m, where the joint root is already", "leave vertical out of the stiffness and damping of spring"],
    ),
    "guided and pinned in one place": (
        GOOD.replace(SPRING, "")
        + ROOT.replace("root", "slide").replace("clamped", "guided").replace("0.0", "0.3")
        + ROOT.replace("root", "pin").replace("clamped", "pinned").replace("0.0", "0.3"),
        ["0.3 m, where the joint slide is already", 'one joint with type = "clamped"'],
    ),
    "elastic without springs": (
        GOOD.replace("vertical = 1e5", "vertical = 0.0"),
        ["without springs and dampers", "stiffness = { vertical = 1e5 }"],
    ),
    "motion of a solid": (
        GOOD.replace("vertical = 1e5", "twist = 1e5"),
        ["twist, a motion that a slice (dimension = 2) does not have", "axial, vertical or rotation"],
    ),
    "rigid and clamped": (
        GOOD + '[model]\ntype = "rigid"\n',
        ["rigid, with joints that neither let the body rise nor rotate", 'type = "beam"'],
    ),
    "explicit and clamped": (
        GOOD + '[time.scheme]\ntype = "central-difference"\n',
        ["central-difference, with the joint root, which is clamped", "an elastic joint"],
    ),
    "mass on massless nodes": (
        GOOD.replace("point = 0.5", "point = 0.59") + '[contact]\nmass = "redistributed"\n',
        ["x = 0.59 m, in a support", "move the mass out"],
    ),
    "same name of fluids": (GOOD + WATER, ["number 2", '"water"', "every fluid"]),
    "fluid off the beam": (GOOD.replace("to = 0.5", "to = 0.7"), ["0.7 m, beyond the end of the beam", "0.6 m"]),
    "fluid in mm": (GOOD.replace("to = 0.5\n", "to = 500.0\n"), ["is it in mm? In m it is 0.5"]),
    "fluid backwards": (GOOD.replace("from = 0.1", "from = 0.55"), ["0.5 m, where the fluid begins at 0.55", "swap"]),
    "fluid that does nothing": (
        GOOD.replace("added_mass = 1.0", "added_mass = 0.0"),
        ["water", "without added mass, displaced mass and damping", "added_mass = 0.5"],
    ),
    "negative damping of fluid": (GOOD + "damping = -1.0\n", ["water", "damping", "not less than 0"]),
    "fluid on massless nodes": (
        GOOD.replace("to = 0.5\n", "to = 0.6\n") + '[contact]\nmass = "redistributed"\n',
        ["water", "through the support stop, whose contact nodes have no mass", 'contact.mass = "consistent"'],
    ),
    "unknown joint": (GOOD.replace('"clamped"', '"welded"'), ['"welded"', "clamped"]),
    "no kind": (GOOD.replace('type = "clamped"\n', ""), ["type", "the key is missing"]),
    "springs of a clamp": (
        GOOD.replace('type = "clamped"\n', 'type = "clamped"\nstiffness = { vertical = 1e5 }\n'),
        ["unknown table `stiffness`", 'type "elastic"'],
    ),
    "misspelled motion": (GOOD.replace("vertical", "vertcal"), ["unknown key `vertcal`", "`vertical`"]),
    "negative stiffness": (GOOD.replace("1e5", "-1e5"), ["vertical", "-100000.0", "not less than 0"]),
    "no mass": (GOOD.replace("mass = 0.2", "mass = 0.0"), ["mass", "greater than 0"]),
    "negative inertia": (
        GOOD.replace("mass = 0.2", "mass = 0.2\nrotary_inertia = -1e-4"),
        ["rotary_inertia", "not less than 0"],
    ),
    "an offset of a solid": (
        GOOD.replace("mass = 0.2", "mass = 0.2\noffset = [0.0, 0.0, -0.03]"),
        [
            "3 components with dimension = 2",
            "[x, z]: a slice neither twists",
            "offset = [0, -0.03]",
        ],
    ),
    "an offset beside a slice": (
        GOOD.replace("mass = 0.2", "mass = 0.2\noffset = [0.0, 0.01, -0.03]"),
        ["3 components with dimension = 2", "dimension = 3 for a mass beside the bending plane"],
    ),
    "an offset of a slice": (
        GOOD.replace("mass = 0.2", "mass = 0.2\noffset = [0.0, -0.03]") + "[mesh]\ndimension = 3\n",
        ["2 components with dimension = 3", "[x, y, z]", "offset = [0, 0, -0.03]"],
    ),
    "an offset in mm": (
        GOOD.replace("mass = 0.2", "mass = 0.2\noffset = [0.0, -30.0]"),
        ["30 m", "at most the length of the beam, 0.6 m", "is it in mm? In m it is 0.03"],
    ),
    "an offset along the axis alone": (GOOD.replace("mass = 0.2", "mass = 0.2\noffset = 0.1"), ["offset", "0.1"]),
    "a point with two coordinates": (GOOD.replace("point = 0.5", "point = [0.5, 0.0]"), ["[[mass]]", "a number"]),
    "a table for an array": (HEAD + ROOT.replace("[[joint]]", "[joint]"), ["joint"]),
    "nothing below": (
        HEAD.replace("clearance", 'region = {type = "stop", side = "above"}\nclearance') + BALL,
        ["above the beam only, with gravity"],
    ),
}


@pytest.mark.parametrize(("text", "words"), BAD.values(), ids=list(BAD))
def test_bad_joints_and_masses_are_explained(text: str, words: list[str], tmp_path: Path) -> None:
    """One fault, with its place, what was found and what was expected."""
    assert_says("\n".join(map(str, faults_of(written(tmp_path, text)))), words)


def test_joints_carry_a_beam_below_its_stops(tmp_path: Path) -> None:
    """With a joint that holds it, a beam needs no plane below."""
    text = HEAD.replace("clearance", 'region = {type = "stop", side = "above"}\nclearance') + ROOT
    assert read_case(written(tmp_path, text)).joint[0].name == "root"


def test_good_joints_and_masses_are_read_written_and_changed(tmp_path: Path) -> None:
    """A case file comes back equal; overrides reach joints and masses by name."""
    case = read_case(written(tmp_path, GOOD))
    assert read_case_text(case_to_toml(case)) == case
    changed = read_case(written(tmp_path, GOOD), ["mass.ball.mass=0.4", "joint.spring.stiffness.vertical=2e5"])
    assert changed.mass[0].mass == 0.4
    assert [one.attachment.stiffness for one in changed.joint[1].attached()] == [2e5]
    wet = read_case(written(tmp_path, GOOD), ["fluid.water.added_mass=2.0", "fluid.water.to=0.6"]).fluid[0]
    assert (wet.added_mass, wet.end, wet.displaced_mass) == (2.0, 0.6, 0.0)


def test_what_joints_leave_of_rigid_motions(tmp_path: Path) -> None:
    """A clamp takes heave and pitch, one pin takes one of them, two take both; springs count where asked for."""
    pin, far = ROOT.replace("clamped", "pinned"), ROOT.replace("clamped", "pinned").replace("0.0", "0.5")
    ranks = []
    for joints in ("", ROOT, pin, pin + far.replace("root", "far"), SPRING):
        case = read_case(written(tmp_path, HEAD + joints))
        ranks.append((bending_rank(case.joint, held_only=True), bending_rank(case.joint, held_only=False)))
    assert ranks == [(0, 0), (2, 2), (1, 1), (2, 2), (0, 1)]


def _weights(motion: MeanMotion, across: Array, weights: Array) -> Array:
    """Return what gives a motion from the displacements of parts of a section, (k, 3)."""
    fields = np.column_stack([np.ones(len(weights)), across])
    return np.asarray(weights[:, None] * fields @ motion.factors(fields.T @ (weights[:, None] * fields)).T)


@pytest.mark.parametrize("name", ["axial", "vertical", "lateral", "rotation", "lateral_rotation", "twist"])
def test_mean_motions_are_those_of_a_rigid_section(name: str) -> None:
    """A section that moves as a rigid one: its own motion 1, all others 0, also where its center lies elsewhere."""
    across = np.array([[y, z] for y in (-0.01, 0.002, 0.013) for z in (-0.02, 0.005)])
    weights = np.linspace(1.0, 2.0, len(across))
    y, z = (across - weights @ across / weights.sum()).T
    zero, one = np.zeros(len(across)), np.ones(len(across))
    rigid = {
        "axial": (one, zero, zero),
        "vertical": (zero, zero, one),
        "lateral": (zero, one, zero),
        "rotation": (-z, zero, zero),
        "lateral_rotation": (-y, zero, zero),
        "twist": (zero, -z, y),
    }
    symmetric = _weights(MeanMotion(0.0, name), across, weights)  # type: ignore[arg-type]
    moved = {other: float(np.sum(symmetric * np.stack(parts, axis=1))) for other, parts in rigid.items()}
    assert moved[name] == pytest.approx(1.0)
    assert all(value == pytest.approx(0.0, abs=1e-12) for other, value in moved.items() if other != name)


def test_an_offset_is_carried_by_a_rigid_section() -> None:
    """The displacement of a point is U + omega x r by numpy, whatever the section and wherever its center lies."""
    rng = np.random.default_rng(1)
    across, weights = rng.uniform(-0.02, 0.03, (7, 2)), rng.uniform(1.0, 2.0, 7)
    center = np.array([0.0, *(weights @ across / weights.sum())])
    moved, turned, offset = rng.normal(size=3), rng.normal(size=3), rng.normal(size=3)
    places = np.column_stack([np.zeros(7), across]) - center
    section = moved + np.cross(turned, places)
    wanted = moved + np.cross(turned, offset)
    for name, value in zip(("axial", "lateral", "vertical"), wanted, strict=True):
        found = _weights(MeanMotion(0.0, name, tuple(offset)), across, weights)  # type: ignore[arg-type]
        assert np.sum(found * section) == pytest.approx(value)
