"""Bodies of supports that contradict the rest of a case, and what their table gives."""

from __future__ import annotations

from math import pi
from pathlib import Path

import numpy as np
import pytest

from gapbeam.solver.case.case import case_to_toml
from gapbeam.solver.case.computed_defaults import contact_damping, lightest_supported
from gapbeam.solver.case.reading.case_reader import read_case, read_case_text
from gapbeam.solver.models.time_step import contact_duration, frequency_of_interest
from gapbeam.solver.supports.layout import body_motions, body_shifts
from tests.shared.case_texts import BEAM, assert_says, faults_of, written

GOOD = (
    BEAM
    + """[[support]]
name = "left"
from = 0.0
to = 0.02
clearance = 1e-3

[[support]]
name = "soft"
from = 0.58
to = 0.6
clearance = 1e-3
body = { mass = 0.2, stiffness = 1e5, damping = 3.0 }

[model]
type = "beam"

[[load]]
type = "support_motion"
support = "left"
amplitude = 1e-4
frequency = 20.0
"""
)

BAD = {
    "a mesh": (
        GOOD.replace('"beam"\n\n[[load]]', '"full"\n\n[[load]]'),
        ["body", "0.2 kg, with the model full", 'type = "reduced" in [model]'],
    ),
    "a motion of its own": (
        GOOD.replace('support = "left"', 'support = "soft"'),
        ["support_motion of the support soft, which has a body", "base_motion moves the feet"],
    ),
    "no mass": (GOOD.replace("mass = 0.2, ", ""), ["body", "mass", "the key is missing"]),
    "mass 0": (GOOD.replace("mass = 0.2", "mass = 0.0"), ["mass", "greater than 0"]),
    "no spring": (GOOD.replace("stiffness = 1e5", "stiffness = 0.0"), ["stiffness", "greater than 0"]),
    "negative damper": (GOOD.replace("damping = 3.0", "damping = -3.0"), ["damping", "not less than 0"]),
    "unknown key": (GOOD.replace("damping = 3.0", "dampings = 3.0"), ["dampings", "damping"]),
    "a number": (GOOD.replace("{ mass = 0.2, stiffness = 1e5, damping = 3.0 }", "0.2"), ["body", "0.2"]),
    "base and gland": (
        BEAM + "[support]\nlength = 0.05\nclearance = 1e-4\nbody = { mass = 1.0, stiffness = 1e5 }\n",
        ["body"],
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_bodies_are_refused(name: str, tmp_path: Path) -> None:
    text, words = BAD[name]
    assert_says(faults_of(written(tmp_path, text)), words)


def test_a_good_one_is_read_and_written(tmp_path: Path) -> None:
    case = read_case(written(tmp_path, GOOD))
    assert read_case_text(case_to_toml(case)) == case
    changed = read_case(written(tmp_path, GOOD), ["support.soft.body.stiffness=4e5"])
    assert changed.layout.supports[1].body.stiffness == 4e5
    assert changed.layout.supports[1].body.frequency == pytest.approx(225.079, rel=1e-5)


def test_impacts_are_those_of_the_reduced_mass(tmp_path: Path) -> None:
    """Contact duration and the damping of a restitution: M m / (M + m) per area instead of M."""
    case = read_case(written(tmp_path, GOOD), ['contact.law={type = "kelvin-voigt", restitution = 0.5}'])
    piece, (rigid, soft) = lightest_supported(case), case.layout.supports
    beam, body = piece.face_mass, 0.2 / (0.02 * case.beam.width)
    share = body / (beam + body)
    alone = case.model_copy(update={"support": tuple(one.without_play() for one in case.support)})
    assert contact_duration(case, 1e12) == pytest.approx(contact_duration(alone, 1e12) * share**0.5, rel=1e-12)
    dampings = [contact_damping(case, 1e12, one).value for one in (rigid, soft)]
    assert dampings[1] == pytest.approx(dampings[0] * share**0.5, rel=1e-12)


def test_frequency_of_interest(tmp_path: Path) -> None:
    """A body on its spring counts, but for one that is rigid beside the bending of the beam."""
    usual = frequency_of_interest(read_case(written(tmp_path, GOOD)))
    for share, counts in ((0.5, False), (3.0, True), (20.0, False)):
        stiffness = 0.2 * (2.0 * pi * share * usual[0]) ** 2
        found = frequency_of_interest(
            read_case(written(tmp_path, GOOD), [f"support.soft.body.stiffness={stiffness!r}"])
        )
        assert (found[1] == "the support soft on its spring") == counts
        assert found[0] == pytest.approx(share * usual[0] if counts else usual[0], rel=1e-12)


def test_motions_and_what_they_do_to_faces(tmp_path: Path) -> None:
    """One motion of a slot; upward, its lower gap closes and its upper one opens."""
    case = read_case(written(tmp_path, GOOD))
    (motion,) = body_motions(case.layout, case.mesh.dimension)
    assert motion.label == "soft.y"
    assert motion.face_changes() == {"soft_below": (-1.0, 0.0, 0.0), "soft_above": (1.0, 0.0, 0.0)}
    shifts = body_shifts(case.layout, np.array([0.01, 0.59]), 2)
    assert shifts.tolist() == [[[0.0, 0.0], [0.0, 1.0]]]
