"""Supports that move and do not fit the rest of a case: what is said, where, and what to try."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import gapbeam
from gapbeam.solver.case.case import case_to_toml
from gapbeam.solver.case.computed_defaults import contact_stiffness
from gapbeam.solver.case.reading.case_reader import read_case, read_case_text
from gapbeam.solver.loads.support_walls import interference
from tests.shared.case_texts import BEAM as HEAD
from tests.shared.case_texts import assert_says, faults_of, written

FRONT = '[[support]]\nname = "front"\nfrom = 0.0\nto = 0.02\nclearance = 2e-4\n'
BACK = '[[support]]\nname = "back"\nfrom = 0.5\nto = 0.52\nclearance = 4e-4\n'
MOTION = '[[load]]\ntype = "support_motion"\nsupport = "back"\namplitude = 1e-4\nfrequency = 20.0\nramp = 0.05\n'
CLOSURE = '[[load]]\ntype = "clearance_change"\nsupport = "front"\ntimes = [0.0, 0.01]\nchanges = [0.0, -1e-4]\n'
GOOD = HEAD + FRONT + BACK + MOTION + CLOSURE

BAD = {
    "no support of that name": (
        GOOD.replace('support = "back"', 'support = "bakc"'),
        ["[[load]]", "support", '"bakc"', "front or back"],
    ),
    "which support": (
        GOOD.replace('support = "back"\n', ""),
        ["support_motion without the key support, in a case of 2 supports", "front or back", "base_motion moves all"],
    ),
    "along the beam": (
        GOOD.replace("ramp = 0.05", "direction = [1.0, 1.0]"),
        ["direction", "with a part along the beam", "changes no gap"],
    ),
    "times that do not ascend": (
        GOOD.replace("[0.0, 0.01]", "[0.0, 0.02, 0.01]").replace("[0.0, -1e-4]", "[0.0, -1e-4, 0.0]"),
        ["times", "0.01 s after 0.02 s, in place 3", "ascending"],
    ),
    "a first time that is not 0": (
        GOOD.replace("[0.0, 0.01]", "[0.005, 0.01]"),
        ["times", "a first time of 0.005 s", "0.0, where the run starts"],
    ),
    "another number of changes": (
        GOOD.replace("[0.0, 0.01]", "[0.0, 0.01, 0.02]"),
        ["changes", "2 for 3 times", "one change for each time"],
    ),
    "a first change that is not 0": (
        GOOD.replace("[0.0, -1e-4]", "[1e-5, -1e-4]"),
        ["changes", "1e-05 m at t = 0", "take 1e-05 m off all of them"],
    ),
    "through the beam": (
        GOOD.replace("[0.0, -1e-4]", "[0.0, -0.1]"),
        ["changes", "-0.1 m, which makes an interference of", "at most", "is it in mm? In m it is -0.0001"],
    ),
    "one row": (GOOD.replace("[0.0, 0.01]", "[0.0]").replace("[0.0, -1e-4]", "[0.0]"), ["times", "2"]),
    "unknown key": (GOOD.replace("changes =", "change ="), ["unknown key `change`", "changes"]),
    "no number": (GOOD.replace("[0.0, -1e-4]", '[0.0, "x"]'), ["changes", "number"]),
    "a period": (
        GOOD + '[analysis]\ntype = "periodic"\n',
        ["analysis", '"periodic", with support_motion of the support back', "stay where they are", '"transient"'],
    ),
    "no file": (
        GOOD.replace('"support_motion"', '"recorded_support_motion"\nfile = "nowhere.csv"').replace(
            "amplitude = 1e-4\nfrequency = 20.0\n", ""
        ),
        ["file", "nowhere.csv"],
    ),
}


def test_the_good_case_is_good() -> None:
    """Nothing is wrong with the case that the others are made from, and it is written and read as it is."""
    case = read_case_text(GOOD)
    assert read_case_text(case_to_toml(case)) == case


@pytest.mark.parametrize("name", BAD)
def test_bad_motions_are_refused(name: str, tmp_path: Path) -> None:
    """Each is refused with what was found, what was expected, and where."""
    text, words = BAD[name]
    assert_says(faults_of(written(tmp_path, text)), words)


def test_all_faults_are_reported_together(tmp_path: Path) -> None:
    """A name, a direction and a table that are wrong are three faults of one message."""
    bad = GOOD.replace('support = "front"', 'support = "frnt"').replace("ramp = 0.05", "direction = [1.0, 0.0]")
    faults = faults_of(written(tmp_path, bad.replace("[0.0, 0.01]", "[0.0, 0.0]")))
    for words in (['"frnt"'], ["along the beam"], ["0 s after 0 s"]):
        assert_says(faults, words)


def test_the_only_support_needs_no_name(tmp_path: Path) -> None:
    """Base and gland move as the only support does; a motion sideways is for what is met around the beam."""
    base = HEAD + "[support]\nlength = 0.05\nclearance = 1e-4\n" + MOTION.replace('support = "back"\n', "")
    assert read_case(written(tmp_path, base)).load[-1].place.support is None
    solid = base.replace("ramp = 0.05", "direction = [0.0, 1.0, 1.0]") + "[mesh]\ndimension = 3\n"
    assert_says(faults_of(written(tmp_path, solid)), ["direction", "no part sideways", 'region "hole"'])


def test_a_jump_of_the_speed_is_warned_of() -> None:
    """A sine without a ramp starts with its largest speed."""
    loud = read_case_text(GOOD.replace("ramp = 0.05", "ramp = 0.0")).load[-2]
    assert "jumps to a speed of 0.0126 m/s" in "".join(loud.unusual_in_run(1.0))
    still = read_case_text(GOOD.replace("ramp = 0.05", "phase = 90.0")).load[-2]
    assert "".join(still.unusual_in_run(1.0)) == ""


def test_friction_around_a_moving_beam_is_refused() -> None:
    """The slip of a hole that moves across the beam is not followed; of one that closes there is none."""
    tables = {
        "beam": {"length": 0.6, "thickness": 0.02, "width": 0.02, "section": "round"},
        "material": {"young_modulus": 2e11, "poisson_ratio": 0.3, "density": 7850.0},
        "support": [{"name": "bore", "from": 0.0, "to": 0.05, "clearance": 1e-4, "region": "hole"}],
        "mesh": {"dimension": 3},
        "contact": {"friction": {"coefficient": 0.2}},
        "load": [{"type": "support_motion", "amplitude": 1e-4, "frequency": 5.0, "ramp": 0.1}],
        "time": {"end": 0.01, "step": 1e-4},
    }
    with pytest.raises(gapbeam.CaseError, match=r"friction = 0\.0 in"):
        gapbeam.read_case(tables)
    closing = {"type": "clearance_change", "times": [0.0, 0.01], "changes": [0.0, -1e-5]}
    assert gapbeam.read_case(tables | {"load": [closing]}).load[0].travel == (-1e-5, 0.0)


def test_rates_are_those_of_the_motions(tmp_path: Path) -> None:
    """Of all loads that move a support, the rate is the derivative of the motion, by central differences."""
    times = np.linspace(0.0, 0.2, 41)
    (tmp_path / "w.csv").write_text("".join(f"{t:.9g} {1e-4 * np.sin(40.0 * t):.9g}\n" for t in times.tolist()))
    recorded = '[[load]]\ntype = "recorded_support_motion"\nname = "r"\nsupport = "back"\nfile = "w.csv"\nramp = 0.03\n'
    case = read_case(written(tmp_path, GOOD + recorded))
    at, small = np.linspace(0.0023, 0.0983, 97), 1.0e-6
    for load in case.load[1:]:
        function = load.time_function()
        assert function.rate is not None
        slopes = (function.value(at + small) - function.value(at - small)) / (2.0 * small)
        assert np.max(np.abs(slopes)) > 1.0e-4
        assert function.rate(at) == pytest.approx(slopes, abs=1e-5 * np.max(np.abs(slopes)))


def test_a_closure_counts_in_the_computed_stiffness() -> None:
    """The interference that closures bring about is added up over the loads of a support; it stiffens the contact."""
    second = CLOSURE.replace("-1e-4]", "-3e-4]") + 'name = "second"\n'
    case = read_case_text(GOOD + second)
    assert interference(case.load, case.layout) == pytest.approx(2e-4)
    assert interference((), case.layout) == 0.0
    open_case = read_case_text(GOOD)
    stiff, soft = (contact_stiffness(one, 0.1, 1.0).value for one in (case, open_case))
    assert stiff > 2.0 * soft
